"""Errors that a user can act on: what was wrong, the value, the limit, what to do next.

Every expected failure raises one of these; the command line prints its text and leaves with its
`exit_code`. Anything else that is raised is a bug.
"""

from collections.abc import Collection
from typing import NamedTuple


class OpenQuestion(NamedTuple):
    """What is not stated, the option that states it with its choices, and an example of that."""

    missing: str
    option: str
    example: str

    def __str__(self) -> str:
        return f"{self.missing}: {self.option}"


class SrbvalError(Exception):
    """Base of all expected failures; `exit_code` is what the command line returns.

    Its text may quote a file, so it is made fit for a terminal: one line, no control characters, not endless. Where it
    asks for something, `questions` are what `subject` leaves open.
    """

    exit_code = 1
    longest = 1200
    subject = ""
    questions: tuple[OpenQuestion, ...] = ()

    def __init__(self, text: str) -> None:
        shown = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in self._cut(text))
        super().__init__(self._cut(shown))

    def _cut(self, text: str) -> str:
        half = self.longest // 2
        return text if len(text) <= self.longest else f"{text[:half]} ... {text[-half:]}"


class ConfigurationError(SrbvalError):
    """Wrong use: an unknown key, an impossible value, a band above Nyquist (exit code 2)."""

    exit_code = 2


class UnknownNameError(ConfigurationError):
    """A key, unit or other word that is not known; `known` are the words that are, where its text leaves them out."""

    known: Collection[str] = ()

    @classmethod
    def of(cls, text: str, name: str, known: Collection[str]) -> "UnknownNameError":
        """The error that `text` begins, which ends with the nearest of the `known` to `name`, or with all of them."""
        close = nearest(name, known)
        error = cls(f"{text}{did_you_mean(name, known)}{'' if close else '.'}")
        error.known = known if close else ()
        return error


class DataError(SrbvalError):
    """Data missing, unreadable, ambiguous or changed (exit code 3)."""

    exit_code = 3


class NoRecordingError(DataError):
    """A file of another kind, such as a licence or a report: a recording that cannot be read is a plain `DataError`."""


class NumericsError(SrbvalError):
    """The simulation failed: the status and its advice are the message (exit code 4)."""

    exit_code = 4


def nearest(word: str, known: Collection[str]) -> str | None:
    """The known word that `word` may have been meant for, None where none is alike."""
    import difflib

    return next(iter(difflib.get_close_matches(word, list(known), n=1, cutoff=0.5)), None)


def did_you_mean(word: str, known: Collection[str]) -> str:
    """The end of the refusal of `word`: the nearest of those `known`, else all of them."""
    close = nearest(word, known)
    return f"; did you mean {close!r}?" if close else f"; known: {', '.join(sorted(known))}"
