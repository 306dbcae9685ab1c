"""Every solver at every step, held against the reference of its scene."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from srbval.bench.batch import Measured, measure_all
from srbval.bench.errors import errors_against
from srbval.bench.pareto import with_pareto
from srbval.bench.reference import Reference
from srbval.bench.row import BenchRun
from srbval.bench.scenes import bench_scene
from srbval.bench.settings import Settings
from srbval.progress import Progress, silent


def with_accuracy(
    rows: Sequence[BenchRun], references: Mapping[str, Reference], settings: Settings, progress: Progress = silent
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
    return with_pareto([held_against(row, measured[i], references[row.scene]) for i, row in enumerate(rows)])


def held_against(row: BenchRun, run: Measured, reference: Reference) -> BenchRun:
    """One row with what its run measured; without errors where run or reference failed or they are the same run."""
    errors = None
    same = row.solver == reference.solver and math.isclose(row.dt_s, reference.dt_s, rel_tol=1e-6)
    if run.measures is not None and reference.measures is not None and not same:
        errors = errors_against(run.measures, reference.measures)
    return replace(
        row, status=run.status, reason=run.reason, measures=run.measures, errors=errors,
        reference_errors=reference.own_errors,
    )  # fmt: skip
