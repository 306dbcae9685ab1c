"""A model from outside beside the bundled solvers: cost, errors of the step, and the largest step that is stable.

The errors of a row's step are those against the same model's run at a finer step. A row is `ok`, or a cell `stable`,
if its run works and these errors are within `LIMITS`; a run that works beyond them is ``inaccurate``.
"""

import importlib
import itertools
import math
import statistics
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from srbval.errors import ConfigurationError
from srbval.models.health import default_solver
from srbval.models.jit import is_compiled, kernels_of
from srbval.models.outside.names import is_outside, solvers_of
from srbval.models.outside.run import OWN_SOLVER
from srbval.models.run import RunStatus, works
from srbval.models.simulate import compile_for
from srbval.models.solvers import METHODS, SOLVERS
from srbval.plan.measures import measure
from srbval.processes.machine import load_average, this_machine, usable_cores
from srbval.progress import Progress, silent, stage
from srbval.progress.tables import text_rows
from srbval.report.figures.style import Drawn, figure_style
from srbval.scene import Scene
from srbval.storage.stored_result import newest_result
from srbval.studies.harness import StudyResult
from srbval.sweep.pool import Attempt, attempt
from srbval.sweep.scenes import PAPER, bench_scene, check_names, lasting_passages
from srbval.sweep.sweep import Case, bisect, grid, records, sweep

LIMITS = {"line_error_pct": 0.1, "band_rms_error_db": 0.42}  # a rig's record of some seconds resolves as much
SCENES, RPM = ("interference-outer",), (355.0, 710.0, 1500.0, 3000.0)
STEPS_PER_S, TIMED_S, COMPARED_S = (40960, 61440, 122880), 0.2, 1.0  # simulated in a run that is timed, or compared
QUICK_STEPS_PER_S, QUICK_TIMED_S, QUICK_COMPARED_S = (61440,), 0.05, 0.3
PAIRS = 2  # of timed runs, after one that does not count
FINER_BUNDLED, FINER = 4, 2  # steps of a converged run for one of the finest step: of the bundled model, of others
# For the planned time alone: processor time to compile a kernel, and to evaluate a model's equations of motion.
COMPILE_S, EVALUATION_S = 15.0, {"full": 4e-6, "slices": 1e-5}
STABILITY_STEPS_PER_S = (245760, 122880, 81920, 61440, 40960, 30720, 20480, 10240)
PASSAGES, LEAST_S = 4.0, 0.25  # roller passages in a run of the stability map, half as many before it; least duration
USUAL = ("", default_solver())  # model and solver of the rows that others are compared with; "": the scene's own model
COST = ("wall_per_simulated_s", "cpu_per_simulated_s")
UNITS = {"line_error_pct": "% of the line", "band_rms_error_db": "dB of the level"}
SHOWN = {"1/dt [Hz]": "steps_per_s", "CPU [s/s]": "cpu_per_simulated_s", "line [%]": "line_error_pct"}
SHOWN |= {"level [dB]": "band_rms_error_db", "level, from bundled [dB]": "bundled_band_rms_error_db"}
SHOWN = {"scene": "scene", "solver": "series"} | SHOWN | {"status": "status"}
Row = dict[str, Any]
Message = Callable[[str], None]


