"""Errors that a user can correct; each message states the value, the limit and the remedy.

Every expected failure raises one of these errors. The command line prints the text and exits with `exit_code`. Any
other exception is a bug.
"""

from collections.abc import Collection
from typing import NamedTuple


class OpenQuestion(NamedTuple):
    """Missing information about a recording, the option that supplies it, and an example of that option."""

    missing: str
    option: str
    example: str

    def __str__(self) -> str:
        return f"{self.missing}: {self.option}"


class SrbvalError(Exception):
    """Base class of all expected failures; the command line prints the message and returns `exit_code`.

    The message may quote a file, so control characters are escaped and its length is limited. If a file or recording
    lacks necessary information, `subject` is its name and `questions` lists everything that is missing.
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
    """Wrong use, such as an unknown key, an impossible value or a band above Nyquist (exit code 2)."""

    exit_code = 2


class UnknownNameError(ConfigurationError):
    """Error for an unknown word; `known` contains all accepted words, or nothing if the message lists them."""

    known: Collection[str] = ()

    @classmethod
    def of(cls, text: str, name: str, known: Collection[str]) -> "UnknownNameError":
        """Create the error; its message is `text` with the known word similar to `name`, or all if none is similar."""
        close = closest_word(name, known)
        error = cls(f"{text}{did_you_mean(name, known)}{'' if close else '.'}")
        error.known = known if close else ()
        return error


class DataError(SrbvalError):
    """Data that is missing, unreadable, ambiguous or changed (exit code 3)."""

    exit_code = 3


class NoRecordingError(DataError):
    """Error for a file that is not a recording, such as a licence; an unreadable recording raises `DataError`."""


class NumericsError(SrbvalError):
    """Failed simulation; the message contains its status and advice (exit code 4)."""

    exit_code = 4


def closest_word(word: str, known: Collection[str]) -> str | None:
    """Return the known word most similar to `word`, or None if no word is similar."""
    import difflib

    return next(iter(difflib.get_close_matches(word, list(known), n=1, cutoff=0.5)), None)


def did_you_mean(word: str, known: Collection[str]) -> str:
    """Suggestion for the end of an error message: the known word similar to `word`, or all if none is similar."""
    close = closest_word(word, known)
    return f"; did you mean {close!r}?" if close else f"; known: {', '.join(sorted(known))}"
