"""Progress on standard error, in the kind of display that its reader can use."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import Self, TextIO

from srbval.report.progress.bars import Bars
from srbval.report.progress.display import Display
from srbval.report.progress.lines import Lines


class Progress:
    """Show how far the work is.

    ``with Progress() as p: task = p.add("Simulate OR", total=10.0); p.update(task, 2.5); p.finish(task)``.
    `silent` shows nothing. `stream` is standard error unless given; bars are drawn when it is a terminal.
    """

    def __init__(self, *, silent: bool = False, stream: TextIO | None = None) -> None:
        stream = stream or sys.stderr
        self._display: Display
        if silent:
            self._display = Display()
        elif stream.isatty():
            self._display = Bars(stream)
        else:
            self._display = Lines(stream)

    def __enter__(self) -> Self:
        self._display.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._display.stop()

    def add(self, description: str, total: float | None = None) -> int:
        """Announce a task of `total` units (None: unknown) and return its number."""
        return self._display.add(description, total)

    def update(self, task: int, completed: float) -> None:
        """Say how many units of `task` are done."""
        self._display.update(task, completed)

    def finish(self, task: int) -> None:
        """Say that `task` is done."""
        self._display.finish(task)

    def message(self, text: str) -> None:
        """Show one line of text between the tasks."""
        self._display.message(text)

    def stage(self, text: str) -> None:
        """Say what goes on from now on; while nothing else is said, its time goes on being shown."""
        self._display.stage(text)
