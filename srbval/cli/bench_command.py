"""``srbval bench``: speed against accuracy, and the studies that the report and the planner build on."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from srbval.bench.bench import BenchResult, run_bench
from srbval.bench.ladder.cases import between, grid, quick_grid
from srbval.bench.ladder.measure import SECONDS as LADDER_SECONDS
from srbval.bench.ladder.measure import answer_store, measure_ladder
from srbval.bench.ladder.table import summary
from srbval.bench.machine import Machine
from srbval.bench.scenes import FULL, QUICK, RIG_SHOWN, SCENES
from srbval.cli.measured import measure_and_print
from srbval.cli.output import print_columns, print_json
from srbval.models.solvers import SOLVERS
from srbval.progress import Progress, ProgressDisplay, prefixed
from srbval.scene import load_scene
from srbval.storage.stored_result import RIG_SPEED_ACCURACY, SENSITIVITY, SPEED_ACCURACY
from srbval.storage.strict_json import json_object, write_json
from srbval.validation.sensitivity import DRAWS
from srbval.validation.sensitivity import measure as measure_sensitivity

FEW_DRAWS = 16  # of the open inputs with --quick
VERDICT = {True: "met", False: "NOT MET", None: "not measured"}


def run(options: argparse.Namespace) -> int:
    """Measure and print; targets that are not met are reported, they do not change the exit code."""
    if options.ladder:
        return _ladder(options)
    if options.sensitivity:
        return _sensitivity(options)
    settings = QUICK if options.quick else FULL
    if options.seconds:
        settings = replace(settings, accuracy_s=options.seconds)

    scenes = tuple(options.scenes or SCENES)

    def measure(progress: Progress) -> BenchResult:
        return run_bench(
            scenes=scenes,
            solvers=tuple(options.solvers or SOLVERS),
            settings=settings,
            accuracy=not options.speed_only,
            progress=progress,
        )

    kind = RIG_SPEED_ACCURACY if scenes == RIG_SHOWN else SPEED_ACCURACY
    part = options.quick or options.speed_only or options.solvers or options.seconds
    part = part or scenes not in (SCENES, RIG_SHOWN)
    measure_and_print(kind, options, measure, complete=not part, show=_print)
    return 0


def _sensitivity(options: argparse.Namespace) -> int:
    """What open inputs and numerics do to the compared quantities of the paper's scene, or of the user's."""
    scene = load_scene(options.scene) if options.scene else None

    def measure(progress: Progress) -> dict[str, Any]:
        found = measure_sensitivity(
            scene=scene,
            inputs=Path(options.inputs) if options.inputs else None,
            draws=FEW_DRAWS if options.quick else DRAWS,
            progress=progress,
        )
        return json_object(found)

    own = options.quick or options.scene or options.inputs
    measure_and_print(SENSITIVITY, options, measure, complete=not own, show=_print_sensitivity)
    return 0


def _print_sensitivity(result: Mapping[str, Any]) -> None:
    for found in result["defects"]:
        extra = ", twice the first number, since the emulator missed too many" if found["refined"] else ""
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