def bench(
    model: str | None = None,
    *,
    scenes: Sequence[str] = SCENES,
    solvers: Sequence[str] = (),
    quick: bool = False,
    progress: Progress = silent,
    message: Message = lambda _: None,
) -> StudyResult:
    """Cost and errors of `model`, if there is one, and of the bundled solvers at the same steps.

    A failed run is a row with its status. `solvers` are the model's, or the bundled ones without a model. `message`
    gets the planned time before all, then each row as its runs end; what has ended is read if all is run again.
    `cpu_ratio`: median cost in that of the default solver at the same step, timed in turns, with its range. Errors
    named ``bundled_`` are differences from the bundled model's converged run.
    """
    full = STEPS_PER_S, TIMED_S, COMPARED_S
    steps, timed_s, compared_s = (QUICK_STEPS_PER_S, QUICK_TIMED_S, QUICK_COMPARED_S) if quick else full
    check_names(scenes, () if model else solvers)
    own = [(model, name) for name in _offered(model, solvers)] if model else []
    others = USUAL[1:] if model and quick else SOLVERS if model or not solvers else solvers
    bundled = sorted([(USUAL[0], name) for name in others], key=lambda one: one != USUAL)
    first = {one["solver"]: _probed(one, timed_s, progress) for one in _cases(scenes[:1], own, steps[:1])}
    models = [(name, solver) for name, solver in own if first[solver][0].works]
    cases = _cases(scenes, [*bundled[:1], *models, *bundled[1:]], steps)  # half of the kernels give the first points
    fine = [(USUAL, FINER_BUNDLED), *((one, FINER) for one in models)]
    converged = [row for one, finer in fine for row in _cases(scenes, [one], (finer * max(steps),))]

    def whole(case: Case) -> Scene:
        return _scene(case, compared_s)

    def in_turns(case: Case) -> tuple[Scene, ...]:
        usual = {**case, "model": USUAL[0], "solver": USUAL[1]}
        return (whole(case), *(1 + PAIRS) * (_scene(usual, timed_s), _scene(case, timed_s)))

    planned_s, compile_s = _planned([*map(whole, converged), *(one for row in cases for one in in_turns(row))], first)
    once = f", {compile_s:.0f} s of it to compile the solvers once" if compile_s else ""
    message(f"about {planned_s:.0f} s{once}; stop with Ctrl-C, and the same command goes on from there")
    columns = {title: key for title, key in SHOWN.items() if model or not key.startswith("bundled_")}
    load, rows, how = load_average(), list[Row](), dict[str, Any](jobs=1, progress=progress)
    right = records(sweep(pd.DataFrame(converged), whole, measures, task="converged runs", **how))
    references = {(row["scene"], row["model"], row["solver"]): row for row in right}
    early = len(scenes) * len(steps) * (1 + len(models))
    for part in (cases[:early], cases[early:]):
        compile_for(*map(whole, part), progress=progress)
        for case in part:
            task = f"{_series(case)} at 1/{case['steps_per_s']} s"
            (row,) = records(sweep(pd.DataFrame([case]), in_turns, measures, task=task, **how))
            rows.append(_compared(row, references))
            lines = text_rows(rows, columns).splitlines()
            message("\n".join(lines if len(rows) == 1 else lines[-1:]))
    for row in _cases(scenes, [one for one in own if one not in models], steps):
        tried = first[row["solver"]][0]
        rows.append(row | {"series": _series(row), "status": tried.status, "reason": tried.reason, "ok": False})
    rows = [row | {"pareto": on_front(row, rows)} for row in rows]
    machine = this_machine() | {"load_before": load, "load_after": load_average()}
    reference = {row["scene"]: row for row in right if (row["model"], row["solver"]) == USUAL}
    named = [row | {"model": row["model"] or _scene(row, timed_s).model} for row in rows]
    content = {"machine": machine, "seconds_planned": planned_s, "reference": reference, "runs": named}
    return StudyResult(content=content, text=_bench_text(rows, model, columns))


def stability(
    model: str,
    *,
    scenes: Sequence[str] = SCENES,
    solvers: Sequence[str] = (),
    rpm: Sequence[float] = (),
    quick: bool = False,
    **how: Any,
) -> StudyResult:
    """Largest stable step of `model` by speed and solver, found by bisection; `how`: `jobs` and `progress`."""
    check_names(scenes, ())
    rpm, offered = rpm or (RPM[1:2] if quick else RPM), _offered(model, solvers)
    groups = grid(scene=list(scenes), solver=list(offered), rpm=list(rpm)).assign(model=model)
    steps = pd.Series(STABILITY_STEPS_PER_S, name="steps_per_s")

    def passing(case: Case) -> Scene:
        return lasting_passages(_scene(case, LEAST_S), PASSAGES, least_s=LEAST_S, settle=PASSAGES / 2)

    fine = sweep(groups.assign(steps_per_s=FINER * steps[0]), passing, measures, task="converged runs", **how)
    right = {(row["scene"], row["solver"], row["rpm"]): row for row in records(fine)}

    def judged_cell(cell: Case) -> Row:
        own = judged(cell, right[cell["scene"], cell["solver"], cell["rpm"]])
        return own | {"stable": own["ok"], "predicted_limit_dt_s": None}

    lines, cells = bisect(groups, steps, passing, measures, lambda cell: judged_cell(cell)["stable"], **how)
    found = [judged_cell(cell) for cell in records(cells)]
    note = "" if lines["bounded"].all() else "\n\nThe longest step is stable: does the model use scene.solver.step_s?"
    columns = {"scene": "scene", "solver": "solver", "rpm": "rpm", "steps per s": "steps_per_s"}
    text = f"Largest stable step (-: none that was tried):\n\n{text_rows(records(lines), columns)}{note}"
    none = dict.fromkeys(("predicted_limit_dt_s", "predicted_elastic_limit_dt_s"))
    limits = records(lines.assign(largest_stable_dt_s=1 / lines["steps_per_s"]))
    limits = [row | none | {"series": _series(row)} for row in limits]
    return StudyResult(content={"tolerances": LIMITS, "limits": limits, "cells": found}, text=text)


