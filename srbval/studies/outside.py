"""Benchmark of an external model: cost, step error and largest stable step, beside the bundled solvers.

The step error is the difference from a run of the same model at a finer step. A run is `ok` (in the search for the
largest step: `stable`) if it succeeds with errors within `ERROR_LIMITS`; with larger errors it is ``inaccurate``.
"""

import importlib
import math
import statistics
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from srbval.campaign.cases import cost_of
from srbval.comparison.comparison import Row
from srbval.errors import ConfigurationError
from srbval.models.health import default_solver
from srbval.models.jit import expected_compile_s
from srbval.models.outside.names import is_outside, solvers_of
from srbval.models.outside.run import OWN_SOLVER
from srbval.models.run import Run, RunStatus, works
from srbval.models.simulate import compile_for
from srbval.models.solvers import SOLVERS
from srbval.plan.measures import measure
from srbval.processes.machine import load_average, this_machine
from srbval.progress import Progress, silent, stage
from srbval.progress.tables import text_rows
from srbval.report.figures.style import PanelData, figure_style
from srbval.scene import Scene
from srbval.storage.stored_result import newest_result
from srbval.studies.harness import StudyResult
from srbval.sweep.pool import Attempt, attempt
from srbval.sweep.scenes import PAPER, bench_scene, check_names, lasting_passages
from srbval.sweep.sweep import Case, bisect, grid, records, sweep

ERROR_LIMITS = {"line_error_pct": 0.1, "band_rms_error_db": 0.42}  # what a rig's record of some seconds resolves
ERROR_UNITS = {"line_error_pct": "% of the line", "band_rms_error_db": "dB of the level"}
BENCH_SCENES, RPM = ("interference-outer",), (355.0, 710.0, 1500.0, 3000.0)
FULL_BENCH, QUICK_BENCH = ((40960, 61440, 122880), 0.2, 1.0), ((61440,), 0.05, 0.3)  # 1/step; timed, compared run [s]
TIMED_PAIRS = 2  # pairs of timed runs, after one that does not count
FINER_BUNDLED, FINER_STEPS = 4, 2  # steps of a converged run per step of the finest: bundled model, other model
STEPS_PER_S = (245760, 122880, 81920, 61440, 40960, 30720, 20480, 10240)  # of the stability map
RUN_PASSAGES, MIN_RUN_S = 4.0, 0.25  # roller passages in a run of the stability map, and its least duration
DEFAULT_SERIES = ("", default_solver())  # model and solver of the reference rows; "" is the scene's own model
MEASURED, COST = ("cage_ratio", "noise_floor", "band_rms_m_s2"), ("wall_per_simulated_s", "cpu_per_simulated_s")
BENCH_COLUMNS = {"1/dt [Hz]": "steps_per_s", "CPU [s/s]": "cpu_per_simulated_s", "line [%]": "line_error_pct"}
BENCH_COLUMNS |= {"level [dB]": "band_rms_error_db", "level, from bundled [dB]": "bundled_band_rms_error_db"}
BENCH_COLUMNS = {"scene": "scene", "solver": "series"} | BENCH_COLUMNS | {"status": "status"}


