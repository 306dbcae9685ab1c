"""Every solver at every step, compared with the reference of its scene; which runs no other beats in cost and error."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from srbval.bench.batch import Measured, measure_all
from srbval.bench.measures import errors_against
from srbval.bench.reference import SceneReference
from srbval.bench.row import BenchRun
from srbval.bench.scenes import bench_scene
from srbval.bench.settings import BenchSettings
from srbval.progress import Progress, silent


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
    return [p is not None and not any(_beats(other, p) for other in present) for p in points]


def _beats(one: tuple[float, float], other: tuple[float, float]) -> bool:
    return one[0] <= other[0] and one[1] <= other[1] and one != other


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
