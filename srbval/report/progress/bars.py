"""Progress bars for a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, TextIO

from srbval.report.progress.display import Display

if TYPE_CHECKING:
    from rich.progress import TaskID


class Bars(Display):
    """Bars drawn by rich, which locks its own state."""

    def __init__(self, stream: TextIO) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

        self._bars = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(bar_width=28),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            console=Console(file=stream),
        )
        self._ids: list[TaskID] = []
        self._stage: TaskID | None = None

    def start(self) -> None:
        """Begin to draw."""
        self._bars.start()

    def stop(self) -> None:
        """Leave the bars as they are and give the terminal back."""
        self._end_stage()
        self._bars.stop()

    def add(self, description: str, total: float | None) -> int:
        """Draw a bar; one without a total moves to and fro."""
        self._ids.append(self._bars.add_task(description, total=total))
        return len(self._ids) - 1

    def update(self, task: int, completed: float) -> None:
        """Move a bar."""
        self._bars.update(self._ids[task], completed=completed)

    def finish(self, task: int) -> None:
        """Fill a bar."""
        self._bars.update(self._ids[task], total=1.0, completed=1.0)

    def message(self, text: str) -> None:
        """Print a line above the bars."""
        self._bars.console.print(text, markup=False, highlight=False)

    def stage(self, text: str) -> None:
        """Draw a bar that moves to and fro until the next stage."""
        self._end_stage()
        self._stage = self._bars.add_task(text, total=None)

    def _end_stage(self) -> None:
        if self._stage is not None:
            self._bars.update(self._stage, total=1.0, completed=1.0)