def bench(
    model: str | None = None,
    *,
    scenes: Sequence[str] = BENCH_SCENES,
    solvers: Sequence[str] = (),
    quick: bool = False,
    progress: Progress = silent,
    message: Callable[[str], None] = lambda _: None,
) -> StudyResult:
    """Measure cost and step errors of `model` (if given) and of the bundled solvers at the same steps.

    `solvers` selects solvers of the model or, if no model is given, bundled solvers. A failed run is listed with its
    status. `message` receives the expected time, then each row of the table. An interrupted command continues if it is
    given again. `cpu_ratio` is the CPU time divided by the default solver's at the same step, both timed alternately:
    the median, and the range. Errors named ``bundled_`` are differences from the bundled model's converged run.
    """
    steps, timed_s, compared_s = QUICK_BENCH if quick else FULL_BENCH
    check_names(scenes, () if model else solvers)
    own = [(model, name) for name in _solver_names(model, solvers)] if model else []
    others = DEFAULT_SERIES[1:] if model and quick else SOLVERS if model or not solvers else solvers
    bundled = sorted([(DEFAULT_SERIES[0], name) for name in others], key=lambda one: one != DEFAULT_SERIES)
    first = {one["solver"]: _run_probe(one, timed_s, progress) for one in _cases(scenes[:1], own, steps[:1])}
    models = [(name, solver) for name, solver in own if works(first[solver][0].status)]
    cases = _cases(scenes, [*bundled[:1], *models, *bundled[1:]], steps)
    fine = [(DEFAULT_SERIES, FINER_BUNDLED), *((one, FINER_STEPS) for one in models)]
    converged = [row for one, finer in fine for row in _cases(scenes, [one], (finer * max(steps),))]

    def whole(case: Case) -> Scene:
        return _scene(case, compared_s)

    def in_turns(case: Case) -> tuple[Scene, ...]:
        usual = {**case, "model": DEFAULT_SERIES[0], "solver": DEFAULT_SERIES[1]}
        return (whole(case), *(1 + TIMED_PAIRS) * (_scene(usual, timed_s), _scene(case, timed_s)))

    scenes_to_run = [*map(whole, converged), *(one for row in cases for one in in_turns(row))]
    planned_s, compile_s = _estimate_time(scenes_to_run, first)
    once = f", {compile_s:.0f} s of it to compile the solvers once" if compile_s else ""
    message(f"about {planned_s:.0f} s{once}; stop with Ctrl-C, and the same command continues from there")
    load, rows, how = load_average(), list[Row](), dict[str, Any](jobs=1, progress=progress)
    right = records(sweep(pd.DataFrame(converged), whole, measures, task="converged runs", **how))
    references = {(row["scene"], row["model"], row["solver"]): row for row in right}
    compile_for(*map(whole, cases), progress=progress)
    for case in cases:
        task = f"{_series(case)} at 1/{case['steps_per_s']} s"
        (row,) = records(sweep(pd.DataFrame([case]), in_turns, measures, task=task, **how))
        usual = references[row["scene"], *DEFAULT_SERIES]
        own_step = judge_step_error(row, references.get((row["scene"], row["model"], row["solver"]), usual))
        rows.append(own_step | {f"bundled_{name}": value for name, value in errors(row, usual).items()})
        lines = _bench_table(rows, model).splitlines()
        message("\n".join(lines if len(rows) == 1 else lines[-1:]))
    for row in _cases(scenes, [one for one in own if one not in models], steps):
        run, _ = first[row["solver"]]
        rows.append(row | {"series": _series(row), "status": run.status.value, "reason": run.reason, "ok": False})
    machine = this_machine() | {"load_before": load, "load_after": load_average()}
    rows = [row | {"pareto": on_front(row, rows)} for row in rows]
    reference = {row["scene"]: row for row in right if (row["model"], row["solver"]) == DEFAULT_SERIES}
    named = [row | {"model": row["model"] or _scene(row, timed_s).model} for row in rows]
    content = {"machine": machine, "seconds_planned": planned_s, "reference": reference, "runs": named}
    return StudyResult(content=content, text=_bench_text(rows, model))


