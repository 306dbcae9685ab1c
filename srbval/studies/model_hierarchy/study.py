"""Run every model on every calibration scene and compare it with the base's reference model at half its step."""

from argparse import Namespace
from collections.abc import Sequence

from srbval.models.hierarchy import MODELS
from srbval.plan.table import BASES, CalibrationScene, CalibrationTable
from srbval.processes.about_machine import this_machine
from srbval.progress import Progress, silent
from srbval.storage.json_files import to_json
from srbval.studies.calibration_runs import REFINEMENT, SECONDS, between, grid, measure_cases, quick_grid, summary
from srbval.studies.harness import StudyResult, printed_columns


def measure_models(
    cases: Sequence[CalibrationScene],
    between: Sequence[CalibrationScene] = (),
    *,
    base: str = "paper",
    models: Sequence[str] = MODELS,
    seconds: float = SECONDS,
    jobs: int | None = None,
    progress: Progress = silent,
) -> CalibrationTable:
    """Errors and costs of `models` on the grid's `cases` and those `between`, all about the bundled scene `base`.

    `jobs`: see `measure_cases`.
    """
    machine = this_machine
    entries = measure_cases([*cases, *between], models=models, seconds=seconds, jobs=jobs, progress=progress)
    right, default = BASES[base], BASES[base].scene.solver
    more = "".join(f", {value} {key}" for change in right.finest.values() for key, value in change.items())
    return CalibrationTable(
        base=base,
        reference=f"{right.reference} model, {default.name} at 1/{REFINEMENT / default.step_s:.0f} s{more}",
        solver=default.name,
        step_s=default.step_s,
        seconds=seconds,
        machine=to_json(machine()),
        entries=tuple(entries[: len(cases)]),
        between=tuple(entries[len(cases) :]),
    )


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Stored where ``-o`` names a file: the planner reads ``srbval/plan/calibration_<base>.json``."""
    quick, base = options.quick, options.base
    table = measure_models(
        quick_grid(base) if quick else grid(base), [] if quick else between(base), base=base,
        seconds=options.seconds or SECONDS, jobs=options.jobs, progress=progress,
    )  # fmt: skip
    rows = summary(table)
    text = f"reference: {table.reference}; {len(table.entries)} scenes of {table.seconds:g} s"
    printed = printed_columns(__package__, "summary", rows)
    return StudyResult(content=to_json(table) | {"ladder": rows}, text=f"{text}\n{printed}")
