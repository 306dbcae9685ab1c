"""A model from outside beside the bundled solvers: cost, errors of the step, and the largest step that is stable.

A step's errors are those against the same model's run at a finer step. A row is `ok`, or a cell `stable`, if its run
works and these errors are within `LIMITS`.
"""

import itertools
import math
import statistics
from argparse import Namespace
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import pandas as pd

from srbval.models.health import default_solver
from srbval.models.outside.names import solvers_of
from srbval.models.outside.run import OWN_SOLVER
from srbval.models.run import works
from srbval.models.solvers import SOLVERS
from srbval.plan.measures import measure
from srbval.processes.machine import load_average, this_machine
from srbval.progress import Progress, stage
from srbval.progress.tables import text_rows
from srbval.scene import Scene
from srbval.studies.harness import StudyResult
from srbval.sweep.pool import Attempt, attempt
from srbval.sweep.scenes import bench_scene, lasting_passages
from srbval.sweep.sweep import Case, bisect, grid, records, sweep

LIMITS = {"cage_error": 1e-3, "band_rms_error": 0.05}  # a rig's record of some seconds resolves as much
SCENES, RPM = ("interference-outer",), (355.0, 710.0, 1500.0, 3000.0)
STEPS_PER_S, TIMED_S, COMPARED_S = (40960, 61440, 122880), 0.2, 1.0  # simulated in a run that is timed, or compared
QUICK_STEPS_PER_S, QUICK_TIMED_S, QUICK_COMPARED_S = (61440,), 0.05, 0.3
PAIRS = 2  # of timed runs, after one that does not count
STABILITY_STEPS_PER_S = (245760, 122880, 81920, 61440, 40960, 30720, 20480, 10240)
PASSAGES, LEAST_S = 4.0, 0.25  # roller passages in a run of the stability map, half as many before it; least duration
USUAL = ("", default_solver())  # model and solver of the rows that others are compared with; "": the scene's own model
COST = ("wall_per_simulated_s", "cpu_per_simulated_s")
SHOWN = {"1/dt [Hz]": "steps_per_s", "CPU [s/s]": "cpu_per_simulated_s", "error: cage": "cage_error"}
SHOWN |= {"RMS [dB]": "band_rms_error_db", "from bundled [dB]": "bundled_band_rms_error_db", "status": "status"}
SHOWN = {name: name for name in ("scene", "model", "solver")} | SHOWN | {"ok": "ok"}
Row = dict[str, Any]


def bench(options: Namespace, progress: Progress) -> StudyResult:
    """Cost and errors of `options.model`, and of the bundled solvers at the same steps; failed runs are rows too.

    `cpu_ratio`: median cost in that of the default solver at the same step, timed in turns, with its range. Errors
    named ``bundled_`` are differences from the bundled model's converged run.
    """
    scenes, own = options.scenes or SCENES, [(options.model, name) for name in _solvers(options)]
    full = STEPS_PER_S, TIMED_S, COMPARED_S
    steps, timed_s, compared_s = (QUICK_STEPS_PER_S, QUICK_TIMED_S, QUICK_COMPARED_S) if options.quick else full
    with stage(progress, "a first short run, from which the time of all follows"):
        probes = {row["model"]: attempt(_scene(row, timed_s)) for row in _cases(scenes[:1], [own[0], USUAL], steps[:1])}
    failed = None if probes[options.model].works else probes[options.model]
    models = [] if failed else own

    def whole(case: Case) -> Scene:
        return _scene(case, compared_s)

    def in_turns(case: Case) -> tuple[Scene, ...]:
        usual = {**case, "model": USUAL[0], "solver": USUAL[1]}
        return (whole(case), *(1 + PAIRS) * (_scene(usual, timed_s), _scene(case, timed_s)))

    cases = _cases(scenes, [*models, *((USUAL[0], name) for name in (USUAL[1:] if options.quick else SOLVERS))], steps)
    fine = _cases(scenes, [*models, USUAL], (2 * max(steps),))
    step_s = {name: one.run.cpu_per_simulated_s / steps[0] for name, one in probes.items() if one.run is not None}
    planned_s = sum(
        step_s[row["model"]] * row["steps_per_s"] * simulated_s
        for rows, simulated_s in ((fine, compared_s), (cases, compared_s + (1 + PAIRS) * timed_s))
        for row in rows
    )
    load, task, turns = load_average(), f"converged runs (about {planned_s:.0f} s until all is done)", "runs in turns"
    how: Row = {"jobs": 1, "progress": progress}
    progress(task, None)
    right = sweep(pd.DataFrame(fine), whole, measures, task=task, **how)
    progress(turns, None)
    found = sweep(pd.DataFrame(cases), in_turns, measures, task=turns, **how)
    references = {(row["scene"], row["model"], row["solver"]): row for row in records(right)}
    rows = [_compared(row, references) for row in records(found)]
    if failed:
        rows += [row | {"status": failed.status, "reason": failed.reason} for row in _cases(scenes, own, steps)]
    rows = with_fronts(rows)
    machine = this_machine() | {"load_before": load, "load_after": load_average()}
    content = {"machine": machine, "seconds_planned": planned_s, "reference": records(right), "runs": rows}
    return StudyResult(content=content, text=_bench_text(rows, options.model))