def draw_study(name: str, content: Mapping[str, Any]) -> Drawn:
    """Chart or map of a study's content; a model's map shows the stored lines of the default and the paper's solver."""
    rows, stored = pd.DataFrame(content.get("runs") or content["limits"]), newest_result(name)
    if "limits" in content and "series" in rows and stored is not None:
        known = pd.DataFrame(stored.content["limits"])
        beside = known["scene"].isin(rows["scene"]) & known["solver"].isin((USUAL[1], PAPER.solver))
        rows = pd.concat([known[beside].assign(series=known["solver"]), rows], ignore_index=True)
    with figure_style():
        drawn: Drawn = importlib.import_module(f"srbval.studies.{name}.page").chart(rows)
        return drawn


def measures(_: Case, own: Attempt, *pairs: Attempt) -> Row:
    """Measures of a run that works, None if it does not; its cost by `pairs`, the usual run and the row's in turns."""
    found: Row = {"dt_s": own.scene.solver.step_s} | dict.fromkeys(("cage_ratio", "noise_floor", "band_rms_m_s2"))
    found |= dict.fromkeys((*COST, "cpu_ratio", "cpu_ratio_range")) if pairs else {}
    if own.run is None or not own.measurable:
        return found
    found |= {name: value if value and math.isfinite(value) else None for name, value in vars(measure(own.run)).items()}
    runs = [one.run for one in pairs[2:] if one.run is not None and one.run.samples == one.scene.samples]
    if runs and len(runs) == len(pairs) - 2:
        ratios = [theirs.cpu_s / usual.cpu_s for usual, theirs in zip(runs[::2], runs[1::2], strict=True)]
        found |= {name: min(getattr(run, name) for run in runs[1::2]) for name in COST}
        found |= {"cpu_ratio": statistics.median(ratios), "cpu_ratio_range": [min(ratios), max(ratios)]}
    return found


def errors(own: Mapping[str, Any], right: Mapping[str, Any]) -> Row:
    """Errors of the cage speed, also in per cent of BPFO, which follows it, and of the band's RMS; None if unknown."""
    cage, band = (own[n] / right[n] if own[n] and right[n] else None for n in ("cage_ratio", "band_rms_m_s2"))
    off = {"cage_error": cage, "band_rms_error": band}
    found: Row = {name: None if ratio is None else abs(ratio - 1) for name, ratio in off.items()}
    found["line_error_pct"] = None if cage is None else 100 * abs(cage - 1)
    return found | {"band_rms_error_db": None if band is None else 20 * math.log10(band)}


def on_front(row: Mapping[str, Any], rows: Sequence[Row]) -> bool:
    """True if the row is ok, and no other ok row of its scene is as cheap and as near, by the level."""
    keys = ("cpu_per_simulated_s", "band_rms_error")
    good = [tuple(one[key] for key in keys) for one in rows if one["ok"] and one["scene"] == row["scene"]]
    own = tuple(row.get(key) for key in keys)
    return own in good and not any(a <= own[0] and b <= own[1] for a, b in good if (a, b) != own)


def judged(row: Mapping[str, Any], right: Mapping[str, Any]) -> Row:
    """The row with the errors of its step and `ok`; ``inaccurate`` if they are beyond `LIMITS`, or all unknown."""
    off = errors(row, right)
    known = {name: abs(off[name]) for name in LIMITS if off[name] is not None}
    beyond = [f"{known[name]:.3g} {UNITS[name]}" for name in known if known[name] > LIMITS[name]]
    found = {**row, **off, "series": _series(row)}
    if works(row["status"]) and (beyond or not known):
        most = " and ".join(f"{limit} {UNITS[name]}" for name, limit in LIMITS.items())
        why = f"its step is wrong by {' and '.join(beyond)}" if beyond else "no converged run tells the step's error"
        found |= {"status": RunStatus.INACCURATE.value, "reason": f"{why}; accepted are {most}"}
    return found | {"ok": works(found["status"])}


