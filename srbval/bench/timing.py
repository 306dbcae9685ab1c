"""Wall time of a scene on one core: best and median of several runs, after one that is not timed."""

import time
from dataclasses import dataclass, replace

import numpy as np

from srbval.errors import ConfigurationError, NumericsError
from srbval.models.run import Run, RunStatus
from srbval.models.simulate import simulate
from srbval.models.solvers import METHODS
from srbval.progress import Progress, silent
from srbval.scene import Scene

WARM_UP_S = 0.002


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
class Attempt:
    """A run with its timing, or the reason why there is none.

    `status` is the run's own, or ``refused`` where it was not even begun.
    """

    scene: Scene
    status: str
    reason: str
    run: Run | None = None
    timing: RunTiming | None = None

    @property
    def ok(self) -> bool:
        """May it be read as a bearing's vibration?"""
        return self.status == RunStatus.OK.value


def attempt(scene: Scene, *, progress: Progress = silent) -> Attempt:
    """Run `scene` once, without timing; a failure becomes a failed attempt."""
    try:
        run = simulate(scene, progress=progress)
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
    method = METHODS.get(solver)
    return None if method is None else method.evaluations
