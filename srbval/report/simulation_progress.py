"""Progress of several runs side by side, one bar each."""

from __future__ import annotations

import threading

from srbval.report.progress import Progress
from srbval.validation.cases import Case


class SimulationProgress:
    """Called with a case and its simulated seconds from several threads; shows one task a case."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._tasks: dict[str, int] = {}
        self._lock = threading.Lock()

    def __call__(self, case: Case, done_s: float) -> None:
        """Show that `done_s` of the case's simulated seconds are done."""
        total = case.scene.settle_s + case.scene.duration_s
        with self._lock:
            if case.id not in self._tasks:
                self._tasks[case.id] = self._progress.add(f"Simulate {case.id}", total=total)
        self._progress.update(self._tasks[case.id], done_s)
        if done_s >= total - 1 / case.scene.output_rate_hz:
            self._progress.finish(self._tasks[case.id])
