"""What each solver costs on each scene."""

from collections.abc import Sequence

from srbval.progress import Progress, silent
from srbval.studies.scenes import PAPER_STEP_S, BenchSettings, bench_scene
from srbval.studies.speed_accuracy.measured import time_scene
from srbval.studies.speed_accuracy.row import BenchRun, row_of


def speed_rows(
    scenes: Sequence[str],
    solvers: Sequence[str],
    steps_s: Sequence[float],
    settings: BenchSettings,
    calibration_s: float,
    progress: Progress = silent,
) -> list[BenchRun]:
    """Time every solver at every step on every scene, one after another, each on one core."""
    rows = []
    every = [(scene, solver, step) for scene in scenes for solver in solvers for step in steps_s]
    for number, (name, solver, step) in enumerate(every):
        progress("time the solvers", number / len(every))
        fewer = min(1.0, step / PAPER_STEP_S)  # as many steps whatever the step
        scene = bench_scene(
            name, solver=solver, step_s=step,
            seconds=settings.timing_s * fewer, settle_s=settings.timing_settle_s * fewer,
        )  # fmt: skip
        rows.append(row_of(name, time_scene(scene, settings.repeats), calibration_s))
    progress("time the solvers", 1.0)
    return rows
