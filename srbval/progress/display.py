"""Progress on standard error, in the kind of display that its reader can use."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import Protocol, Self, TextIO

from srbval.progress.bars import Bars
from srbval.progress.lines import Lines


class Display(Protocol):
    """What `Bars` and `Lines` offer."""

    def start(self) -> None:
        """Begin to show."""

    def stop(self) -> None:
        """Stop showing and leave the stream as it was."""

    def show(self, task: str, fraction: float | None) -> None:
        """Show the fraction of `task` that is done, as `Progress` is called."""

    def message(self, text: str) -> None:
        """Show one line of text between the tasks."""


class ProgressDisplay:
    """A `Progress` callback that shows what it is told, while its ``with`` block lasts.

    ``with ProgressDisplay() as progress: simulate(scene, progress=progress)``. `stream` is standard error unless
    given; bars are drawn when it is a terminal, plain lines are written elsewhere.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        stream = stream or sys.stderr
        self._display: Display = Bars(stream) if stream.isatty() else Lines(stream)

    def __enter__(self) -> Self:
        self._display.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._display.stop()

    def __call__(self, task: str, fraction: float | None) -> None:
        """Show that `fraction` of `task` is done; see `Progress`."""
        self._display.show(task, fraction)

    def message(self, text: str) -> None:
        """Show one line of text between the tasks."""
        self._display.message(text)
