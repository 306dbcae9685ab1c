"""Many runs in parallel, measured as they end; for accuracy only, nothing here is timed."""

import threading
import time
from collections.abc import Callable, Hashable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

from srbval.bench.machine import usable_cores
from srbval.bench.measures import Measures, measure
from srbval.bench.timing import Attempt, attempt, right_hand_sides_per_step
from srbval.progress import Progress, silent
from srbval.scene import Scene

Key = TypeVar("Key", bound=Hashable)
Result = TypeVar("Result")


@dataclass(frozen=True, kw_only=True)
class Measured:
    """How a run ended and, if successful, its measures; `wall_s` is disturbed by the parallel runs [s]."""

    scene: Scene
    status: str
    reason: str
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
        measures = measure(tried.run) if tried.ok and tried.run is not None else None
        return Measured(scene=tried.scene, status=tried.status, reason=tried.reason, measures=measures, wall_s=wall_s)

    return run_all(scenes, read, task=task, jobs=jobs, progress=progress)


def run_all(
    scenes: Mapping[Key, Scene],
    read: Callable[[Key, Attempt, float], Result],
    *,
    task: str,
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
        tried = attempt(scene, progress=lambda _, fraction: reached(key, fraction or 0.0))
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
