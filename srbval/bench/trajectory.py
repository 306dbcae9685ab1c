"""Short-window trajectory error: convergence of a method to the same motion as its step is halved.

All runs of a scene start from the same state, the model's static equilibrium. After some 0.1 s the motion no longer
depends on its start (rollers rattle in the unloaded zone) and a pointwise error is meaningless: hence the short window.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.bench.reference import reference_solver
from srbval.bench.scenes import PAPER_STEP_S, bench_scene
from srbval.bench.settings import BenchSettings
from srbval.bench.timing import attempt
from srbval.progress import Progress, silent

REFERENCE_POWER = 6  # powers of two below the paper's step
POWERS = (0, 1, 2)


@dataclass(frozen=True, kw_only=True)
class Trajectory:
    """Errors of the outer ring's path over `window_s` from the start, RMS, relative to the path's own spread.

    `errors` are those at `steps_s`, None for a failed run; `observed_order` from the two finest that went well;
    `reference_error` is that of the reference's run at twice its step: errors near it are its own.
    """

    scene: str
    solver: str
    window_s: float
    steps_s: tuple[float, ...]
    errors: tuple[float | None, ...]
    observed_order: float | None
    reference_solver: str
    reference_step_s: float
    reference_error: float


def trajectories(
    scenes: Sequence[str], solvers: Sequence[str], settings: BenchSettings, progress: Progress = silent
) -> list[Trajectory]:
    """The trajectory errors of every solver on every scene; scenes whose reference fails are left out."""
    found = []
    for number, name in enumerate(scenes):
        progress("short-window trajectories", number / len(scenes))
        found += _scene_trajectories(name, solvers, settings.window_s)
    progress("short-window trajectories", 1.0)
    return found


def _scene_trajectories(name: str, solvers: Sequence[str], window_s: float) -> list[Trajectory]:
    best = reference_solver()
    reference = ring_path(name, best, REFERENCE_POWER, window_s)
    coarser = ring_path(name, best, REFERENCE_POWER - 1, window_s)
    if reference is None or coarser is None:
        return []
    found = []
    for solver in solvers:
        paths = [ring_path(name, solver, power, window_s) for power in POWERS]
        errors = tuple(None if path is None else path_error(path, reference) for path in paths)
        found.append(
            Trajectory(
                scene=name, solver=solver, window_s=window_s,
                steps_s=tuple(PAPER_STEP_S / 2**power for power in POWERS), errors=errors,
                observed_order=observed_order(errors), reference_solver=best,
                reference_step_s=PAPER_STEP_S / 2**REFERENCE_POWER, reference_error=path_error(coarser, reference),
            )
        )  # fmt: skip
    return found


def ring_path(name: str, solver: str, power: int, window_s: float) -> FloatArray | None:
    """Outer ring displacement [m], shape [n, 3], at the paper's step over two to the `power`; None if the run fails."""
    scene = bench_scene(name, solver=solver, step_s=PAPER_STEP_S / 2**power, seconds=window_s, settle_s=0.0)
    tried = attempt(scene)
    if tried.run is None or not np.all(np.isfinite(tried.run.displacement_m)):
        return None
    return tried.run.displacement_m


def path_error(path: FloatArray, reference: FloatArray) -> float:
    """RMS distance of two paths over the reference's RMS distance from its own mean."""
    spread = np.linalg.norm(reference - reference.mean(axis=0))
    return float(np.linalg.norm(path - reference) / spread)


def observed_order(errors: Sequence[float | None]) -> float | None:
    """Power of the step with which the last two errors fall, the step halved between them; None without two."""
    last = errors[-2:]
    if len(last) < 2 or last[0] is None or last[1] is None or min(last[0], last[1]) <= 0:
        return None
    return math.log2(last[0] / last[1])
