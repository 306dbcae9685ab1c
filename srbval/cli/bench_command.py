"""``srbval bench``: speed against accuracy, and the studies that the report and the planner build on."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from srbval.cli.measured import measure_and_print
from srbval.cli.output import print_columns, print_json
from srbval.comparison.budget import STUDY
from srbval.errors import ConfigurationError, DataError
from srbval.models.solvers import SOLVERS
from srbval.plan.cases import between, grid, quick_grid
from srbval.plan.table import summary
from srbval.progress import Progress, ProgressDisplay, prefixed
from srbval.recordings.registry import listing
from srbval.scene import load_scene
from srbval.storage.stored_result import (
    DIAGNOSIS,
    RIG_INPUTS,
    RIG_SPEED_ACCURACY,
    SENSITIVITY,
    SPEED_ACCURACY,
    VERDICT_SCAN,
    newest_result,
)
from srbval.storage.strict_json import json_object, json_value, write_json
from srbval.studies.diagnosis.naming_scores import naming_scores
from srbval.studies.diagnosis.study import ALL, confusions, judge, known_records, methods
from srbval.studies.machine import Machine
from srbval.studies.model_hierarchy.study import SECONDS as LADDER_SECONDS
from srbval.studies.model_hierarchy.study import answer_store, measure_ladder
from srbval.studies.scenes import FULL, QUICK, RIG_SHOWN, SCENES
from srbval.studies.sensitivity.study import measure as measure_sensitivity
from srbval.studies.speed_accuracy.study import BenchResult, run_bench
from srbval.studies.verdict_scan.study import scan

FEW_DRAWS = 16  # of the open inputs with --quick
VERDICT = {True: "met", False: "NOT MET", None: "not measured"}


def run(options: argparse.Namespace) -> int:
    """Measure and print; targets that are not met are reported, they do not change the exit code."""
    if options.ladder:
        return _ladder(options)
    if options.sensitivity:
        return _sensitivity(options)
    if options.diagnosis:
        return _diagnosis(options)
    settings = QUICK if options.quick else FULL
    if options.seconds:
        settings = replace(settings, accuracy_s=options.seconds)

    scenes = tuple(options.scenes or SCENES)

    def measure(progress: Progress) -> BenchResult:
        found = run_bench(
            scenes=scenes,
            solvers=tuple(options.solvers or SOLVERS),
            settings=settings,
            accuracy=not options.speed_only,
            progress=progress,
        )
        return replace(found, targets=()) if options.quick else found  # a first impression is no verdict

    kind = RIG_SPEED_ACCURACY if scenes == RIG_SHOWN else SPEED_ACCURACY
    part = options.quick or options.speed_only or options.solvers or options.seconds
    part = part or scenes not in (SCENES, RIG_SHOWN)
    measure_and_print(kind, options, measure, complete=not part, show=_print)
    return 0


def _sensitivity(options: argparse.Namespace) -> int:
    """What open inputs and numerics do to the compared quantities of the paper's scene, or of the user's."""
    if options.scan:
        return _scan(options)
    scene = load_scene(options.scene) if options.scene else None

    def measure(progress: Progress) -> dict[str, Any]:
        found = measure_sensitivity(
            scene=scene,
            inputs=Path(options.inputs) if options.inputs else None,
            draws=FEW_DRAWS if options.quick else STUDY.draws,
            progress=progress,
        )
        return json_object(found)

    own = options.quick or options.scene or options.inputs
    measure_and_print(SENSITIVITY, options, measure, complete=not own, show=_print_sensitivity)
    return 0


def _scan(options: argparse.Namespace) -> int:
    """What would be stated of the cage ratio with each input alone over its range."""
    if options.scene or options.inputs or options.quick:
        raise ConfigurationError("--scan applies to the paper's scene only: leave out --scene, --inputs and --quick.")

    def measure(progress: Progress) -> dict[str, Any]:
        study = newest_result(RIG_INPUTS)
        rows = scan(study.content if study else None, progress=progress)
        return {"rig_scene": study and study.origin, "rows": [json_object(row) for row in rows]}

    measure_and_print(VERDICT_SCAN, options, measure, complete=True, show=_print_scan)
    return 0


def _print_scan(result: Mapping[str, Any]) -> None:
    print_columns("scan", [
        row | {
            "first": row["values"][0], "last": row["values"][-1], "least_pct": min(row["errors_pct"]),
            "largest_pct": max(row["errors_pct"]), "would_state": ", ".join(dict.fromkeys(row["answers"])),
        }
        for row in result["rows"]
    ])  # fmt: skip


def _diagnosis(options: argparse.Namespace) -> int:
    """How often faults are diagnosed correctly; `DataError` where no record of known state is registered."""
    registered = listing().recordings
    records = known_records(registered)
    if not records:
        raise DataError(
            "no measured recording of known state is registered; register some with srbval data add DIR, or name their "
            "folder in SRBVAL_RECORDINGS."
        )

    def measure(progress: Progress) -> dict[str, Any]:
        judged = judge(records, methods(registered), progress=progress)
        rest = {"naming": naming_scores(), "records": judged}
        found: dict[str, Any] = json_value({"confusions": list(confusions(judged))} | rest)
        return found

    measure_and_print(DIAGNOSIS, options, measure, complete=True, show=_print_diagnosis)
    return 0


def _print_diagnosis(result: Mapping[str, Any]) -> None:
    for row in result["confusions"]:
        if row["dataset"] == ALL:
            print(f"{row['method']}, {row['answer']}:")
            print_columns("diagnosis-confusion", [{"state": state} | said for state, said in row["counts"].items()])
    for row in (result["naming"]["scores"], result["naming"]["wrongly_read"]):
        print(", ".join(f"{name.replace('_', ' ')} {value:.4g}" for name, value in row.items()))
    print_columns("diagnosis", [row | _per_cent(row) for row in result["confusions"] if row["healthy"] + row["faulty"]])


def _per_cent(row: Mapping[str, Any]) -> dict[str, str]:
    """The intervals of a row in words."""
    shares = {"right_range": row["right_ci95"], "wrong_range": row["wrong_ci95"], "alarm_range": row["alarms_ci95"]}
    return {name: f"{100 * v[0]:.0f} to {100 * v[1]:.0f}" if v else "" for name, v in shares.items()}


def _print_sensitivity(result: Mapping[str, Any]) -> None:
    for found in result["defects"]:
        extra = ", in more than one round, since the emulator missed too many" if found["refined"] else ""
        print(f"{found['defect']}: {found['draws']} draws of all inputs{extra}; {found['failed']} failed")
        print_columns("sensitivity", [row | {"most_by": _most_by(row["shares"])} for row in found["quantities"]])


def _most_by(shares: Mapping[str, float]) -> str:
    """The two inputs that settle most of the variance on their own."""
    most = sorted(shares, key=lambda name: -shares[name])[:2]
    return ", ".join(f"{name} {100 * shares[name]:.0f} %" for name in most)


def _ladder(options: argparse.Namespace) -> int:
    """The calibration table of the ladder of models; written only where ``-o`` names a file."""
    with ProgressDisplay() as progress:
        table = measure_ladder(
            (quick_grid if options.quick else grid)(options.base),
            [] if options.quick else between(options.base),
            base=options.base,
            seconds=options.seconds or LADDER_SECONDS,
            jobs=options.jobs,
            store=answer_store(),
            progress=prefixed(progress, "Bench"),
        )
    if options.output:
        write_json(Path(options.output), table)
    rows = summary(table)
    if options.json:
        print_json(json_object(table) | {"ladder": rows})
    else:
        print(f"reference: {table.reference}; {len(table.entries)} scenes of {table.seconds:g} s")
        print_columns("ladder", rows)
    return 0


def _print(result: BenchResult) -> None:
    _print_machine(result.machine)
    rows = [_with_steps(run) for run in result.runs]
    print_columns("speed-cost", rows)
    if result.references:
        _print_accuracy(result, rows)
    if result.targets:
        print_columns("speed-targets", [json_object(t) | {"verdict": VERDICT[t.met]} for t in result.targets])


def _print_accuracy(result: BenchResult, rows: Sequence[Mapping[str, Any]]) -> None:
    references = [_with_steps(reference) for reference in result.references.values()]
    when = {True: "earlier, stored", False: "now"}
    print_columns("speed-references", [table | {"when": when[table["cached"]]} for table in references])
    print_columns("speed-accuracy", [{**row, "on_front": _front(row)} for row in rows])
    paths = [json_object(path) for path in result.trajectories]
    steps = ("coarse", "middle", "fine")
    print_columns("speed-trajectories", [path | dict(zip(steps, path["errors"], strict=True)) for path in paths])


def _front(row: Mapping[str, Any]) -> str:
    return ("front, within the reference's error" if row["reference_limited"] else "front") if row["pareto"] else ""


def _with_steps(measured: object) -> dict[str, Any]:
    table = json_object(measured)
    return table | {"steps_per_s": round(1 / table["dt_s"])}


def _print_machine(machine: Machine) -> None:
    calibration = machine.calibration
    load = " and ".join("-" if value is None else f"{value:.2f}" for value in (machine.load_before, machine.load_after))
    print(f"{machine.processor}, {machine.usable_cores} of {machine.cores} cores, load before and after: {load}")
    times = f"{calibration.seconds:.4f} s, afterwards {machine.calibration_after_s:.4f} s"
    print(f"calibration: {times} for 1e9 multiply-adds ({calibration.gflop_s:.1f} Gflop/s)")
