"""Every solver at every step, compared with the reference of its scene; which runs no other beats in cost and error.

And the short-window trajectory error: convergence of a method to the same motion as its step is halved. All runs of a
scene start from the same state, the model's static equilibrium. After some 0.1 s the motion no longer depends on its
start (rollers rattle in the unloaded zone) and a pointwise error is meaningless: hence the short window.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from srbval.arrays import FloatArray
from srbval.comparison.runs import attempt
from srbval.models.health import default_solver
from srbval.progress import Progress, silent
from srbval.studies.scenes import PAPER_STEP_S, BenchSettings, bench_scene
from srbval.studies.speed_accuracy.measured import Measured, errors_against, measure_all
from srbval.studies.speed_accuracy.reference import SceneReference
from srbval.studies.speed_accuracy.row import BenchRun

REFERENCE_POWER = 6  # powers of two below the paper's step
POWERS = (0, 1, 2)


def with_accuracy(
    rows: Sequence[BenchRun],
    references: Mapping[str, SceneReference],
    settings: BenchSettings,
    progress: Progress = silent,
) -> list[BenchRun]:
    """The timed `rows` with measures, errors and Pareto flags, from a longer run of each.

    A failed run keeps its row, with the longer run's status and reason.
    """
    scenes = {
        i: bench_scene(
            row.scene, solver=row.solver, step_s=row.dt_s,
            seconds=settings.accuracy_s, settle_s=settings.accuracy_settle_s,
        )
        for i, row in enumerate(rows)
    }  # fmt: skip
    measured = measure_all(scenes, task="runs to compare", progress=progress)
    return with_pareto([compared(row, measured[i], references[row.scene]) for i, row in enumerate(rows)])


def compared(row: BenchRun, run: Measured, reference: SceneReference) -> BenchRun:
    """One row with what its run measured; without errors where run or reference failed or they are the same run."""
    errors = None
    same = row.solver == reference.solver and math.isclose(row.dt_s, reference.dt_s, rel_tol=1e-6)
    if run.measures is not None and reference.measures is not None and not same:
        errors = errors_against(run.measures, reference.measures)
    return replace(
        row, status=run.status, reason=run.reason, measures=run.measures, errors=errors,
        reference_errors=reference.own_errors,
    )  # fmt: skip


def non_dominated(points: Sequence[tuple[float, float] | None]) -> list[bool]:
    """For each pair of values: is there no other that is at most as large in both and smaller in one?

    None stands for a run without these values: it is not on the front and beats no other.
    """
    present = [p for p in points if p is not None]
    return [
        p is not None and not any(other[0] <= p[0] and other[1] <= p[1] and other != p for other in present)
        for p in points
    ]


def with_pareto(rows: Sequence[BenchRun]) -> list[BenchRun]:
    """The rows with their flags set, each scene and model for itself; failed runs are never on a front."""
    flagged = list(rows)
    for group in {(row.scene, row.model) for row in rows}:
        own = [i for i, row in enumerate(rows) if (row.scene, row.model) == group]
        cage = non_dominated([_cost_and_error(rows[i], "cage_error") for i in own])
        band = non_dominated([_cost_and_error(rows[i], "band_rms_error") for i in own])
        for i, best_cage, best_band in zip(own, cage, band, strict=True):
            flagged[i] = replace(rows[i], pareto=best_cage, pareto_band=best_band)
    return flagged


def _cost_and_error(row: BenchRun, error: str) -> tuple[float, float] | None:
    if not row.ok or row.wall_per_simulated_s is None or row.errors is None:
        return None
    return row.wall_per_simulated_s, float(getattr(row.errors, error))


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
    best = default_solver()
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
