"""Speed against accuracy: the cost and the error of every solver, the complete benchmark."""

import math
from argparse import Namespace
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from srbval.models.solvers import SOLVERS
from srbval.progress import Progress, silent
from srbval.scene import load_scene
from srbval.storage.json_files import to_json
from srbval.studies.harness import StudyResult, printed_columns
from srbval.studies.machine import machine_before
from srbval.studies.scenes import PAPER_STEP_S, RIG_SHOWN, SCENES, base_of, check_names
from srbval.studies.speed_accuracy.runs import WALL, BenchSettings, Row, references, timed_row, with_accuracy

CAGE_TOLERANCE = 1e-5  # of the cage's speed, as the choice of a step keeps it: 0.001 %
FULL = BenchSettings(
    timing_s=0.3, timing_settle_s=0.1, repeats=5, accuracy_s=4.0, accuracy_settle_s=0.25, reference_budget_s=60.0,
    steps=(30720, 61440, 122880, 245760),
)  # fmt: skip
QUICK = BenchSettings(
    timing_s=0.05, timing_settle_s=0.05, repeats=2, accuracy_s=0.5, accuracy_settle_s=0.1, reference_budget_s=10.0,
    steps=(61440, 122880),
)  # fmt: skip


def run_bench(
    *,
    scenes: Sequence[str] = SCENES,
    solvers: Sequence[str] = SOLVERS,
    settings: BenchSettings = FULL,
    accuracy: bool = True,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Time `solvers` on `scenes` and, for `accuracy`, compare them with converged runs.

    Converged runs are stored. Timed parts run one after the other on one core; the machine should have nothing else to
    do. Raises `ConfigurationError` for an unknown scene or solver; a failed run is a row with its status.
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
    found = dict[str, Row]()
    if accuracy:
        found = references(scenes, settings, progress=progress)
        rows = with_accuracy(rows, found, settings, progress)
    return {"machine": machine(), "default_step_s": defaults, "reference": found, "runs": rows}


def step_sizes(settings: BenchSettings, defaults_s: Iterable[float], *, accuracy: bool) -> list[float]:
    """Step sizes to run at [s], descending: the study's, or only the paper's, and the scenes' default ones."""
    steps = [1 / n for n in settings.steps] if accuracy else [PAPER_STEP_S]
    for default_s in defaults_s:
        if not any(math.isclose(default_s, step, rel_tol=1e-6) for step in steps):
            steps.append(default_s)
    return sorted(steps, reverse=True)


def _answer(result: Mapping[str, Any]) -> str:
    """The fastest run of each scene that is good enough, and how many runs ended otherwise."""
    rows = [_with_steps(run) for run in result["runs"]]
    ok = [row for row in rows if row["status"] == "ok"]
    good = [row for row in ok if (row["cage_error"] or 0.0) <= CAGE_TOLERANCE]
    best = [min((row for row in good if row["scene"] == scene), key=lambda row: row[WALL])
            for scene in dict.fromkeys(row["scene"] for row in good)]  # fmt: skip
    enough = f"the cage's mean speed within {100 * CAGE_TOLERANCE:g} %" if result["reference"] else "not compared"
    return "\n".join([
        f"Fastest run of each scene with status ok, {enough}:", "",
        printed_columns(__package__, "fastest", best) if best else "none", "",
        f"{len(ok)} of {len(rows)} runs have status ok, {len(good)} of them close enough.",
        _machine_text(result["machine"]),
    ])  # fmt: skip


def _tables(result: Mapping[str, Any]) -> str:
    """Every run and every converged one."""
    columns = partial(printed_columns, __package__)
    rows = [_with_steps(run) for run in result["runs"]]
    parts = [columns("cost", rows)]
    if result["reference"]:
        when = {True: "earlier, stored", False: "now"}
        converged = [_with_steps(one) | {"when": when[one["cached"]]} for one in result["reference"].values()]
        fronts = {True: "front, within the reference's error", False: "front"}
        flagged = [row | {"on_front": fronts[row["reference_limited"]] if row["pareto"] else ""} for row in rows]
        parts += [columns("references", converged), columns("accuracy", flagged)]
    return "\n\n".join(parts)


def _with_steps(row: Row) -> Row:
    return row | {"steps_per_s": round(1 / row["dt_s"])}


def _machine_text(machine: Mapping[str, Any]) -> str:
    load = " and ".join("-" if one is None else f"{one:.2f}" for one in (machine["load_before"], machine["load_after"]))
    cores = f"{machine['usable_cores']} of {machine['cores']} cores"
    return f"{machine['processor']}, {cores}, load before and after: {load}"


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    settings = QUICK if options.quick else FULL
    if options.seconds:
        settings = replace(settings, accuracy_s=options.seconds)
    scenes = tuple(options.scenes or SCENES)
    found = to_json(run_bench(
        scenes=scenes, solvers=tuple(options.solvers or SOLVERS), settings=settings, accuracy=not options.speed_only,
        progress=progress,
    ))  # fmt: skip
    part = options.quick or options.speed_only or options.solvers or options.seconds
    name = None if part else {SCENES: "speed_accuracy", RIG_SHOWN: "rig_speed_accuracy"}.get(scenes)
    return StudyResult(name=name, content=found, text=_answer(found), tables=_tables(found))
