"""Shows the tasks of a long computation as they come."""

from __future__ import annotations

from srbval.report.progress import Progress


class Tasks:
    """A function of a task's name and the share of it that is done, 0 to 1; `title` stands before every name."""

    def __init__(self, progress: Progress, title: str) -> None:
        self._progress, self._title = progress, title
        self._tasks: dict[str, int] = {}

    def __call__(self, task: str, share: float) -> None:
        """Show that `share` of `task` is done."""
        if task not in self._tasks:
            self._tasks[task] = self._progress.add(f"{self._title}: {task}", total=1.0)
        self._progress.update(self._tasks[task], share)
        if share >= 1:
            self._progress.finish(self._tasks[task])
