"""Progress bars for a terminal."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from rich.progress import TaskID


class Bars:
    """Bars drawn by rich, one per task."""

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
        self._running: dict[str, TaskID] = {}
        self._lock = threading.Lock()

    def start(self) -> None:
        """Begin to draw."""
        self._bars.start()

    def stop(self) -> None:
        """Leave the bars as they are and give the terminal back."""
        self._bars.stop()

    def show(self, task: str, fraction: float | None) -> None:
        """Draw the bar of `task`; one of unknown extent moves to and fro until it is done."""
        total = None if fraction is None else 1.0
        with self._lock:
            if task not in self._running:
                self._running[task] = self._bars.add_task(task, total=total)
            self._bars.update(self._running[task], total=total, completed=fraction)
            if fraction is not None and fraction >= 1:
                del self._running[task]

    def message(self, text: str) -> None:
        """Print a line above the bars."""
        self._bars.console.print(text, markup=False, highlight=False)
