"""The display of progress on standard error: bars on a terminal, plain lines in logs and pipes."""

import contextlib
import sys
import threading
import time
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Self, TextIO

if TYPE_CHECKING:
    from rich.progress import TaskID

LINE_EVERY_S = 3.0  # the longest time that the reader of a log waits for a line while a task is running


class ProgressDisplay:
    """A `Progress` callback that shows what it is told, while its ``with`` block lasts.

    ``with ProgressDisplay() as progress: simulate(scene, progress=progress)``. `stream` is standard error unless
    given; bars are drawn when it is a terminal, plain lines are written elsewhere.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        stream = stream or sys.stderr
        self._display: _Bars | _Lines = _Bars(stream) if stream.isatty() else _Lines(stream)

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


class _Bars:
    """_Bars drawn by rich, one per task."""

    def __init__(self, stream: TextIO) -> None:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            Progress,
            TaskProgressColumn,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )

        self._bars = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(bar_width=28),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            TextColumn("about"),
            TimeRemainingColumn(),
            TextColumn("to go"),
            console=Console(file=stream),
        )
        self._running: dict[str, TaskID] = {}
        self._lock = threading.Lock()

    def start(self) -> None:
        self._bars.start()

    def stop(self) -> None:
        self._bars.stop()

    def show(self, task: str, fraction: float | None) -> None:
        total = None if fraction is None else 1.0
        with self._lock:
            if task not in self._running:
                self._running[task] = self._bars.add_task(task, total=total)
            self._bars.update(self._running[task], total=total, completed=fraction)
            if fraction is not None and fraction >= 1:
                del self._running[task]

    def message(self, text: str) -> None:
        self._bars.console.print(text, markup=False, highlight=False)


@dataclass
class _Running:
    """A task that has begun, and when it did and last was reported (`time.monotonic`) [s]."""

    fraction: float | None
    started_at: float
    reported_at: float


class _Lines:
    """Plain lines: when a task begins, at least every `LINE_EVERY_S` until it ends, and when it ends."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._running: dict[str, _Running] = {}
        self._written_at = time.monotonic()
        self._lock = threading.Lock()
        self._stopped = threading.Event()
        self._heartbeat = threading.Thread(target=self._report_regularly, name="srbval-progress", daemon=True)

    def start(self) -> None:
        self._heartbeat.start()

    def stop(self) -> None:
        self._stopped.set()
        self._heartbeat.join()

    def show(self, task: str, fraction: float | None) -> None:
        now = time.monotonic()
        with self._lock:
            if task not in self._running:
                self._running[task] = _Running(fraction, started_at=now, reported_at=now)
                self._write(f"{task} ...")
            self._running[task].fraction = fraction
            if fraction is not None and fraction >= 1:
                self._write(f"{task}: done in {now - self._running.pop(task).started_at:.1f} s")
            else:
                self._report_if_due(task)

    def message(self, text: str) -> None:
        with self._lock:
            self._write(text)

    def _report_regularly(self) -> None:
        while not self._stopped.wait(LINE_EVERY_S / 6):
            with self._lock:
                for task in self._running:
                    self._report_if_due(task)

    def _report_if_due(self, task: str) -> None:
        """Report `task` when its last line, or for an unknown extent any line, is `LINE_EVERY_S` old."""
        now, state = time.monotonic(), self._running[task]
        last = self._written_at if state.fraction is None else state.reported_at
        if now - last < LINE_EVERY_S * 0.8:
            return
        state.reported_at = now
        elapsed, fraction = now - state.started_at, state.fraction
        done = "" if fraction is None else f" {100 * fraction:.0f} %"
        remaining = f", about {_span(elapsed * (1 / fraction - 1))} to go" if fraction else ""
        self._write(f"{task}:{done} after {_span(elapsed)}{remaining}")

    def _write(self, line: str) -> None:
        self._written_at = time.monotonic()
        with contextlib.suppress(OSError):  # nobody reads: no reason to stop
            print(line, file=self._stream, flush=True)


def _span(seconds: float) -> str:
    """A duration in a unit that suits it."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