def _compared(row: Row, references: Mapping[tuple[str, str, str], Row]) -> Row:
    """The row, judged by its own converged run, with its differences from the bundled model's."""
    usual = references[row["scene"], *USUAL]
    own = judged(row, references.get((row["scene"], row["model"], row["solver"]), usual))
    return own | {f"bundled_{name}": value for name, value in errors(row, usual).items()}


def _probed(row: Row, seconds: float, progress: Progress) -> tuple[Attempt, float]:
    """A first short run of a row, and the time that its process took to start [s].

    Raises `ConfigurationError` if it is refused, as for a wrong name or unit.
    """
    began = time.perf_counter()
    with stage(progress, f"a first short run of {_series(row)}, from which the time of all follows"):
        found = attempt(_scene(row, seconds))
    if found.run is None:
        raise ConfigurationError(found.reason)
    return found, time.perf_counter() - began - found.run.wall_s


def _planned(scenes: Sequence[Scene], first: Mapping[str, tuple[Attempt, float]]) -> tuple[float, float]:
    """Expected time of all runs with compiling, and of compiling alone [s]; `first`: short runs by solver."""
    bundled = [scene for scene in scenes if not is_outside(scene.model)]
    kernels = {kernel for scene in bundled if not is_compiled(scene) for kernel in kernels_of(scene)}
    compile_s = total_s = COMPILE_S * len(kernels) / min(usable_cores(), max(len(kernels), 1))
    for scene in scenes:
        name, whole_s = scene.solver.name, scene.settle_s + scene.duration_s
        if is_outside(scene.model):
            run, start_s = first[name][0].run, first[name][1]
            cost = 0.0 if run is None else run.cpu_per_simulated_s * run.scene.solver.step_s
            total_s += start_s + whole_s * cost / scene.solver.step_s
        else:
            cost = EVALUATION_S[scene.model] * METHODS[name].evaluations
            total_s += whole_s * cost / scene.solver.step_s
    return total_s, compile_s


def _offered(model: str, solvers: Sequence[str]) -> tuple[str, ...]:
    return tuple(solvers or solvers_of(model) or (OWN_SOLVER,))


def _series(row: Mapping[str, Any]) -> str:
    """Name of a row's model and solver in tables and charts."""
    return f"{Path(row['model']).name} {row['solver']}".strip()


def _cases(scenes: Iterable[str], models: Iterable[tuple[str, str]], steps_per_s: Iterable[int]) -> list[Row]:
    """Every combination, as rows."""
    names = ("scene", "model", "solver", "steps_per_s")
    found = itertools.product(models, scenes, steps_per_s)
    return [dict(zip(names, (scene, *one, steps), strict=True)) for one, scene, steps in found]


def _scene(case: Case, seconds: float) -> Scene:
    """The scene of a row, a quarter of its duration before it to settle."""
    step_s, rpm = 1 / case["steps_per_s"], case.get("rpm")
    usual = bench_scene(case["scene"], solver=USUAL[1], step_s=step_s, seconds=seconds, settle_s=seconds / 4, rpm=rpm)
    solver = replace(usual.solver, name=str(case["solver"]))
    return replace(usual, model=case["model"] or usual.model, solver=solver)


def _bench_text(rows: Sequence[Row], model: str | None, columns: Mapping[str, str]) -> str:
    """All rows, and of the model the ratio of cost to the default solver's and the reasons of its failures."""
    own = [row for row in rows if model and row["model"] == model]
    shown = [dict.fromkeys(SHOWN.values()) | row for row in rows]
    ratios = [
        f"{row['series']} takes {row['cpu_ratio']:.3g} times ({low:.3g} to {high:.3g}) the CPU of "
        f"{USUAL[1]} at the same step, 1/{row['steps_per_s']} s."
        for row in own
        if row.get("cpu_ratio")
        for low, high in [row["cpu_ratio_range"]]
    ]
    reasons = {f"{row['series']}: {row['status']}, {row['reason']}" for row in own if not row["ok"]}
    return "\n".join([text_rows(shown, columns), "", *ratios, *sorted(reasons)]).rstrip()
