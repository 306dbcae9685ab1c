"""Simulate one scene, or many in parallel; a failed run becomes a result, an unexpected exception ends all runs."""

import threading
from collections.abc import Callable, Hashable, Mapping
from concurrent.futures import CancelledError, ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

from srbval.errors import ConfigurationError, NumericsError
from srbval.models.outside.run import models_ended
from srbval.models.run import Run, RunStatus, works
from srbval.models.simulate import Step, compile_for, simulate
from srbval.models.solvers import METHODS
from srbval.processes.machine import usable_cores
from srbval.processes.worker import wait_for_result
from srbval.progress import Progress, silent
from srbval.scene import Scene

Key = TypeVar("Key", bound=Hashable)
Result = TypeVar("Result")


@dataclass(frozen=True, kw_only=True, eq=False)
class Attempt:
    """Outcome of a simulation; if `simulate` raised an error, `status` is ``refused`` and `run` is None."""

    scene: Scene
    status: str
    reason: str
    run: Run | None = None

    @property
    def works(self) -> bool:
        """True if `srbval simulate` accepts a run with this status; see `srbval.models.run.works`."""
        return works(self.status)

    @property
    def measurable(self) -> bool:
        """True if the run is complete, even if inaccurate or out of energy balance, so that errors can be computed."""
        return self.works or self.status in (RunStatus.INACCURATE, RunStatus.ENERGY_OPEN)


def attempt(scene: Scene, *, step: Step = Step.UNCHECKED, progress: Progress = silent) -> Attempt:
    """Simulate `scene` once; return the outcome as an `Attempt`, even if the scene is refused or the run fails."""
    try:
        run = simulate(scene, step=step, progress=progress)
    except (ConfigurationError, NumericsError) as error:
        return Attempt(scene=scene, status="refused", reason=str(error))
    return Attempt(scene=scene, status=run.status.value, reason=run.reason, run=run)


def right_hand_sides_per_step(solver: str) -> int:
    """Number of times that a solver evaluates the equations of motion per step; 1 for an unknown solver."""
    return METHODS[solver].evaluations if solver in METHODS else 1


def side_by_side(
    scenes: Mapping[Key, Scene],
    run: Callable[[Key, Progress], Result],
    *,
    task: str,
    jobs: int | None = None,
    progress: Progress = silent,
) -> dict[Key, Result]:
    """Call ``run(key, progress)`` for each scene in parallel, the most expensive first; return the results by key.

    `jobs` threads run at a time (default: one per usable core). `progress` is called with the name `task` and the share
    of the total cost done. The first exception stops all runs and is raised. Raises `ConfigurationError` if `jobs` < 1.
    """
    if jobs is not None and jobs < 1:
        raise ConfigurationError(f"jobs = {jobs} must be 1 or more.")
    compile_for(*scenes.values(), jobs=jobs, progress=progress)
    cost = {
        key: (one.settle_s + one.duration_s) * right_hand_sides_per_step(one.solver.name) / one.solver.step_s
        for key, one in scenes.items()
    }
    shares: dict[Key, float] = {}
    lock, stop = threading.Lock(), threading.Event()

    def reached(key: Key, share: float) -> None:
        if stop.is_set():
            raise CancelledError  # another run failed, or the user interrupted
        with lock:
            shares[key] = share
            total = sum(cost[k] * s for k, s in shares.items()) / sum(cost.values())
            progress(task, min(total, 0.999))

    def started(key: Key) -> Result:
        result = run(key, lambda _, fraction: reached(key, fraction or 0.0))
        reached(key, 1.0)
        return result

    with ThreadPoolExecutor(max_workers=jobs or usable_cores()) as pool:
        try:
            futures = {key: pool.submit(started, key) for key in sorted(cost, key=lambda key: -cost[key])}
            results = {key: wait_for_result(futures[key]) for key in scenes}
        except BaseException:
            stop.set()
            with models_ended():
                pool.shutdown(wait=True, cancel_futures=True)
            raise
    progress(task, 1.0)
    return results
