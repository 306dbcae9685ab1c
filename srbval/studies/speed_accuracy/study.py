"""Speed against accuracy of the solvers: for each run its computing time, status, and error against a converged run."""

import math
from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from srbval.models.health import default_solver
from srbval.models.run import works
from srbval.models.simulate import Step
from srbval.models.solvers import METHODS, SOLVERS
from srbval.plan.measures import measure
from srbval.processes.machine import load_average, this_machine, usable_cores
from srbval.progress import Progress, silent
from srbval.progress.tables import text_rows
from srbval.scene import Scene, load_scene
from srbval.studies.harness import StudyResult
from srbval.sweep.pool import Attempt
from srbval.sweep.scenes import PAPER, base_of, bench_scene, check_names
from srbval.sweep.sweep import Case, grid, records, sweep

SCENES = ("interference-outer", "play0-outer", "play0-healthy", "rig-outer")
# Time of an evaluation of the equations of motion [s], an explicit and an implicit one; for the planned time alone.
EVALUATION_S = {"full": (2.7e-6, 5.3e-6), "slices": (7.3e-6, 9.4e-6)}
CHECK_S = 0.75  # simulated seconds by which estimating the step's error lengthens a run
Row = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Steps per second, simulated seconds and `repeats` of the runs: `timed_s` for CPU time, `compared_s` for errors.

    Solvers run with `steps_per_s`, reference runs with `converged` steps per second, multiples of the output rate.
    """

    steps_per_s: tuple[int, ...] = (40960, 61440, 122880)
    converged: int = 491520
    timed_s: float = 0.3
    repeats: int = 2
    compared_s: float = 4.0
    settle_s: float = 0.25


QUICK = Settings(steps_per_s=(61440,), converged=245760, timed_s=0.05, repeats=1, compared_s=0.5, settle_s=0.1)


def run_bench(
    *,
    scenes: Sequence[str] = SCENES,
    solvers: Sequence[str] = SOLVERS,
    settings: Settings = Settings(),
    jobs: int | None = None,
    progress: Progress = silent,
) -> Row:
    """Time `solvers` on `scenes` one run at a time, then compare each run with the converged run of its scene.

    Timing needs an otherwise idle machine. A failed run is listed with its status. Raises `ConfigurationError` for an
    unknown scene or solver.
    """
    check_names(scenes, solvers)
    cases = grid(scene=list(scenes), solver=list(solvers), steps_per_s=list(settings.steps_per_s))
    converged = grid(scene=list(scenes), solver=[default_solver()], steps_per_s=[settings.converged])
    planned = seconds_planned(cases, settings, jobs) + seconds_planned(converged, replace(settings, repeats=0), jobs)

    def compared(case: Case) -> Scene:
        return _scene(case, settings.compared_s, settings.settle_s)

    def timed(case: Case) -> tuple[Scene, ...]:
        return (_scene(case, settings.timed_s, settings.timed_s / 4),) * (1 + settings.repeats)

    def pair(case: Case) -> tuple[Scene, Scene]:
        return compared(case), compared({**case, "steps_per_s": settings.converged // 2})

    load = load_average()
    first = f"time the solvers (about {planned:.0f} s until all is done, compiling aside)"
    costs = sweep(cases, timed, cost, task=first, stored=False, jobs=1, progress=progress)
    machine = this_machine() | {"load_before": load, "load_after": load_average()}
    right = sweep(converged, pair, reference, task="converged runs", jobs=jobs, progress=progress)
    runs = sweep(cases, compared, measures, task="runs to compare", step=Step.CHECKED, jobs=jobs, progress=progress)
    references = {row["scene"]: row for row in records(right)}
    rows = records(runs.drop(columns="steps_per_s").join(costs[["wall_per_simulated_s", "cpu_per_simulated_s"]]))
    return {
        "machine": machine, "seconds_planned": planned, "paper": vars(PAPER), "reference": references,
        "runs": with_fronts([with_errors(row, references[row["scene"]]) for row in rows]),
    }  # fmt: skip


def _scene(case: Case, seconds: float, settle_s: float) -> Scene:
    step_s = 1 / case["steps_per_s"]
    return bench_scene(case["scene"], solver=str(case["solver"]), step_s=step_s, seconds=seconds, settle_s=settle_s)


def seconds_planned(cases: pd.DataFrame, settings: Settings, jobs: int | None) -> float:
    """Expected wall time of all runs in `cases` [s], without compiling."""
    compared_s = (settings.compared_s + settings.settle_s + CHECK_S) / (jobs or usable_cores())
    timed_s = settings.timed_s * 1.25 * (settings.repeats + 1 if settings.repeats else 0)
    total = 0.0
    for case in cases.to_dict("records"):
        method, model = METHODS[case["solver"]], load_scene(base_of(case["scene"])).model
        per_s = EVALUATION_S[model][method.implicit] * method.evaluations * case["steps_per_s"]
        total += per_s * (timed_s + compared_s)
    return total


def cost(_: Case, *tries: Attempt) -> Row:
    """Least wall and CPU time per simulated second of `tries` after the first, a warm-up; None if all ended early."""
    done = [tried.run for tried in tries[1:] if tried.run is not None]
    whole = [run for run in done if run.samples == run.scene.samples]
    return {
        "wall_per_simulated_s": min((run.wall_per_simulated_s for run in whole), default=None),
        "cpu_per_simulated_s": min((run.cpu_per_simulated_s for run in whole), default=None),
    }


def measures(_: Case, tried: Attempt) -> Row:
    """Cage ratio, noise floor and band RMS of a complete run; None for an incomplete run."""
    found: Row = {"model": tried.scene.model, "dt_s": tried.scene.solver.step_s}
    names = ("cage_ratio", "noise_floor", "band_rms_m_s2")
    if tried.run is None or not tried.measurable:
        return found | dict.fromkeys(names)
    own = measure(tried.run)
    return found | {name: getattr(own, name) for name in names}


def reference(case: Case, fine: Attempt, coarse: Attempt) -> Row:
    """Quantities of the converged run `fine`, and errors ``own_...`` of the run `coarse`, which has twice the step."""
    found, other = measures(case, fine), measures(case, coarse)
    return found | {f"own_{name}": value for name, value in errors(other, found).items()}


def errors(own: Mapping[str, Any], right: Mapping[str, Any]) -> Row:
    """Errors of cage speed and band RMS (also in dB) of the run `own` relative to the run `right`; None if unknown."""
    cage, band = (
        own[name] / right[name] if own[name] and right[name] else None for name in ("cage_ratio", "band_rms_m_s2")
    )
    return {
        "cage_error": None if cage is None else abs(cage - 1),
        "band_rms_error": None if band is None else abs(band - 1),
        "band_rms_error_db": None if band is None else 20 * math.log10(band),
    }


def with_errors(row: Row, right: Mapping[str, Any]) -> Row:
    """Add to a run its errors against the converged run `right`, and `ok`: true if `srbval simulate` accepts the run.

    `mark` is "the default" if the run has the scene's default solver and step, "the paper's" if it has the paper's
    solver and step. `reference_limited` is true if its error of cage speed is below the converged run's own error.
    """
    found, own = errors(row, right), right["own_cage_error"]
    default = load_scene(base_of(row["scene"])).solver
    marks = {"the default": (default.name, default.step_s), "the paper's": (PAPER.solver, PAPER.step_s)}
    return row | found | {
        "ok": works(row["status"]),
        "reference_limited": None not in (found["cage_error"], own) and found["cage_error"] < own,
        "mark": next((mark for mark, (solver, step_s) in marks.items()
                      if row["solver"] == solver and math.isclose(row["dt_s"], step_s, rel_tol=1e-6)), ""),
    }  # fmt: skip


def with_fronts(rows: Sequence[Row]) -> list[Row]:
    """Add `pareto` to the runs: true if no accepted run of the same scene beats it in CPU time and cage-speed error."""
    keys = ("cpu_per_simulated_s", "cage_error")
    good = [row for row in rows if row["ok"] and all(row[key] is not None for key in keys)]

    def beats(one: Row, row: Row) -> bool:
        alike = one["scene"] == row["scene"] and all(one[key] <= row[key] for key in keys)
        return alike and any(one[key] < row[key] for key in keys)

    return [row | {"pareto": row in good and not any(beats(one, row) for one in good)} for row in rows]


def answer_text(result: Mapping[str, Any]) -> str:
    """Text of the result: best runs, runs with the default and the paper's settings, number of accepted runs."""
    runs, paper = result["runs"], result["paper"]
    shown = [row for row in runs if row["pareto"] or row["mark"]]
    columns = {"scene": "scene", "solver": "solver", "1/dt [Hz]": "steps_per_s", "CPU [s/s]": "cpu_per_simulated_s",
               "cage error": "cage_error", "500-1500 Hz RMS error [dB]": "band_rms_error_db",
               "noise floor": "noise_floor", "status": "status", "": "mark"}  # fmt: skip
    table = text_rows([row | {"steps_per_s": round(1 / row["dt_s"])} for row in shown], columns)
    days = paper["wall_s"] / paper["simulated_s"]
    return "\n".join([
        "Runs that no other one beats in cost and cage error, the default and the paper's:", "", table, "",
        f"{sum(row['ok'] for row in runs)} of {len(runs)} runs work, as `srbval simulate` judges them.",
        f"The paper: {days:.0f} s per simulated second ({paper['solver']} at 1/{1 / paper['step_s']:.0f} s).",
    ])  # fmt: skip


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Benchmark the solvers; a partial or quick benchmark is stored only if the user names a file."""
    given = {name: tuple(own) for name in ("scenes", "solvers") if (own := getattr(options, name))}
    small: Row = {"scenes": (SCENES[0], SCENES[-1]), "settings": QUICK} if options.quick else {}
    found = run_bench(**small | given, jobs=options.jobs, progress=progress)
    return StudyResult(name=None if given or small else "speed_accuracy", content=found, text=answer_text(found))