def stability(options: Namespace, progress: Progress) -> StudyResult:
    """Largest stable step of `options.model` by speed and solver, found by bisection."""
    rpm, how = options.rpm or (RPM[1:2] if options.quick else RPM), {"jobs": options.jobs, "progress": progress}
    groups = grid(scene=list(options.scenes or SCENES), solver=list(_solvers(options)), rpm=list(rpm))
    groups, steps = groups.assign(model=options.model), pd.Series(STABILITY_STEPS_PER_S, name="steps_per_s")

    def passing(case: Case) -> Scene:
        return lasting_passages(_scene(case, LEAST_S), PASSAGES, least_s=LEAST_S, settle=PASSAGES / 2)

    fine = sweep(groups.assign(steps_per_s=2 * steps[0]), passing, measures, task="converged runs", **how)
    right = {(row["scene"], row["solver"], row["rpm"]): row for row in records(fine)}

    def judged(cell: Case) -> Row:
        own = {**cell, **errors(cell, right[cell["scene"], cell["solver"], cell["rpm"]])}
        return own | {"stable": is_ok(own), "predicted_limit_dt_s": None}

    lines, cells = bisect(groups, steps, passing, measures, lambda cell: judged(cell)["stable"], **how)
    found = [judged(cell) for cell in records(cells)]
    note = "" if lines["bounded"].all() else "\n\nThe longest step is stable: does the model use scene.solver.step_s?"
    columns = {"scene": "scene", "solver": "solver", "rpm": "rpm", "steps per s": "steps_per_s"}
    text = f"Largest stable step (-: none that was tried):\n\n{text_rows(records(lines), columns)}{note}"
    limits = records(lines.assign(largest_stable_dt_s=1 / lines["steps_per_s"], predicted_limit_dt_s=None))
    return StudyResult(content={"tolerances": LIMITS, "limits": limits, "cells": found}, text=text)


def measures(_: Case, own: Attempt, *pairs: Attempt) -> Row:
    """Measures of a run that works, None if it does not; its cost by `pairs`, the usual run and the row's in turns."""
    found: Row = {"dt_s": own.scene.solver.step_s} | dict.fromkeys(("cage_ratio", "noise_floor", "band_rms_m_s2"))
    found |= dict.fromkeys((*COST, "cpu_ratio", "cpu_ratio_range")) if pairs else {}
    if own.run is None or not own.works:
        return found
    found |= {name: value if value and math.isfinite(value) else None for name, value in vars(measure(own.run)).items()}
    runs = [one.run for one in pairs[2:] if one.run is not None and one.run.samples == one.scene.samples]
    if runs and len(runs) == len(pairs) - 2:
        ratios = [theirs.cpu_s / usual.cpu_s for usual, theirs in zip(runs[::2], runs[1::2], strict=True)]
        found |= {name: min(getattr(run, name) for run in runs[1::2]) for name in COST}
        found |= {"cpu_ratio": statistics.median(ratios), "cpu_ratio_range": [min(ratios), max(ratios)]}
    return found