def stability(
    model: str,
    *,
    scenes: Sequence[str] = BENCH_SCENES,
    solvers: Sequence[str] = (),
    rpm: Sequence[float] = (),
    quick: bool = False,
    **how: Any,
) -> StudyResult:
    """Find the largest stable step of `model` by bisection, by scene, solver and speed; `how`: `jobs`, `progress`."""
    check_names(scenes, ())
    axes = {"scene": list(scenes), "solver": _solver_names(model, solvers), "rpm": rpm or (RPM[1:2] if quick else RPM)}
    groups, steps = grid(**axes).assign(model=model), pd.Series(STEPS_PER_S, name="steps_per_s")

    def passing(case: Case) -> Scene:
        return lasting_passages(_scene(case, MIN_RUN_S), RUN_PASSAGES, least_s=MIN_RUN_S, settle=RUN_PASSAGES / 2)

    fine = sweep(groups.assign(steps_per_s=FINER_STEPS * steps[0]), passing, measures, task="converged runs", **how)
    right = {tuple(row[axis] for axis in axes): row for row in records(fine)}

    def judged_cell(cell: Case) -> Row:
        own = judge_step_error(cell, right[tuple(cell[axis] for axis in axes)])
        return own | {"stable": own["ok"], "predicted_limit_dt_s": None}

    lines, cells = bisect(groups, steps, passing, measures, lambda cell: judged_cell(cell)["stable"], **how)
    note = "" if lines["bounded"].all() else "\n\nThe longest step is stable: does the model use scene.solver.step_s?"
    shown = text_rows(records(lines), {axis: axis for axis in axes} | {"steps per s": "steps_per_s"})
    none = dict.fromkeys(("predicted_limit_dt_s", "predicted_elastic_limit_dt_s"))
    found = records(lines.assign(largest_stable_dt_s=1 / lines["steps_per_s"], **none))
    limits = [row | {"series": _series(row)} for row in found]
    content = {"tolerances": ERROR_LIMITS, "limits": limits, "cells": [judged_cell(cell) for cell in records(cells)]}
    return StudyResult(content=content, text=f"Largest stable step (-: no tried step is stable):\n\n{shown}{note}")


def draw_study(name: str, content: Mapping[str, Any]) -> PanelData:
    """Draw the chart of study `name` from `content`: a model's largest stable steps beside those of bundled solvers."""
    rows, stored = pd.DataFrame(content.get("runs") or content["limits"]), newest_result(name)
    if "limits" in content and "series" in rows and stored is not None:
        known = pd.DataFrame(stored.content["limits"])
        beside = known["scene"].isin(rows["scene"]) & known["solver"].isin((DEFAULT_SERIES[1], PAPER.solver))
        rows = pd.concat([known[beside].assign(series=known["solver"]), rows], ignore_index=True)
    with figure_style():
        drawn: PanelData = importlib.import_module(f"srbval.studies.{name}.page").chart(rows)
        return drawn


def measures(_: Case, own: Attempt, *pairs: Attempt) -> Row:
    """Quantities of the run `own`, None if it fails, and its cost from timed runs.

    `pairs` are timed runs, alternately of the default solver and of the solver of `own`; the first two do not count.
    """
    known = vars(measure(own.run)) if own.run is not None and own.measurable else {}
    found: Row = {"dt_s": own.scene.solver.step_s}
    found |= {name: value if (value := known.get(name)) and math.isfinite(value) else None for name in MEASURED}
    if not pairs:
        return found
    runs = [one.run for one in pairs[2:] if one.run is not None and one.run.samples == one.scene.samples]
    whole = bool(known) and len(runs) == len(pairs) - 2
    ratios = [row.cpu_s / usual.cpu_s for usual, row in zip(runs[::2], runs[1::2], strict=True)] if whole else []
    found |= {name: min(getattr(run, name) for run in runs[1::2]) if whole else None for name in COST}
    found["cpu_ratio"] = statistics.median(ratios) if ratios else None
    return found | {"cpu_ratio_range": [min(ratios), max(ratios)] if ratios else None}


def errors(own: Mapping[str, Any], right: Mapping[str, Any]) -> Row:
    """Errors of cage speed, BPFO [%] and band RMS [dB] of `own` relative to the finer run `right`; None if unknown."""
    cage, band = (own[n] / right[n] if own[n] and right[n] else math.nan for n in ("cage_ratio", "band_rms_m_s2"))
    found = {"cage_error": abs(cage - 1), "band_rms_error": abs(band - 1)}
    found |= {"line_error_pct": 100 * found["cage_error"], "band_rms_error_db": 20 * math.log10(band)}
    return {name: None if math.isnan(error) else error for name, error in found.items()}


