"""Runs of scenes: timed on one core, best and median of several; or many in parallel, measured as they end.

What runs in parallel is for accuracy only, its times are disturbed.
"""

import threading
import time
from collections.abc import Callable, Hashable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from srbval.errors import ConfigurationError, NumericsError
from srbval.models.run import USABLE, Run, RunStatus
from srbval.models.simulate import Step, simulate
from srbval.models.solvers import METHODS
from srbval.plan.measures import Measures, measure
from srbval.processes.machine import usable_cores
from srbval.progress import Progress, silent
from srbval.scene import Scene

WARM_UP_S = 0.002
Key = TypeVar("Key", bound=Hashable)
Result = TypeVar("Result")


@dataclass(frozen=True, kw_only=True)
class RunTiming:
    """Wall seconds per simulated second, best and median of `repeats`; share of a core that the best run had.

    The share is processor time over wall time: well below 1, another process was using the core.
    """

    best: float
    median: float
    repeats: int
    core_share: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Ended:
    """How a run ended: its own `status`, or ``refused`` where it was not even begun, and the `reason`."""

    status: str
    reason: str

    @property
    def ok(self) -> bool:
        """May it be read as a bearing's vibration?"""
        return self.status in USABLE

    @property
    def measurable(self) -> bool:
        """Has it figures to compare? Also where its energy is open, as explicit friction chatters: the paper's own."""
        return self.ok or self.status == RunStatus.ENERGY_OPEN.value


@dataclass(frozen=True, kw_only=True, eq=False)
class Attempt(Ended):
    """A run with its timing, or without where there is none."""

    scene: Scene
    run: Run | None = None
    timing: RunTiming | None = None


def attempt(scene: Scene, *, step: Step = Step.UNCHECKED, progress: Progress = silent) -> Attempt:
    """Run `scene` once, without timing; a failure becomes a failed attempt."""
    try:
        run = simulate(scene, step=step, progress=progress)
    except (ConfigurationError, NumericsError) as error:
        return Attempt(scene=scene, status="refused", reason=str(error))
    return Attempt(scene=scene, status=run.status.value, reason=run.reason, run=run)


def time_scene(scene: Scene, repeats: int) -> Attempt:
    """Run `scene` `repeats` times in this thread and time it; settling counts as simulated time.

    A run that ends early, its state no longer finite, has no timing.
    """
    attempt(replace(scene, duration_s=WARM_UP_S, settle_s=0.0))
    walls, shares = [], []
    for _ in range(repeats):
        busy, started = time.process_time(), time.perf_counter()
        last = attempt(scene)
        shares.append((time.process_time() - busy) / (time.perf_counter() - started))
        if last.run is None or last.status == RunStatus.NOT_FINITE.value:
            return last
        walls.append(last.run.wall_s / (last.run.seconds + scene.settle_s))
    best = int(np.argmin(walls))
    timing = RunTiming(
        best=walls[best], median=float(np.median(walls)), repeats=repeats, core_share=min(1.0, shares[best])
    )
    return replace(last, timing=timing)


def right_hand_sides_per_step(solver: str) -> int | None:
    """Evaluations of the equations of motion in one step; None where the method does not say."""
    return METHODS[solver].evaluations if solver in METHODS else None


@dataclass(frozen=True, kw_only=True)
class Measured(Ended):
    """How a run ended and, if successful, its measures; `wall_s` is disturbed by the parallel runs [s]."""

    scene: Scene
    measures: Measures | None
    wall_s: float


class RunStopped(Exception):
    """Raised inside a run when another one failed with an exception or the user interrupted."""


def _cost(scene: Scene) -> float:
    stages = right_hand_sides_per_step(scene.solver.name) or 1
    return (scene.settle_s + scene.duration_s) * stages / scene.solver.step_s


def measure_all(
    scenes: Mapping[Key, Scene], *, task: str, jobs: int | None = None, progress: Progress = silent
) -> dict[Key, Measured]:
    """Run and measure all `scenes`, `jobs` at a time (default: one per usable core), the most expensive first."""

    def read(_: Key, tried: Attempt, wall_s: float) -> Measured:
        measures = measure(tried.run) if tried.measurable and tried.run is not None else None
        return Measured(scene=tried.scene, status=tried.status, reason=tried.reason, measures=measures, wall_s=wall_s)

    return run_all(scenes, read, task=task, jobs=jobs, progress=progress)


def run_all(
    scenes: Mapping[Key, Scene],
    read: Callable[[Key, Attempt, float], Result],
    *,
    task: str,
    step: Step = Step.UNCHECKED,
    jobs: int | None = None,
    progress: Progress = silent,
) -> dict[Key, Result]:
    """Run all `scenes` as `measure_all` does; `read` turns each attempt and its wall time [s] into its result.

    `read` is called in the thread of the run as soon as it has ended, so that it can store the result. The progress of
    a run counts by its cost.
    """
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
        scene, started = scenes[key], time.perf_counter()
        tried = attempt(scene, step=step, progress=lambda _, fraction: reached(key, fraction or 0.0))
        reached(key, 1.0)
        return read(key, tried, time.perf_counter() - started)

    with ThreadPoolExecutor(max_workers=jobs or usable_cores()) as pool:
        futures = {key: pool.submit(one, key) for key in sorted(cost, key=lambda key: -cost[key])}
        try:
            results = {key: futures[key].result() for key in scenes}
        except BaseException:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    progress(task, 1.0)
    return results
