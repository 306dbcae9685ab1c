"""Speed against accuracy: the cost and the error of every solver, the complete benchmark."""

import math
import tomllib
from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from srbval.models.run import USABLE, RunStatus
from srbval.models.solvers import SOLVERS
from srbval.progress import Progress, silent
from srbval.scene import load_scene, paper_scene
from srbval.storage.json_files import to_json
from srbval.studies.harness import Study, StudyResult, printed_columns
from srbval.studies.machine import machine_before
from srbval.studies.scenes import PAPER_STEP_S, RIG_SHOWN, SCENES, base_of, check_names
from srbval.studies.speed_accuracy.processes import measure_processes
from srbval.studies.speed_accuracy.runs import (
    WALL,
    BenchSettings,
    Row,
    ratio_or_none,
    references,
    timed_row,
    with_accuracy,
)

FULL = BenchSettings(
    timing_s=0.3, timing_settle_s=0.1, repeats=5, accuracy_s=4.0, accuracy_settle_s=0.25, memory_s=10.0, starts=3,
    reference_budget_s=60.0, steps=(30720, 61440, 122880, 245760),
)  # fmt: skip
QUICK = BenchSettings(
    timing_s=0.05, timing_settle_s=0.05, repeats=2, accuracy_s=0.5, accuracy_settle_s=0.1, memory_s=1.0, starts=1,
    reference_budget_s=10.0, steps=(61440, 122880),
)  # fmt: skip
VERDICT = {True: "met", False: "NOT MET", None: "not measured"}
REAL_TIME = 1.0  # wall seconds per simulated second
CLOSEST_LIMIT = 2e-6  # of the cage speed
MEMORY_SECONDS = 10.0  # of the run whose memory has a limit


