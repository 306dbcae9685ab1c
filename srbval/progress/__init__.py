"""Progress of work: one type of callback for the whole package, and its display on standard error.

A function that takes long has the option ``progress: Progress = silent``. It calls `progress` with the name of the task
and the fraction that is done, None if unknown. `ProgressDisplay` is a callback that displays the progress: on a
terminal in one line, elsewhere in a few lines per task. All callbacks may be called from several threads.
"""

import contextlib
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Self, TextIO

DRAWN_EVERY_S = 0.3  # interval at which a line on a terminal is overwritten
LINE_AFTER_S, LATER = 3.0, 3.0  # time to the first line in a log, and factor from line to line: 8 lines in 2 hours

Progress = Callable[[str, float | None], None]
"""Callback with the name of a task and the fraction of it that is done, 0 to 1.

1.0 means done; None means begun with an unknown extent. A task begins with the first call that contains its name.
"""


def silent(task: str, fraction: float | None) -> None:
    """Progress callback that displays nothing."""


@contextlib.contextmanager
def stage(progress: Progress, task: str) -> Iterator[None]:
    """Context manager: report to `progress` that `task` begins and, if no exception was raised, that it is done."""
    progress(task, None)
    yield
    progress(task, 1.0)


def prefix_tasks(progress: Progress, title: str) -> Progress:
    """Return a callback that puts `title` and a colon before the name of every task."""
    return lambda task, fraction: progress(f"{title}: {task}", fraction)


class ProgressDisplay:
    """Progress callback that displays the progress during its ``with`` block.

    ``with ProgressDisplay() as progress: simulate(scene, progress=progress)``. `stream` is standard error by default. A
    task is displayed when it begins, at intervals while it runs, and when it ends; on a terminal its line is
    overwritten. The method `message` writes a line of text between the tasks.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream, self._lock = stream or sys.stderr, threading.Lock()
        self._terminal = self._stream.isatty()
        self._first_after_s = DRAWN_EVERY_S if self._terminal else LINE_AFTER_S
        self._drawn = 0  # characters of the line to overwrite
        # By task: the fraction done, when the task began and when its next line is due (`time.monotonic`) [s].
        self._running: dict[str, tuple[float | None, float, float]] = {}
        self._stopped = threading.Event()
        self._heartbeat = threading.Thread(target=self._report_regularly, name="srbval-progress", daemon=True)

    def __enter__(self) -> Self:
        self._heartbeat.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopped.set()
        self._heartbeat.join()
        if self._drawn:  # the last task did not end
            self._write("")

    def __call__(self, task: str, fraction: float | None) -> None:
        """Store and display the progress of a task; for `fraction` see `Progress`."""
        now = time.monotonic()
        with self._lock:
            if task not in self._running:
                self._write(f"{task} ...", temporary=True)
            _, started_at, due_at = self._running.get(task, (None, now, now + self._first_after_s))
            self._running[task] = fraction, started_at, due_at
            if fraction is not None and fraction >= 1:
                del self._running[task]
                self._write(f"{task}: done in {now - started_at:.1f} s")

    def message(self, text: str) -> None:
        """Write one line of text."""
        with self._lock:
            self._write(text)

    def _report_regularly(self) -> None:
        """Write the lines that are due: on a terminal at intervals, elsewhere each time after `LATER` times as long."""
        while not self._stopped.wait(self._first_after_s / 6):
            with self._lock:
                now = time.monotonic()
                for task, (fraction, started_at, due_at) in self._running.items():
                    if now < due_at:
                        continue
                    elapsed = now - started_at
                    next_at = now + DRAWN_EVERY_S if self._terminal else started_at + LATER * elapsed
                    self._running[task] = fraction, started_at, next_at
                    done = "" if fraction is None else f" {100 * fraction:.0f} %"
                    remaining = f", about {_span(elapsed * (1 / fraction - 1))} to go" if fraction else ""
                    self._write(f"{task}:{done} after {_span(elapsed)}{remaining}", temporary=True)

    def _write(self, line: str, *, temporary: bool = False) -> None:
        """Write a line; on a terminal, a `temporary` line is overwritten by the next line."""
        end = "\n"
        if self._terminal:
            before, shown = self._drawn, line[: shutil.get_terminal_size().columns - 1] if temporary else line
            end, self._drawn = ("", len(shown)) if temporary else ("\n", 0)
            line = f"\r{shown.ljust(before)}"
        with contextlib.suppress(OSError):  # a closed stream must not stop the work
            print(line, file=self._stream, flush=True, end=end)


def _span(seconds: float) -> str:
    """Text of a duration in s, min or h."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
