"""Progress as plain lines, for logs and pipes."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from typing import TextIO

LINE_EVERY_S = 3.0  # the longest time that the reader of a log waits for a line while a task is running


@dataclass
class _Running:
    """A task that has begun, and when it did and last was reported (`time.monotonic`) [s]."""

    fraction: float | None
    started_at: float
    reported_at: float


class Lines:
    """Plain lines: when a task begins, at least every `LINE_EVERY_S` until it ends, and when it ends."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._running: dict[str, _Running] = {}
        self._written_at = time.monotonic()
        self._lock = threading.Lock()
        self._stopped = threading.Event()
        self._heartbeat = threading.Thread(target=self._report_regularly, name="srbval-progress", daemon=True)

    def start(self) -> None:
        """Begin to report on tasks that do not call for a long time."""
        self._heartbeat.start()

    def stop(self) -> None:
        """End the regular reports."""
        self._stopped.set()
        self._heartbeat.join()

    def show(self, task: str, fraction: float | None) -> None:
        """Write that `task` begins or is done; between the two a line only when it is due."""
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
        """Write one line."""
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
        done = "" if state.fraction is None else f" {100 * state.fraction:.0f} %"
        self._write(f"{task}:{done} after {now - state.started_at:.0f} s")

    def _write(self, line: str) -> None:
        self._written_at = time.monotonic()
        print(line, file=self._stream, flush=True)