def run_bench(
    *,
    scenes: Sequence[str] = SCENES,
    solvers: Sequence[str] = SOLVERS,
    settings: BenchSettings = FULL,
    processes: bool = True,
    accuracy: bool = True,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Time `solvers` on `scenes` and, for `accuracy`, compare them with converged runs.

    `processes` adds compile time, start-up and memory; converged runs are stored.
    Timed parts run one after the other on one core; the machine should have nothing else to do. Raises
    `ConfigurationError` for an unknown scene or solver; a failed run is a row with its status.
    """
    check_names(scenes, solvers)
    machine = machine_before()
    defaults = {name: load_scene(base_of(name)).solver.step_s for name in scenes}
    steps = step_sizes(settings, defaults.values(), accuracy=accuracy)
    rows, every = list[Row](), [(scene, solver, step) for scene in scenes for solver in solvers for step in steps]
    for number, (name, solver, step) in enumerate(every):
        progress("time the solvers", number / len(every))
        rows.append(timed_row(name, settings.timed(name, solver, step), settings.repeats))
    progress("time the solvers", 1.0)
    apart = measure_processes(settings.starts, settings.memory_s, progress) if processes else None
    found = dict[str, Row]()
    if accuracy:
        found = references(scenes, settings, progress=progress)
        rows = with_accuracy(rows, found, settings, progress)
    return {
        "machine": machine(), "default_step_s": defaults, "reference": found, "runs": rows,
        "processes": apart, "targets": list(targets(rows, apart, accuracy=accuracy)),
    }  # fmt: skip


def step_sizes(settings: BenchSettings, defaults_s: Iterable[float], *, accuracy: bool) -> list[float]:
    """Step sizes to run at [s], descending: the study's, or only the paper's, and the scenes' default ones."""
    steps = [1 / n for n in settings.steps] if accuracy else [PAPER_STEP_S]
    for default_s in defaults_s:
        if not any(math.isclose(default_s, step, rel_tol=1e-6) for step in steps):
            steps.append(default_s)
    return sorted(steps, reverse=True)


def targets(rows: Sequence[Row], processes: Mapping[str, Any] | None, *, accuracy: bool) -> Iterator[Row]:
    """The limits of ``targets.toml`` with what this run of the benchmark measured, None where it did not.

    Those of runs that are compared, and the least error of any at real time or faster, for `accuracy` alone.
    """
    table = tomllib.loads(Path(__file__).with_name("targets.toml").read_text(encoding="utf-8"))
    default = paper_scene().solver
    for one in table["row"]:
        yield _target(one, *_value(rows, one, one["solver"], PAPER_STEP_S))
    known = dict(processes or {})
    if known and known["peak_bytes"] is not None and known["memory_seconds"] >= MEMORY_SECONDS * 0.999:
        known["peak_mb"] = known["peak_bytes"] / 1e6
    for one in table["process"]:
        yield _target(one, known.get(one["value"]), False)
    if accuracy:
        for one in table["compared"]:
            value, attempted = _value(rows, one, default.name, default.step_s)
            yield _target(one | {"name": one["name"].format(solver=default.name)}, value, attempted)
        good = (row for row in rows if row["status"] in USABLE and (row[WALL] or math.inf) <= REAL_TIME)
        errors = [row["cage_error_bound"] for row in good if row["cage_error_bound"] is not None]
        name = "least cage error of a run at real time or faster, any scene"
        yield _target({"name": name, "limit": CLOSEST_LIMIT, "unit": "1"}, min(errors, default=None), True)


def _value(rows: Sequence[Row], one: Row, solver: str, step_s: float) -> tuple[float | None, bool]:
    """The value of a target, None where its run is not measurable, and whether there is such a run."""
    row, explicit = _row(rows, one["scene"], solver, step_s), _row(rows, one["scene"], "ode4", PAPER_STEP_S)
    if row is None or row["status"] not in (*USABLE, RunStatus.ENERGY_OPEN):
        return None, row is not None
    value: float | None = row[one["value"]]
    if "over_ode4" in one:
        value = ratio_or_none(value, None if explicit is None else explicit[one["value"]])
    return value, True


def _row(rows: Sequence[Row], scene: str, solver: str, step_s: float) -> Row | None:
    own = (r for r in rows if (r["scene"], r["solver"]) == (scene, solver))
    return next((r for r in own if math.isclose(r["dt_s"], step_s, rel_tol=1e-6)), None)


def _target(one: Row, value: float | None, attempted: bool) -> Row:
    """Without a value nothing was measured here or, `attempted`, the run that should have given it failed: not met."""
    met = value <= one["limit"] if value is not None else False if attempted else None
    return {key: one[key] for key in ("name", "limit", "unit")} | {"value": value, "attempted": attempted, "met": met}


def _text(result: Mapping[str, Any]) -> str:
    columns = partial(printed_columns, __package__)
    rows = [_with_steps(run) for run in result["runs"]]
    parts = [_machine_text(result["machine"]), columns("cost", rows)]
    if result["reference"]:
        when = {True: "earlier, stored", False: "now"}
        converged = [_with_steps(one) | {"when": when[one["cached"]]} for one in result["reference"].values()]
        fronts = {True: "front, within the reference's error", False: "front"}
        flagged = [row | {"on_front": fronts[row["reference_limited"]] if row["pareto"] else ""} for row in rows]
        parts += [columns("references", converged), columns("accuracy", flagged)]
    if result["targets"]:
        parts.append(columns("targets", [one | {"verdict": VERDICT[one["met"]]} for one in result["targets"]]))
    return "\n\n".join(parts)


def _with_steps(row: Row) -> Row:
    return row | {"steps_per_s": round(1 / row["dt_s"])}


def _machine_text(machine: Mapping[str, Any]) -> str:
    load = " and ".join("-" if one is None else f"{one:.2f}" for one in (machine["load_before"], machine["load_after"]))
    cores = f"{machine['usable_cores']} of {machine['cores']} cores"
    return f"{machine['processor']}, {cores}, load before and after: {load}"


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
    found = to_json(run_bench(
        scenes=scenes, solvers=tuple(options.solvers or SOLVERS), settings=settings, accuracy=not options.speed_only,
        progress=progress,
    ))  # fmt: skip
    if options.quick:
        found["targets"] = []  # a first impression is no verdict
    part = options.quick or options.speed_only or options.solvers or options.seconds
    name = None if part else {SCENES: "speed_accuracy", RIG_SHOWN: "rig_speed_accuracy"}.get(scenes)
    return StudyResult(name=name, content=found, text=_text(found))


STUDY = Study(question="What does every solver cost, and how wrong is it?", minutes=25, run=_run, options=_options)
