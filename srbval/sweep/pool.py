"""Runs of scenes, one or many in parallel; a failed run is a result, an exception ends all."""

import threading
import time
from collections.abc import Callable, Hashable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

from srbval.errors import ConfigurationError, NumericsError
from srbval.models.outside.run import end_models
from srbval.models.run import Run, RunStatus, works
from srbval.models.simulate import Step, compile_for, simulate
from srbval.models.solvers import METHODS
from srbval.processes.machine import usable_cores
from srbval.progress import Progress, silent
from srbval.scene import Scene

Key = TypeVar("Key", bound=Hashable)
Result = TypeVar("Result")


@dataclass(frozen=True, kw_only=True, eq=False)
class Ended:
    """How a run ended: its `status`, or ``refused`` if it did not begin, and the `reason`."""

    status: str
    reason: str

    @property
    def works(self) -> bool:
        """True if `srbval simulate` accepts a run with this status; see `srbval.models.run.works`."""
        return works(self.status)

    @property
    def measurable(self) -> bool:
        """True if the run lasted to its end near the bearing's motion, so that its errors can be computed.

        Inaccurate runs and runs with an open energy balance do, although they do not work.
        """
        return self.works or self.status in (RunStatus.INACCURATE, RunStatus.ENERGY_OPEN)


@dataclass(frozen=True, kw_only=True, eq=False)
class Attempt(Ended):
    """Outcome of one run; `run` is None if it was refused."""

    scene: Scene
    run: Run | None = None


def attempt(
    scene: Scene, *, step: Step = Step.UNCHECKED, make: Callable[..., Run] = simulate, progress: Progress = silent
) -> Attempt:
    """Run `scene` once by `make`, which is `simulate` or `stored_run`; a failure becomes a failed attempt."""
    try:
        run = make(scene, step=step, progress=progress)
    except (ConfigurationError, NumericsError) as error:
        return Attempt(scene=scene, status="refused", reason=str(error))
    return Attempt(scene=scene, status=run.status.value, reason=run.reason, run=run)


def right_hand_sides_per_step(solver: str) -> int | None:
    """Evaluations of the equations of motion in one step; None for an unknown method."""
    return METHODS[solver].evaluations if solver in METHODS else None


class RunStopped(Exception):
    """Raised inside a run when another one failed with an exception or the user interrupted."""


def run_all(
    scenes: Mapping[Key, Scene],
    read: Callable[[Key, Attempt, float], Result],
    *,
    task: str,
    step: Step = Step.UNCHECKED,
    make: Callable[..., Run] = simulate,
    jobs: int | None = None,
    progress: Progress = silent,
) -> dict[Key, Result]:
    """Run all `scenes`, see `attempt` and `side_by_side`; a failed run is a result.

    `read` turns each attempt and its wall time [s], which the parallel runs disturb, into its result. It is called in
    the thread of the run as soon as it has ended, so that it can store the result.
    """

    def one(key: Key, report: Progress) -> Result:
        started = time.perf_counter()
        tried = attempt(scenes[key], step=step, make=make, progress=report)
        return read(key, tried, time.perf_counter() - started)

    return side_by_side(scenes, one, task=task, jobs=jobs, progress=progress)


def side_by_side(
    scenes: Mapping[Key, Scene],
    run: Callable[[Key, Progress], Result],
    *,
    task: str,
    jobs: int | None = None,
    progress: Progress = silent,
) -> dict[Key, Result]:
    """Results of `run` for each scene, `jobs` at a time (default: one per usable core), the most expensive first.

    Runs are threads, since the kernels release the interpreter lock. The progress of a run counts by its cost. The
    first exception stops all runs and is raised; `ConfigurationError` for less than one job.
    """
    if jobs is not None and jobs < 1:
        raise ConfigurationError(f"jobs = {jobs} must be 1 or more.")
    compile_for(*scenes.values(), jobs=jobs, progress=progress)
    cost = {key: _cost(scene) for key, scene in scenes.items()}
    shares: dict[Key, float] = {}
    lock, stop = threading.Lock(), threading.Event()

    def reached(key: Key, share: float) -> None:
        if stop.is_set():
            raise RunStopped
        with lock:
            shares[key] = share
            total = sum(cost[k] * s for k, s in shares.items()) / sum(cost.values())
            progress(task, min(total, 0.999))

    def one(key: Key) -> Result:
        result = run(key, lambda _, fraction: reached(key, fraction or 0.0))
        reached(key, 1.0)
        return result

    with ThreadPoolExecutor(max_workers=jobs or usable_cores()) as pool:
        futures = {key: pool.submit(one, key) for key in sorted(cost, key=lambda key: -cost[key])}
        try:
            results = {key: futures[key].result() for key in scenes}
        except BaseException:
            stop.set()
            end_models()
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    progress(task, 1.0)
    return results


def _cost(scene: Scene) -> float:
    stages = right_hand_sides_per_step(scene.solver.name) or 1
    return (scene.settle_s + scene.duration_s) * stages / scene.solver.step_s
