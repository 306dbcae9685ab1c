"""One case after the other, in this process."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from srbval.campaign.engines.engine import Job, Outcome
from srbval.campaign.engines.processes import LocalProcesses
from srbval.campaign.work import prepare, run_task


class Serial:
    """In this process; what was under way when the campaign was last killed runs last, in a process of its own."""

    name = "serial"
    workers = 1

    def run(self, job: Job) -> Iterator[Outcome]:
        """Outcomes in the order of the tasks, suspects last."""
        prepare(job.first)
        suspected = []
        for task in job.tasks:
            if task.key in job.suspects:
                suspected.append(task)
                continue
            job.begun(task.key)
            yield run_task(task)
        if suspected:
            yield from LocalProcesses(1).run(replace(job, first=(), tasks=suspected))
