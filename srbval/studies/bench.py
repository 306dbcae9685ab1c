"""Benchmark of solvers and of models from outside: cost, step error and largest stable step.

The step error is the difference from a converged run, the run of the same model at a finer step. A run is `ok` (in the
search for the largest step: `stable`) if it succeeds with errors within `ERROR_LIMITS`; with larger errors it is
``inaccurate``. Runs with `Step.CHECKED` are `ok` if `srbval simulate` accepts them.
"""

import importlib
import itertools
import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from srbval.campaign.cases import cost_of
from srbval.errors import ConfigurationError
from srbval.models.health import CHANCE_HIDES, default_solver
from srbval.models.jit import expected_compile_s
from srbval.models.outside.names import OWN_SOLVER, is_outside, solvers_of
from srbval.models.run import Run, RunStatus, works
from srbval.models.simulate import Step
from srbval.models.solvers import SOLVERS
from srbval.models.step_limits import predict
from srbval.plan.measures import measure
from srbval.processes.machine import load_average, this_machine
from srbval.progress import Progress, silent, stage
from srbval.progress.tables import text_rows
from srbval.report.figures.style import PanelData, figure_style
from srbval.scene import Scene, load_scene
from srbval.storage.stored_result import newest_result
from srbval.studies.harness import StudyResult
from srbval.sweep.pool import Attempt, attempt, side_by_side
from srbval.sweep.scenes import PAPER, base_of, bench_scene, check_names, lasting_passages
from srbval.sweep.sweep import Case, bisect, records, sweep

BenchRow = dict[str, Any]  # one row of a table, by the names of its columns
Models = list[tuple[str, str]]  # model and solver; the model "" is the scene's own
# Steps per second of the runs of a benchmark, simulated seconds of a timed run and of a run from which errors follow.
Extent = tuple[tuple[int, ...], float, float]
FULL, QUICK = ((40960, 61440, 122880), 0.2, 1.0), ((61440,), 0.05, 0.3)
MAX_SETTLE_S = 0.25  # before each run, at most a quarter of its time
TIMED_PAIRS = 2  # pairs of timed runs
FINER_BUNDLED, FINER_STEPS = 4, 2  # steps of a converged run per step of the finest: bundled model, other model
ERROR_LIMITS = {"line_error_pct": 0.1, "band_rms_error_db": 0.42}  # what a rig's record of some seconds resolves
ERROR_UNITS = {"line_error_pct": "% of the line", "band_rms_error_db": "dB of the level"}
BENCH_SCENES, RPM = ("interference-outer",), (355.0, 710.0, 1500.0, 3000.0)
# Divisors of a second. Bisection runs the middle one first: the paper's, so that every line has a run at its step.
STEPS_PER_S = (245760, 122880, 81920, 61440, 40960, 30720, 20480, 10240)
RUN_PASSAGES, MIN_RUN_S = 4.0, 0.25  # roller passages in a run of the stability map, and its least duration
CELL = ("scene", "model", "solver", "rpm", "steps_per_s")  # columns that name a run of the map
PREDICTED = ("predicted_limit_dt_s", "predicted_elastic_limit_dt_s")
NONE: BenchRow = dict.fromkeys(PREDICTED)
DEFAULT = default_solver()
MEASURED, COSTS = ("cage_ratio", "noise_floor", "band_rms_m_s2"), ("wall_per_simulated_s", "cpu_per_simulated_s")
RATIOS = ("cpu_ratio", "cpu_ratio_range")
BENCH_COLUMNS = {"scene": "scene", "solver": "series", "1/dt [Hz]": "steps_per_s", "CPU [s/s]": COSTS[1]}
BENCH_COLUMNS |= {"line [%]": "line_error_pct", "level [dB]": "band_rms_error_db"}
BENCH_COLUMNS |= {"level, from bundled [dB]": "bundled_band_rms_error_db", "status": "status"}


