"""Errors that a user can act on; the text names the value, the limit and the remedy.

Every expected failure raises one of these errors. The command line prints the text and exits with `exit_code`. Any
other exception is a bug.
"""

from collections.abc import Collection
from typing import NamedTuple


class OpenQuestion(NamedTuple):
    """Missing information, the option that supplies it with its choices, and an example of the option."""

    missing: str
    option: str
    example: str

    def __str__(self) -> str:
        return f"{self.missing}: {self.option}"


class SrbvalError(Exception):
    """Base of all expected failures; the command line returns `exit_code`.

    The text may quote a file, so control characters are escaped and its length is limited. If information is missing,
    `questions` lists everything that `subject` (a file or a recording) does not state.
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
    """Unknown key, unit or other word; `known` contains the known words if the text does not list them."""

    known: Collection[str] = ()

    @classmethod
    def of(cls, text: str, name: str, known: Collection[str]) -> "UnknownNameError":
        """Create an error whose text is `text` and a suggestion: the closest known word, otherwise all of them."""
        close = closest_word(name, known)
        error = cls(f"{text}{did_you_mean(name, known)}{'' if close else '.'}")
        error.known = known if close else ()
        return error


class DataError(SrbvalError):
    """Data missing, unreadable, ambiguous or changed (exit code 3)."""

    exit_code = 3


class NoRecordingError(DataError):
    """File that is no recording, such as a licence or a report; an unreadable recording is a plain `DataError`."""


class NumericsError(SrbvalError):
    """The simulation failed: the status and its advice are the message (exit code 4)."""

    exit_code = 4


def closest_word(word: str, known: Collection[str]) -> str | None:
    """Find the known word closest to `word`; None if none is similar."""
    import difflib

    return next(iter(difflib.get_close_matches(word, list(known), n=1, cutoff=0.5)), None)


def did_you_mean(word: str, known: Collection[str]) -> str:
    """Suggestion at the end of an error message: the closest known word, otherwise all of them."""
    close = closest_word(word, known)
    return f"; did you mean {close!r}?" if close else f"; known: {', '.join(sorted(known))}"
