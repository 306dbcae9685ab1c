"""Run cases side by side: threads, since the kernels release the interpreter lock."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from srbval.errors import ConfigurationError, NumericsError
from srbval.models.precompile import load_kernels
from srbval.models.run import Run, RunStatus
from srbval.models.simulate import simulate
from srbval.progress import Progress, silent
from srbval.validation.cases import Case


class Stopped(Exception):
    """Raised inside a run when another one failed or the user interrupted."""


def run_cases(cases: Sequence[Case], *, jobs: int | None = None, progress: Progress = silent) -> dict[str, Run]:
    """Run all `cases`, `jobs` at a time (default: one a core), the longest first.

    `progress` gets one task per case, from several threads. Raises `NumericsError` naming the
    first failed case; the others are stopped.
    """
    if jobs is not None and jobs < 1:
        raise ConfigurationError(f"jobs = {jobs} must be 1 or more.")
    stop = False

    def one(case: Case) -> Run:
        def report(_: str, fraction: float | None) -> None:
            if stop:
                raise Stopped
            progress(f"Simulate {case.id}", fraction)

        run = simulate(case.scene, progress=report)
        if run.status is not RunStatus.OK:
            raise NumericsError(f"case {case.id}: run failed ({run.status}): {run.reason}.")
        return run

    load_kernels(case.scene.model for case in cases)
    ordered = sorted(cases, key=lambda case: -case.scene.duration_s / case.scene.solver.step_s)
    with ThreadPoolExecutor(max_workers=jobs or os.cpu_count() or 1) as pool:
        futures = {case.id: pool.submit(one, case) for case in ordered}
        try:
            return {case.id: futures[case.id].result() for case in cases}
        except BaseException:
            stop = True
            pool.shutdown(wait=True, cancel_futures=True)
            raise
