"""Progress as plain lines, for logs and pipes."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from typing import TextIO

from srbval.report.progress.display import Display

LINE_EVERY_S = 3.0  # a reader of a log is never left longer without a word while something moves


@dataclass
class _Task:
    description: str
    total: float | None
    completed: float = 0.0
    said_at: float = 0.0
    started_at: float = 0.0
    done: bool = False


class Lines(Display):
    """Plain lines: when a task starts, at least every `LINE_EVERY_S` until it ends, and when it ends."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._tasks: list[_Task] = []
        self._stage: _Task | None = None
        self._spoke_at = time.monotonic()
        self._lock = threading.Lock()
        self._stopped = threading.Event()
        self._beat = threading.Thread(target=self._keep_talking, name="srbval-progress", daemon=True)

    def start(self) -> None:
        """Begin to speak up when nobody else does."""
        self._beat.start()

    def stop(self) -> None:
        """Fall silent."""
        self._stopped.set()
        self._beat.join()

    def add(self, description: str, total: float | None) -> int:
        """Say that a task starts."""
        now = time.monotonic()
        with self._lock:
            self._tasks.append(_Task(description, total, said_at=now, started_at=now))
            self._write(f"{description} ...")
            return len(self._tasks) - 1

    def update(self, task: int, completed: float) -> None:
        """Note how much is done; say so when it is time."""
        with self._lock:
            self._tasks[task].completed = completed
            self._say_if_due(self._tasks[task])

    def finish(self, task: int) -> None:
        """Say that a task is done, and in what time."""
        with self._lock:
            entry = self._tasks[task]
            if not entry.done:
                entry.done = True
                self._write(f"{entry.description}: done in {time.monotonic() - entry.started_at:.1f} s")

    def message(self, text: str) -> None:
        """Write one line."""
        with self._lock:
            self._write(text)

    def stage(self, text: str) -> None:
        """Say what goes on from now on; repeated with its time whenever nothing else is said."""
        with self._lock:
            self._stage = _Task(text, None, started_at=time.monotonic())
            self._write(f"{text} ...")

    def _keep_talking(self) -> None:
        while not self._stopped.wait(LINE_EVERY_S / 6):
            with self._lock:
                for entry in self._tasks:
                    self._say_if_due(entry)
                now = time.monotonic()
                if self._stage is not None and now - self._spoke_at >= LINE_EVERY_S * 0.8:
                    self._write(f"{self._stage.description}: after {now - self._stage.started_at:.0f} s")

    def _say_if_due(self, entry: _Task) -> None:
        now = time.monotonic()
        if entry.done or now - entry.said_at < LINE_EVERY_S * 0.8:
            return
        entry.said_at = now
        share = f" {100 * entry.completed / entry.total:.0f} %" if entry.total else ""
        self._write(f"{entry.description}:{share} after {now - entry.started_at:.0f} s")

    def _write(self, line: str) -> None:
        self._spoke_at = time.monotonic()
        print(line, file=self._stream, flush=True)
