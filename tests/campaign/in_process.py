"""An engine within the test's own process: for what a test puts in the place of functions, and for speed."""

from __future__ import annotations

from collections.abc import Generator

from srbval.campaign.case import CaseResult
from srbval.campaign.engines.engine import Job
from srbval.campaign.work import prepare, run_case


class InProcess:
    """Compile, then one case after the other, without limits."""

    name, workers = "in-process", 1

    def run(self, job: Job) -> Generator[CaseResult]:
        prepare(job.precompiled)
        for task in job.tasks:
            yield run_case(task)