def bench(
    model: str | None = None,
    *,
    scenes: Sequence[str] = BENCH_SCENES,
    solvers: Sequence[str] = (),
    quick: bool = False,
    extent: Extent | None = None,
    step: Step = Step.UNCHECKED,
    jobs: int | None = 1,
    progress: Progress = silent,
    message: Callable[[str], None] = lambda _: None,
) -> StudyResult:
    """Measure cost and step errors of `model` (if given) and of the bundled solvers at the same steps.

    `solvers` selects solvers of the model or, if no model is given, bundled solvers. A failed run is listed with its
    status. `message` receives the expected time, then each row of the table. An interrupted command continues if it is
    given again. `cpu_ratio` is the CPU time divided by the default solver's at the same step, both timed alternately:
    the median, and the range. Errors named ``bundled_`` are differences from the bundled model's converged run.
    `extent` replaces the usual steps and durations. `jobs` runs are compared at a time, with their `step` checked or
    not; timed runs never overlap.
    """
    check_names(scenes, () if model else solvers)
    steps_per_s, timed_s, compared_s = extent or (QUICK if quick else FULL)
    own, finest, load = _own_solvers(model, solvers), max(steps_per_s), load_average()
    first = {one["solver"]: _run_probe(one, timed_s, progress) for one in _cases(scenes[:1], own, steps_per_s[:1])}
    able = [one for one in own if works(first[one[1]][0].status)]
    others = [("", name) for name in SOLVERS if name != DEFAULT and not quick]
    models = [("", DEFAULT), *able, *others] if model else [("", name) for name in solvers or SOLVERS]
    cases = _cases(scenes, models, steps_per_s)
    fine = _cases(scenes, [("", DEFAULT)], [FINER_BUNDLED * finest // 2, FINER_BUNDLED * finest])
    own_fine = _cases(scenes, able, [FINER_STEPS * finest])

    def whole(case: Case) -> Scene:
        return _scene(case, compared_s)

    def in_turns(case: Case) -> tuple[Scene, ...]:
        (usual,) = _cases([case["scene"]], [("", DEFAULT)], [case["steps_per_s"]])
        return TIMED_PAIRS * (_scene(usual, timed_s), _scene(case, timed_s))

    scenes_to_run = [*map(whole, (*fine, *own_fine, *cases)), *(one for row in cases for one in in_turns(row))]
    planned_s, compile_s = _estimate_time(scenes_to_run, first)
    once = f", {compile_s:.0f} s of it to compile the solvers once" if compile_s else ""
    message(f"about {planned_s:.0f} s{once}; stop with Ctrl-C, and the same command continues from there")
    how = dict[str, Any](jobs=jobs, progress=progress)
    right = records(sweep(pd.DataFrame([*fine, *own_fine]), whole, measures, task="converged runs", **how))
    pairs = zip(right[: len(fine) : 2], right[1 : len(fine) : 2], strict=True)
    usual = {row["scene"]: row | {"own_cage_error": errors(twice, row)["cage_error"]} for twice, row in pairs}
    references = {(row["scene"], row["model"], row["solver"]): row for row in right[len(fine) :]}
    runs, rows = sweep(pd.DataFrame(cases), whole, measures, task="runs to compare", step=step, **how), list[BenchRow]()
    for number, (case, run) in enumerate(zip(cases, records(runs), strict=True)):
        progress("time the solvers", number / len(cases))
        (timed,) = records(sweep(pd.DataFrame([case]), in_turns, measure_cost, task="", jobs=1))
        reference = references.get((run["scene"], run["model"], run["solver"]))
        row = judge_step_error(run, reference or usual[run["scene"]], checked=step is Step.CHECKED)
        apart = errors(run, usual[run["scene"]]) if reference else {}
        row |= {f"bundled_{name}": error for name, error in apart.items()}
        rows.append(row | {name: timed[name] for name in COSTS + RATIOS})
        lines = _bench_table(rows, model).splitlines()
        message("\n".join(lines if len(rows) == 1 else lines[-1:]))
    progress("time the solvers", 1.0)
    for row in _cases(scenes, [one for one in own if one not in able], steps_per_s):
        probe, _ = first[row["solver"]]
        rows.append(row | {"series": _series(row), "status": probe.status.value, "reason": probe.reason, "ok": False})
    rows = with_fronts(rows, "band_rms_error")
    machine = this_machine() | {"load_before": load, "load_after": load_average()}
    content = {"machine": machine, "seconds_planned": planned_s, "reference": usual, "runs": rows}
    return StudyResult(content=content, text=_bench_text(rows, model))


def stability(
    model: str | None = None,
    *,
    scenes: Sequence[str] = BENCH_SCENES,
    solvers: Sequence[str] = (),
    rpm: Sequence[float] = (),
    quick: bool = False,
    **how: Any,
) -> StudyResult:
    """Find the largest stable step of `model` or of the bundled solvers by bisection, by scene, solver and speed.

    A bundled run is stable if `srbval simulate` accepts it, a run of `model` if its step errors are within
    `ERROR_LIMITS`. A largest step is `certain` unless random scatter of this run hides whether the step's errors are
    within their tolerances. `how`: `jobs`, `progress`.
    """
    check_names(scenes, () if model else solvers)
    models = _own_solvers(model, solvers) or [("", name) for name in solvers or SOLVERS]
    finest = _cases(scenes, models, [FINER_STEPS * STEPS_PER_S[0]], rpm or (RPM[1:2] if quick else RPM))
    fine = records(sweep(pd.DataFrame(finest), passing_scene, measures, task="converged runs", **how)) if model else []
    references = {(row["scene"], row["solver"], row["rpm"]): row for row in fine}
    predicted = {} if model else predictions(finest, **how)

    def judged(cell: Case) -> BenchRow:
        at = cell["scene"], cell["solver"], cell["rpm"]
        found = judge_step_error(cell, references[at]) if model else {**cell, "ok": works(cell["status"])}
        return found | {"stable": found["ok"]} | predicted.get(at, NONE)

    groups, steps = pd.DataFrame(finest).drop(columns="steps_per_s"), pd.Series(STEPS_PER_S, name="steps_per_s")
    how["step"] = Step.UNCHECKED if model else Step.CHECKED
    lines, cells = bisect(groups, steps, passing_scene, measures, lambda cell: judged(cell)["stable"], **how)
    hidden = {tuple(map(cell.get, CELL)) for cell in records(cells) if CHANCE_HIDES in cell["reason"]}
    lines["certain"] = [tuple(map(line.get, CELL)) not in hidden for line in records(lines)]
    lines = lines.assign(series=lines.apply(_series, axis=1), largest_stable_dt_s=1 / lines["steps_per_s"])
    table = lines.pivot(index=["scene", "series"], columns="rpm", values="steps_per_s")
    text = "Fewest steps per second of a stable run, by speed [rpm] (-: no tried step is stable):\n\n"
    text += table.to_string(float_format="{:.0f}".format, na_rep="-")
    if model and not lines["bounded"].all():
        text += "\n\nThe longest step is stable: does the model use scene.solver.step_s?"
    limits = [row | predicted.get((row["scene"], row["solver"], row["rpm"]), NONE) for row in records(lines)]
    content = {"tolerances": ERROR_LIMITS, "limits": limits, "cells": [judged(cell) for cell in records(cells)]}
    return StudyResult(content=content, text=text)


def predictions(rows: Sequence[BenchRow], **how: Any) -> dict[tuple[Any, ...], BenchRow]:
    """Predict the largest stable steps [s], with friction and without, by scene, solver and speed of the `rows`."""
    scenes = {(row["scene"], row["rpm"]): passing_scene(row) for row in rows}
    solvers = list(dict.fromkeys(row["solver"] for row in rows))
    found = side_by_side(scenes, lambda key, _: predict(scenes[key], solvers), task="linear theory", **how)
    return {
        (scene, solver, rpm): dict(zip(PREDICTED, steps_s, strict=True))
        for (scene, rpm), of_solver in found.items()
        for solver, steps_s in of_solver.items()
    }


def draw_study(name: str, content: Mapping[str, Any]) -> PanelData:
    """Draw the chart of study `name` from `content`: a model's largest stable steps beside those of bundled solvers."""
    rows, stored = pd.DataFrame(content.get("runs") or content["limits"]), newest_result(name)
    if "limits" in content and rows["model"].map(is_outside).any() and stored is not None:
        known = pd.DataFrame(stored.content["limits"])
        beside = known["scene"].isin(rows["scene"]) & known["solver"].isin((DEFAULT, PAPER.solver))
        rows = pd.concat([known[beside].assign(series=known["solver"]), rows], ignore_index=True)
    with figure_style():
        drawn: PanelData = importlib.import_module(f"srbval.studies.{name}.page").chart(rows)
        return drawn


def measures(_: Case, own: Attempt) -> BenchRow:
    """Step [s], cage ratio, noise floor and band RMS of a run; None for an incomplete run or an unknown quantity."""
    known = measure(own.run) if own.run is not None and own.measurable else {}
    found = {name: value if (value := known.get(name)) and math.isfinite(value) else None for name in MEASURED}
    return {"dt_s": own.scene.solver.step_s} | found


def measure_cost(_: Case, *pairs: Attempt) -> BenchRow:
    """Least times per simulated second of a solver, None if a run ended early, and its CPU time over the default's.

    `pairs` are runs of the default solver and of the solver, alternately.
    """
    runs = [one.run for one in pairs if one.run is not None and one.run.samples == one.scene.samples]
    if len(runs) < len(pairs):
        return dict.fromkeys(COSTS + RATIOS)
    ratios = [row.cpu_s / usual.cpu_s for usual, row in zip(runs[::2], runs[1::2], strict=True)]
    least = {name: min(getattr(run, name) for run in runs[1::2]) for name in COSTS}
    return least | {"cpu_ratio": statistics.median(ratios), "cpu_ratio_range": [min(ratios), max(ratios)]}


def errors(own: Mapping[str, Any], right: Mapping[str, Any]) -> BenchRow:
    """Errors of cage speed, BPFO [%] and band RMS [dB] of `own` relative to the finer run `right`; None if unknown."""
    cage, band = (own[n] / right[n] if own[n] and right[n] else math.nan for n in ("cage_ratio", "band_rms_m_s2"))
    found = {"cage_error": abs(cage - 1), "band_rms_error": abs(band - 1)}
    found |= {"line_error_pct": 100 * found["cage_error"], "band_rms_error_db": 20 * math.log10(band)}
    return {name: None if math.isnan(error) else error for name, error in found.items()}


def judge_step_error(row: Mapping[str, Any], right: Mapping[str, Any], *, checked: bool = False) -> BenchRow:
    """Add to a run the step errors relative to the reference run `right`, and `ok`.

    Unless the step was `checked` by the run itself, the status accounts for the errors.
    """
    off = errors(row, right)
    known = {name: abs(off[name]) for name in ERROR_LIMITS if off[name] is not None}
    beyond = " and ".join(f"{x:.3g} {ERROR_UNITS[name]}" for name, x in known.items() if x > ERROR_LIMITS[name])
    found = {**row, **off, "series": _series(row)}
    if not checked and works(row["status"]) and (beyond or not known):
        most = " and ".join(f"{limit} {ERROR_UNITS[name]}" for name, limit in ERROR_LIMITS.items())
        why = f"its step errors are {beyond}" if beyond else "the step's error is unknown without a converged run"
        found |= {"status": RunStatus.INACCURATE.value, "reason": f"{why}; accepted are at most {most}"}
    return found | {"ok": works(found["status"])}


def pareto_front(runs: pd.DataFrame, error: str) -> pd.DataFrame:
    """Runs that are ok, each with a smaller `error` than all cheaper ok runs of its scene; cheapest first."""
    good = runs[runs["ok"].astype(bool)].astype({COSTS[1]: float, error: float}).dropna(subset=[COSTS[1], error])
    good = good.sort_values([COSTS[1], error])
    least = good.groupby("scene")[error].transform(lambda of_scene: of_scene.cummin().shift(fill_value=math.inf))
    return good[good[error] < least]


def with_fronts(rows: Sequence[BenchRow], error: str) -> list[BenchRow]:
    """Add `pareto` to the runs: true for those of `pareto_front`."""
    front = set(pareto_front(pd.DataFrame(rows), error).index)
    return [row | {"pareto": place in front} for place, row in enumerate(rows)]


def _run_probe(row: BenchRow, seconds: float, progress: Progress) -> tuple[Run, float]:
    """Make a short run of a model; returns it and its start-up time [s]; `ConfigurationError` if it is refused."""
    began = time.perf_counter()
    with stage(progress, f"a first short run of {_series(row)}, from which the time of all follows"):
        found = attempt(_scene(row, seconds))
    if found.run is None:
        raise ConfigurationError(found.reason)
    return found.run, time.perf_counter() - began - found.run.wall_s


def _estimate_time(scenes: Sequence[Scene], first: Mapping[str, tuple[Run, float]]) -> tuple[float, float]:
    """Expected time of all runs with compiling, and of compiling alone [s]; `first` contains short runs by solver."""
    bundled = [scene for scene in scenes if not is_outside(scene.model)]
    compile_s = expected_compile_s(*bundled)
    total_s = compile_s + sum(cost_of(scene)[0] for scene in bundled)
    for scene in (scene for scene in scenes if is_outside(scene.model)):
        run, start_s = first[scene.solver.name]
        steps_ratio = run.scene.solver.step_s / scene.solver.step_s
        total_s += start_s + (scene.settle_s + scene.duration_s) * run.cpu_per_simulated_s * steps_ratio
    return total_s, compile_s


def _own_solvers(model: str | None, solvers: Sequence[str]) -> Models:
    """List `model`, if given, with each of the `solvers`, by default all that it offers."""
    return [(model, name) for name in solvers or solvers_of(model) or (OWN_SOLVER,)] if model else []


def _series(row: Mapping[str, Any]) -> str:
    """Name of model and solver in tables and charts."""
    return f"{Path(row['model']).name} {row['solver']}" if is_outside(row["model"]) else row["solver"]


def _cases(
    scenes: Sequence[str], models: Models, steps_per_s: Sequence[int], rpm: Sequence[float | None] = (None,)
) -> list[BenchRow]:
    """List the runs for every combination of scene, model with solver, speed (None: the scene's own) and step."""
    return [
        dict(zip(CELL, (scene, model or load_scene(base_of(scene)).model, solver, *rest), strict=True))
        for scene, (model, solver), *rest in itertools.product(scenes, models, rpm, steps_per_s)
    ]


def _scene(case: Case, seconds: float) -> Scene:
    """Scene of a run; `seconds` are recorded, after a quarter of this time to settle, at most `MAX_SETTLE_S`."""
    about = {"step_s": 1 / case["steps_per_s"], "seconds": seconds, "rpm": case["rpm"]}
    usual = bench_scene(case["scene"], solver=DEFAULT, settle_s=min(seconds / 4, MAX_SETTLE_S), **about)
    return replace(usual, model=case["model"], solver=replace(usual.solver, name=str(case["solver"])))


def passing_scene(case: Case) -> Scene:
    """Scene of a run of the stability map; its duration depends on the speed alone."""
    return lasting_passages(_scene(case, MIN_RUN_S), RUN_PASSAGES, least_s=MIN_RUN_S, settle=RUN_PASSAGES / 2)


def _bench_table(rows: Sequence[BenchRow], model: str | None) -> str:
    """Table of the benchmark's runs as text, with differences from the bundled model if another `model` is given."""
    columns = {title: key for title, key in BENCH_COLUMNS.items() if model or not key.startswith("bundled_")}
    return text_rows([dict.fromkeys(BENCH_COLUMNS.values()) | row for row in rows], columns)


def _bench_text(rows: Sequence[BenchRow], model: str | None) -> str:
    """Text of the benchmark: table of runs, cost of the model in units of the default solver's, reasons of failures."""
    own = [row for row in rows if model and row["model"] == model]
    ratio = "{series} takes {cpu_ratio:.3g} times ({cpu_ratio_range[0]:.3g} to {cpu_ratio_range[1]:.3g}) the CPU of "
    ratio += f"{DEFAULT} at the same step, 1/{{steps_per_s}} s."
    ratios = [ratio.format(**row) for row in own if row.get("cpu_ratio")]
    reasons = {f"{row['series']}: {row['status']}, {row['reason']}" for row in own if not row["ok"]}
    return "\n".join([_bench_table(rows, model), "", *ratios, *sorted(reasons)]).rstrip()