def errors(own: Mapping[str, Any], right: Mapping[str, Any]) -> Row:
    """Relative errors in cage speed and band RMS without sign, and that of the RMS in dB; None where unknown."""
    cage, band = (own[n] / right[n] if own[n] and right[n] else None for n in ("cage_ratio", "band_rms_m_s2"))
    off = {"cage_error": cage, "band_rms_error": band}
    found = {name: None if ratio is None else abs(ratio - 1) for name, ratio in off.items()}
    return found | {"band_rms_error_db": None if band is None else 20 * math.log10(band)}


def is_ok(row: Mapping[str, Any]) -> bool:
    """True if the run works and the errors of its step are within `LIMITS`; a model without a cage has the level's."""
    known = {name: row[name] for name in LIMITS if row[name] is not None}
    return works(row["status"]) and bool(known) and all(known[name] <= LIMITS[name] for name in known)


def with_fronts(rows: Sequence[Row]) -> list[Row]:
    """The rows with `pareto`: ok, and no other ok row of its scene is as cheap and as near, by the band's RMS."""
    good = [(row, row["cpu_per_simulated_s"], row["band_rms_error"]) for row in rows if row.get("ok")]
    beaten = [
        one
        for (one, cost, error), (other, less, nearer) in itertools.permutations(good, 2)
        if one["scene"] == other["scene"] and less <= cost and nearer <= error and (less, nearer) != (cost, error)
    ]
    return [row | {"pareto": bool(row.get("ok")) and row not in beaten} for row in rows]


def _compared(row: Row, references: Mapping[tuple[str, str, str], Row]) -> Row:
    """The row with its errors against its own converged run, and its differences from the bundled model's."""
    usual = references[row["scene"], *USUAL]
    own = row | errors(row, references.get((row["scene"], row["model"], row["solver"]), usual))
    away = {f"bundled_{name}": value for name, value in errors(row, usual).items()}
    return own | away | {"ok": is_ok(own)}


def _solvers(options: Namespace) -> tuple[str, ...]:
    return tuple(options.solvers or solvers_of(options.model) or (OWN_SOLVER,))


def _cases(scenes: Iterable[str], models: Iterable[tuple[str, str]], steps_per_s: Iterable[int]) -> list[Row]:
    """Every combination, as rows."""
    names = ("scene", "model", "solver", "steps_per_s")
    return [dict(zip(names, (a, *b, c), strict=True)) for a, b, c in itertools.product(scenes, models, steps_per_s)]


def _scene(case: Case, seconds: float) -> Scene:
    """The scene of a row, a quarter of its duration before it to settle."""
    step_s, rpm = 1 / case["steps_per_s"], case.get("rpm")
    usual = bench_scene(case["scene"], solver=USUAL[1], step_s=step_s, seconds=seconds, settle_s=seconds / 4, rpm=rpm)
    solver = replace(usual.solver, name=str(case["solver"]))
    return replace(usual, model=case["model"] or usual.model, solver=solver)


def _bench_text(rows: Sequence[Row], model: str) -> str:
    """All rows of the model, those on the fronts, and the ratio of cost to the default solver's."""
    shown = [row for row in rows if row["model"] == model or row["pareto"] or (row["model"], row["solver"]) == USUAL]
    named = [dict.fromkeys(SHOWN.values()) | row | {"model": row["model"] or "bundled"} for row in shown]
    ratios = [
        f"{model} ({row['solver']}) takes {row['cpu_ratio']:.3g} times ({low:.3g} to {high:.3g}) the CPU of "
        f"{USUAL[1]} at the same step, 1/{row['steps_per_s']} s."
        for row in rows
        if row["model"] == model and row.get("cpu_ratio")
        for low, high in [row["cpu_ratio_range"]]
    ]
    failed = [row for row in rows if row["model"] == model and not works(row["status"])]
    reasons = {f"{model} ({row['solver']}): {row['status']}, {row['reason']}" for row in failed}
    return "\n".join([text_rows(named, SHOWN), "", *ratios, *sorted(reasons)])