def on_front(row: Mapping[str, Any], rows: Sequence[Row]) -> bool:
    """True if a run is ok and on the Pareto front of CPU time and band-RMS error, among the ok runs of its scene."""
    keys = ("cpu_per_simulated_s", "band_rms_error")
    good = [tuple(one[key] for key in keys) for one in rows if one["ok"] and one["scene"] == row["scene"]]
    own = tuple(row.get(key) for key in keys)
    return own in good and not any(a <= own[0] and b <= own[1] for a, b in good if (a, b) != own)


def judge_step_error(row: Mapping[str, Any], right: Mapping[str, Any]) -> Row:
    """Add to a run the step errors relative to the reference run `right`, a status that accounts for them, and `ok`."""
    off = errors(row, right)
    known = {name: abs(off[name]) for name in ERROR_LIMITS if off[name] is not None}
    beyond = " and ".join(f"{x:.3g} {ERROR_UNITS[name]}" for name, x in known.items() if x > ERROR_LIMITS[name])
    found = {**row, **off, "series": _series(row)}
    if works(row["status"]) and (beyond or not known):
        most = " and ".join(f"{limit} {ERROR_UNITS[name]}" for name, limit in ERROR_LIMITS.items())
        why = f"its step errors are {beyond}" if beyond else "the step's error is unknown without a converged run"
        found |= {"status": RunStatus.INACCURATE.value, "reason": f"{why}; accepted are at most {most}"}
    return found | {"ok": works(found["status"])}


def _run_probe(row: Row, seconds: float, progress: Progress) -> tuple[Run, float]:
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


def _solver_names(model: str, solvers: Sequence[str]) -> tuple[str, ...]:
    return tuple(solvers or solvers_of(model) or (OWN_SOLVER,))


def _series(row: Mapping[str, Any]) -> str:
    """Name of model and solver in tables and charts."""
    return f"{Path(row['model']).name} {row['solver']}".strip()


def _cases(scenes: Iterable[str], models: Iterable[tuple[str, str]], steps_per_s: Iterable[int]) -> list[Row]:
    """List the runs for every combination of scene, model with solver, and step."""
    found = records(grid(of=list(models), scene=list(scenes), steps_per_s=list(steps_per_s)))
    return [row | dict(zip(("model", "solver"), row.pop("of"), strict=True)) for row in found]


def _scene(case: Case, seconds: float) -> Scene:
    """Scene of a run; `seconds` are recorded, after a quarter of this time to settle."""
    about = {"step_s": 1 / case["steps_per_s"], "seconds": seconds, "settle_s": seconds / 4, "rpm": case.get("rpm")}
    usual = bench_scene(case["scene"], solver=DEFAULT_SERIES[1], **about)
    solver = replace(usual.solver, name=str(case["solver"]))
    return replace(usual, model=case["model"] or usual.model, solver=solver)


def _bench_table(rows: Sequence[Row], model: str | None) -> str:
    """Table of the benchmark's runs as text, with differences from the bundled model if another `model` is given."""
    columns = {title: key for title, key in BENCH_COLUMNS.items() if model or not key.startswith("bundled_")}
    return text_rows([dict.fromkeys(BENCH_COLUMNS.values()) | row for row in rows], columns)


def _bench_text(rows: Sequence[Row], model: str | None) -> str:
    """Text of the benchmark: table of runs, cost of the model in units of the default solver's, reasons of failures."""
    own = [row for row in rows if model and row["model"] == model]
    ratio = "{series} takes {cpu_ratio:.3g} times ({cpu_ratio_range[0]:.3g} to {cpu_ratio_range[1]:.3g}) the CPU of "
    ratio += f"{DEFAULT_SERIES[1]} at the same step, 1/{{steps_per_s}} s."
    ratios = [ratio.format(**row) for row in own if row.get("cpu_ratio")]
    reasons = {f"{row['series']}: {row['status']}, {row['reason']}" for row in own if not row["ok"]}
    return "\n".join([_bench_table(rows, model), "", *ratios, *sorted(reasons)]).rstrip()
