"""Speed against accuracy: the cost and the error of every solver, the complete benchmark."""

import math
from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from srbval.models.solvers import SOLVERS
from srbval.processes.machine import load_average
from srbval.progress import Progress, silent
from srbval.scene import load_scene
from srbval.storage.json_files import to_json
from srbval.storage.stored_result import ContentStore
from srbval.studies.harness import Study, StudyResult, printed_columns
from srbval.studies.machine import Machine, calibrate, describe_machine
from srbval.studies.scenes import (
    FULL,
    PAPER_STEP_S,
    QUICK,
    RIG_SHOWN,
    SCENES,
    BenchSettings,
    base_of,
    check_scenes,
    check_solvers,
)
from srbval.studies.speed_accuracy.processes import Processes, measure_processes
from srbval.studies.speed_accuracy.reference import SceneReference, references
from srbval.studies.speed_accuracy.row import BenchRun
from srbval.studies.speed_accuracy.speed import speed_rows
from srbval.studies.speed_accuracy.targets import Target, accuracy_targets, speed_targets
from srbval.studies.speed_accuracy.work_precision import Trajectory, trajectories, with_accuracy

VERDICT = {True: "met", False: "NOT MET", None: "not measured"}
COST = {
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
ACCURACY = {
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
REFERENCES = {
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
TRAJECTORIES = {
    "trajectory": "scene",
    "solver": "solver",
    "error": "coarse",
    "half the step": "middle",
    "quarter": "fine",
    "observed order": "observed_order",
    "of reference": "reference_error",
}


@dataclass(frozen=True, kw_only=True)
class BenchResult:
    """All that a benchmark measured; `references` and `trajectories` are empty where only speed was asked for.

    `default_step_s`: of each scene.
    """

    machine: Machine
    default_step_s: dict[str, float]
    references: dict[str, SceneReference]
    runs: tuple[BenchRun, ...]
    trajectories: tuple[Trajectory, ...]
    processes: Processes | None
    targets: tuple[Target, ...]

    def to_dict(self) -> dict[str, Any]:
        """What is written as JSON."""
        return {"reference" if name == "references" else name: value for name, value in vars(self).items()}


def run_bench(
    *,
    scenes: Sequence[str] = SCENES,
    solvers: Sequence[str] = SOLVERS,
    settings: BenchSettings = FULL,
    processes: bool = True,
    store: ContentStore | None = None,
    accuracy: bool = True,
    progress: Progress = silent,
) -> BenchResult:
    """Time `solvers` on `scenes` and, for `accuracy`, compare them with converged references.

    `processes` adds compile time, start-up and memory; references are in the store, the user's cache by default.
    Timed parts run one after the other on one core; the machine should have nothing else to do. Raises
    `ConfigurationError` for an unknown scene or solver; a failed run is a row with its status.
    """
    check_scenes(scenes)
    check_solvers(solvers)
    load = load_average()
    calibration = calibrate()
    defaults = {name: load_scene(base_of(name)).solver.step_s for name in scenes}
    steps = step_sizes(settings, defaults.values(), accuracy=accuracy)
    rows = speed_rows(scenes, solvers, steps, settings, calibration.seconds, progress)
    measured_processes = measure_processes(settings, progress) if processes else None
    found: dict[str, SceneReference] = {}
    paths: list[Trajectory] = []
    if accuracy:
        found = references(scenes, settings, store=store, progress=progress)
        rows = with_accuracy(rows, found, settings, progress)
        paths = trajectories(scenes, solvers, settings, progress)
    return BenchResult(
        machine=describe_machine(calibration, calibrate(), load),
        default_step_s=defaults,
        references=found,
        runs=tuple(rows),
        trajectories=tuple(paths),
        processes=measured_processes,
        targets=(*speed_targets(rows, measured_processes), *(accuracy_targets(rows) if accuracy else ())),
    )


def step_sizes(settings: BenchSettings, defaults_s: Iterable[float], *, accuracy: bool) -> list[float]:
    """Step sizes to run at [s], descending: the study's, or only the paper's, and the scenes' default ones."""
    steps = [1 / n for n in settings.steps] if accuracy else [PAPER_STEP_S]
    for default_s in defaults_s:
        if not any(math.isclose(default_s, step, rel_tol=1e-6) for step in steps):
            steps.append(default_s)
    return sorted(steps, reverse=True)


def _text(result: BenchResult) -> str:
    columns = partial(printed_columns, __package__)
    rows = [_with_steps(run) for run in result.runs]
    parts = [_machine_text(result.machine), columns("cost", rows)]
    if result.references:
        when = {True: "earlier, stored", False: "now"}
        references = [_with_steps(reference) for reference in result.references.values()]
        paths = [to_json(path) for path in result.trajectories]
        steps = ("coarse", "middle", "fine")
        parts += [
            columns("references", [table | {"when": when[table["cached"]]} for table in references]),
            columns("accuracy", [{**row, "on_front": _front(row)} for row in rows]),
            columns("trajectories", [path | dict(zip(steps, path["errors"], strict=True)) for path in paths]),
        ]
    if result.targets:
        parts.append(columns("targets", [to_json(t) | {"verdict": VERDICT[t.met]} for t in result.targets]))
    return "\n\n".join(parts)


def _front(row: Mapping[str, Any]) -> str:
    return ("front, within the reference's error" if row["reference_limited"] else "front") if row["pareto"] else ""


def _with_steps(measured: object) -> dict[str, Any]:
    table = to_json(measured)
    return table | {"steps_per_s": round(1 / table["dt_s"])}


def _machine_text(machine: Machine) -> str:
    calibration = machine.calibration
    load = " and ".join("-" if value is None else f"{value:.2f}" for value in (machine.load_before, machine.load_after))
    return (
        f"{machine.processor}, {machine.usable_cores} of {machine.cores} cores, load before and after: {load}\n"
        f"calibration: {calibration.seconds:.4f} s, afterwards {machine.calibration_after_s:.4f} s for 1e9 "
        f"multiply-adds ({calibration.gflop_s:.1f} Gflop/s)"
    )


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--quick", action="store_true", help="short runs: a first impression, not for publication")
    parser.add_argument("--scenes", metavar="NAME", nargs="+", help="scenes, such as play0-outer (default: all six)")
    parser.add_argument("--solvers", metavar="NAME", nargs="+", help="solvers, such as ode4 (default: all)")
    parser.add_argument("--seconds", metavar="S", type="positive", help="duration of the runs compared (default: 4)")
    parser.add_argument(
        "--speed-only", action="store_true", help="time the solvers without comparing them with a reference"
    )


def _run(options: Namespace, progress: Progress) -> StudyResult:
    """Targets that are not met are reported, they do not change the exit code."""
    settings = QUICK if options.quick else FULL
    if options.seconds:
        settings = replace(settings, accuracy_s=options.seconds)
    scenes = tuple(options.scenes or SCENES)
    found = run_bench(
        scenes=scenes, solvers=tuple(options.solvers or SOLVERS), settings=settings, accuracy=not options.speed_only,
        progress=progress,
    )  # fmt: skip
    if options.quick:
        found = replace(found, targets=())  # a first impression is no verdict
    part = options.quick or options.speed_only or options.solvers or options.seconds
    name = None if part else {SCENES: "speed_accuracy", RIG_SHOWN: "rig_speed_accuracy"}.get(scenes)
    return StudyResult(name=name, content=found, text=_text(found))


STUDY = Study(question="What does every solver cost, and how wrong is it?", minutes=25, run=_run, options=_options)
