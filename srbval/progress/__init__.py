"""Progress of work: one callback signature for the whole package, and its display on standard error.

Whatever takes long has an option ``progress: Progress = silent`` and calls it with the name of the task and the
fraction of it that is done. `progress_display` makes such a callback, which shows the progress: bars on a terminal,
plain lines elsewhere. All of them are safe to call from several threads.
"""

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Self, TextIO

if TYPE_CHECKING:
    from rich.progress import TaskID

LINE_EVERY_S = 3.0  # the longest time that the reader of a log waits for a line while a task is running

Progress = Callable[[str, float | None], None]
"""Called with the name of a task and the fraction of it that is done, 0 to 1.

1.0 means done; None means begun, with an extent that is not known. A task begins with the first call that names it.
"""


def silent(task: str, fraction: float | None) -> None:
    """Show nothing."""


@contextlib.contextmanager
def stage(progress: Progress, task: str) -> Iterator[None]:
    """Report `task`, of unknown extent, as begun on entry and as done on a normal exit."""
    progress(task, None)
    yield
    progress(task, 1.0)


def prefixed(progress: Progress, title: str) -> Progress:
    """The same callback with `title` and a colon before the name of every task."""
    return lambda task, fraction: progress(f"{title}: {task}", fraction)


def progress_display(stream: TextIO | None = None) -> "_Bars | _Lines":
    """A `Progress` callback that shows the progress while its ``with`` block lasts.

    ``with progress_display() as progress: simulate(scene, progress=progress)``. `stream` is standard error unless
    given; bars are drawn when it is a terminal, plain lines are written elsewhere. Its `message` shows one line of text
    between the tasks.
    """
    stream = stream or sys.stderr
    return _Bars(stream) if stream.isatty() else _Lines(stream)


class _Bars:
    """Bars drawn by rich, one per task."""

    def __init__(self, stream: TextIO) -> None:
        from rich import progress
        from rich.console import Console

        self._lock = threading.Lock()
        self._bars = progress.Progress(
            progress.TextColumn("{task.description}", markup=False),
            progress.BarColumn(bar_width=28),
            progress.TaskProgressColumn(),
            progress.TimeElapsedColumn(),
            progress.TextColumn("about"),
            progress.TimeRemainingColumn(),
            progress.TextColumn("to go"),
            console=Console(file=stream),
        )
        self._running: dict[str, TaskID] = {}

    def __enter__(self) -> Self:
        self._bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bars.stop()

    def __call__(self, task: str, fraction: float | None) -> None:
        total = None if fraction is None else 1.0
        with self._lock:
            if task not in self._running:
                self._running[task] = self._bars.add_task(task, total=total)
            self._bars.update(self._running[task], total=total, completed=fraction)
            if fraction is not None and fraction >= 1:
                del self._running[task]

    def message(self, text: str) -> None:
        self._bars.console.print(text, markup=False, highlight=False)


class _Lines:
    """Plain lines: when a task begins, at least every `LINE_EVERY_S` until it ends, and when it ends."""

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._lock = stream, threading.Lock()
        # By task: the fraction done, when it began and when it was last reported (`time.monotonic`) [s].
        self._running: dict[str, tuple[float | None, float, float]] = {}
        self._written_at = time.monotonic()
        self._stopped = threading.Event()
        self._heartbeat = threading.Thread(target=self._report_regularly, name="srbval-progress", daemon=True)

    def __enter__(self) -> Self:
        self._heartbeat.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopped.set()
        self._heartbeat.join()

    def __call__(self, task: str, fraction: float | None) -> None:
        now = time.monotonic()
        with self._lock:
            if task not in self._running:
                self._write(f"{task} ...")
            _, started_at, reported_at = self._running.get(task, (None, now, now))
            self._running[task] = fraction, started_at, reported_at
            if fraction is not None and fraction >= 1:
                del self._running[task]
                self._write(f"{task}: done in {now - started_at:.1f} s")
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
        now, (fraction, started_at, reported_at) = time.monotonic(), self._running[task]
        if now - (self._written_at if fraction is None else reported_at) < LINE_EVERY_S * 0.8:
            return
        self._running[task] = fraction, started_at, now
        elapsed = now - started_at
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
