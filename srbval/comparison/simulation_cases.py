"""Runs of the model that belong together: the report's own three, and any cases run side by side."""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from srbval.bearing import Fault
from srbval.errors import ConfigurationError, NumericsError
from srbval.models.precompile import load_kernels
from srbval.models.run import Run
from srbval.models.simulate import Step, simulate
from srbval.progress import Progress, silent
from srbval.scene import Scene, paper_scene

PAPER_STATES = (Fault.HEALTHY, Fault.OUTER, Fault.INNER)


@dataclass(frozen=True, kw_only=True)
class SimulationCase:
    """One run: its id, what it is for, the state it simulates, its scene and the bundled one that this changes."""

    id: str
    purpose: str
    state: Fault
    scene: Scene
    base: str = "paper"


class RunCancelled(Exception):
    """Raised inside a run when another one failed or the user interrupted."""


def paper_cases(seconds: float) -> list[SimulationCase]:
    """H, OR and IR at 710 rpm and 124.8 kN, `seconds` long."""
    return [
        SimulationCase(
            id=f"paper-{state}", purpose="the paper's scene", state=state,
            scene=paper_scene(duration_s=seconds, defect={"kind": state}),
        )
        for state in PAPER_STATES
    ]  # fmt: skip


def run_case(case: SimulationCase, *, step: Step = Step.CHECKED, progress: Progress = silent) -> Run:
    """One run, see `simulate`; `progress` gets it as a task of its own. A failed one is a `NumericsError` naming it."""
    run = simulate(case.scene, step=step, progress=lambda _, fraction: progress(f"Simulate {case.id}", fraction))
    if not run.status.usable:
        raise NumericsError(f"case {case.id}: run failed ({run.status}): {run.reason}.")
    return run


def run_cases(
    cases: Sequence[SimulationCase], *, jobs: int | None = None, progress: Progress = silent
) -> dict[str, Run]:
    """Run all `cases`, `jobs` at a time (default: one per core), the longest first; runs by the cases' ids.

    Threads, since the kernels release the interpreter lock. `progress` gets one task per case. Raises `NumericsError`
    naming the first failed case; the others are stopped.
    """
    if jobs is not None and jobs < 1:
        raise ConfigurationError(f"jobs = {jobs} must be 1 or more.")
    cancelled = False

    def report(task: str, fraction: float | None) -> None:
        if cancelled:
            raise RunCancelled
        progress(task, fraction)

    load_kernels(case.scene.model for case in cases)
    ordered = sorted(cases, key=lambda case: -case.scene.duration_s / case.scene.solver.step_s)
    with ThreadPoolExecutor(max_workers=jobs or os.cpu_count() or 1) as pool:
        futures = {case.id: pool.submit(run_case, case, progress=report) for case in ordered}
        try:
            return {case.id: futures[case.id].result() for case in cases}
        except BaseException:
            cancelled = True
            pool.shutdown(wait=True, cancel_futures=True)
            raise
