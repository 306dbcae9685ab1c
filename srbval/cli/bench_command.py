"""``srbval bench``: speed against accuracy."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from srbval.bench.bench import BenchResult, run_bench
from srbval.bench.machine import Machine
from srbval.bench.scenes import SCENES
from srbval.bench.settings import FULL, QUICK
from srbval.cli.bench_ladder import run_ladder
from srbval.cli.bench_reading import run_reading
from srbval.cli.bench_sensitivity import run_sensitivity
from srbval.cli.measured import keep_and_print
from srbval.cli.output import print_columns
from srbval.cli.tasks import Tasks
from srbval.models.solvers import SOLVERS
from srbval.report.progress import Progress
from srbval.storage.revision import git_revision
from srbval.storage.stored_result import SPEED_ACCURACY

VERDICT = {True: "met", False: "NOT MET", None: "not measured"}
COST_COLUMNS = {
    "scene": "scene",
    "solver": "solver",
    "1/dt [Hz]": "steps_per_s",
    "wall s/s": "wall_per_simulated_s",
    "median": "wall_median_per_simulated_s",
    "calibrations/s": "wall_in_calibrations",
    "us/RHS": "us_per_rhs",
    "core share": "core_share",
    "status": "status",
}
ACCURACY_COLUMNS = {
    "scene": "scene",
    "solver": "solver",
    "1/dt [Hz]": "steps_per_s",
    "wall s/s": "wall_per_simulated_s",
    "cage error": "cage_error",
    "cage scatter": "cage_scatter",
    "noise floor": "noise_floor",
    "500-1500 Hz RMS [m/s2]": "band_rms_m_s2",
    "its error": "band_rms_error",
    "harmonic error": "harmonic_error",
    "Pareto": "on_front",
    "status": "status",
}
REFERENCE_COLUMNS = {
    "reference": "scene",
    "solver": "solver",
    "1/dt [Hz]": "steps_per_s",
    "cage/shaft": "cage_ratio",
    "cage error": "own_cage_error",
    "noise floor": "noise_floor",
    "500-1500 Hz RMS [m/s2]": "band_rms_m_s2",
    "its error": "own_band_rms_error",
    "computed": "when",
    "status": "status",
}
TRAJECTORY_COLUMNS = {
    "trajectory": "scene",
    "solver": "solver",
    "error": "coarse",
    "half the step": "middle",
    "quarter": "fine",
    "observed order": "observed_order",
    "of reference": "reference_error",
}
TOUCH_COLUMNS = {
    "scene": "scene",
    "solver": "solver",
    "points/circle": "points_per_circle",
    "us/step": "us_per_step",
    "touching points": "touching_points",
    "roller-race pairs": "touching_contacts",
    "ns/touching point": "ns_per_point",
}
TARGET_COLUMNS = {"target": "name", "measured": "value", "limit": "limit", "unit": "unit", "": "verdict"}


def run(options: argparse.Namespace) -> int:
    """Measure and print; targets that are not met are said, they do not change the exit code."""
    if options.ladder:
        return run_ladder(options)
    if options.sensitivity:
        return run_sensitivity(options)
    if options.reading:
        return run_reading(options)
    settings = QUICK if options.quick else FULL
    if options.seconds:
        settings = replace(settings, accuracy_s=options.seconds)
    revision = git_revision()
    with Progress() as progress:
        result = run_bench(
            scenes=tuple(options.scenes or SCENES),
            solvers=tuple(options.solvers or SOLVERS),
            settings=settings,
            accuracy=not options.speed_only,
            progress=Tasks(progress, "Bench"),
        )
    whole = _complete(options)
    keep_and_print(
        SPEED_ACCURACY, result.to_dict(), options, revision=revision, whole=whole, show=lambda: _print(result)
    )
    return 0


def _complete(options: argparse.Namespace) -> bool:
    """Is it the whole benchmark, so that the report may show it without being told?"""
    return not (options.quick or options.speed_only or options.scenes or options.solvers or options.seconds)


def _print(result: BenchResult) -> None:
    _print_machine(result.machine)
    rows = [_with_steps(run.to_dict()) for run in result.runs]
    print_columns(COST_COLUMNS, rows)
    if result.references:
        _print_accuracy(result, rows)
    print_columns(TOUCH_COLUMNS, [cost.to_dict() for cost in result.touch_costs])
    print_columns(TARGET_COLUMNS, [t.to_dict() | {"verdict": VERDICT[t.met]} for t in result.targets])


def _print_accuracy(result: BenchResult, rows: Sequence[Mapping[str, Any]]) -> None:
    references = [_with_steps(reference.to_dict()) for reference in result.references.values()]
    when = {True: "earlier, kept", False: "now"}
    print_columns(REFERENCE_COLUMNS, [table | {"when": when[table["cached"]]} for table in references])
    print_columns(ACCURACY_COLUMNS, [{**row, "on_front": _front(row)} for row in rows])
    paths = [path.to_dict() for path in result.trajectories]
    steps = ("coarse", "middle", "fine")
    print_columns(TRAJECTORY_COLUMNS, [path | dict(zip(steps, path["errors"], strict=True)) for path in paths])


def _front(row: Mapping[str, Any]) -> str:
    return ("front, within the reference's error" if row["reference_limited"] else "front") if row["pareto"] else ""


def _with_steps(table: dict[str, Any]) -> dict[str, Any]:
    return table | {"steps_per_s": round(1 / table["dt_s"])}


def _print_machine(machine: Machine) -> None:
    calibration = machine.calibration
    load = " and ".join("-" if value is None else f"{value:.2f}" for value in (machine.load_before, machine.load_after))
    print(f"{machine.processor}, {machine.usable_cores} of {machine.cores} cores, load before and after: {load}")
    times = f"{calibration.seconds:.4f} s, afterwards {machine.calibration_after_s:.4f} s"
    print(f"calibration: {times} for 1e9 multiply-adds ({calibration.gflop_s:.1f} Gflop/s)")
