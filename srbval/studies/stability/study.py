"""The complete stability map: every cell is a run, with its own status and what comparison with a converged run shows.

A cell is a mapping, as it is stored: the run's scene, speed, critical velocity, solver and step; its own `run_status`
and the `status` after comparison; `like_reference`, where cage and load are within their limits; `stable`, where it
stays with the converged run in cage and load although its energy may not close, nearest to what the paper calls stable
and not enough for ok, as friction may chatter; predicted step limits.
"""

import math
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any

from srbval.bearing import load_bearing
from srbval.models.health import LEAST_SHARE, default_solver
from srbval.models.run import USABLE, RunStatus
from srbval.progress import Progress, silent
from srbval.progress.tables import text_table
from srbval.scene import Scene
from srbval.storage.json_files import to_json
from srbval.studies.harness import StudyResult
from srbval.studies.machine import machine_before
from srbval.studies.outcomes import MEASURED, RunOutcome, outcomes
from srbval.studies.scenes import PAPER_STEP_S, RIG_SHOWN
from srbval.studies.stability.claims import claims
from srbval.studies.stability.grid import FULL, QUICK, RIG, StabilityCase, StabilityGrid, StabilityGroup
from srbval.studies.stability.step_limits import StepLimits, predict

CAGE_LIMIT = 0.01  # relative, from the converged run
# Part of the converged run's load that the rollers must carry, and may: below, load is lost; above, they bounce harder
# than they should. Rattling rollers make 1.06 of imex2 at its default step and 1500 rpm (4 s), a lost run makes 1.9 up.
LOAD_RANGE = (0.95, 1.1)
INACCURATE = RunStatus.INACCURATE.value  # cage and load are right, but an error is beyond its tolerance
UNLIKE = "unlike-reference"  # the run passed its own tests, the comparison did not
NO_REFERENCE = "no-reference"
WITHIN = tuple(status for status in USABLE if status != INACCURATE)  # the tolerances of `step_error`
# Silent failures, as solver and step over the paper's: all rollers end out of contact, acceleration zero, no NaN.
PLANTED = (("ode1", 2), ("ode1", 4), ("ode2", 4))
PLANTED_RPM = (710.0, 3000.0)
BORNE_OUT = {True: "borne out", False: "not borne out", None: "not covered"}
Row = dict[str, Any]


def run_stability(grid: StabilityGrid = FULL, *, jobs: int | None = None, progress: Progress = silent) -> Row:
    """Run every cell of `grid`, compare each with its converged run, predict each step limit; what is stored of it.

    `jobs` runs go at a time (default: one per usable core); each that has ended is stored, so that an
    interrupted map continues where it was. A failed run is a cell with its status. Raises
    `ConfigurationError` for an unknown scene or solver.
    """
    machine, limits = machine_before(), dict[StabilityGroup, dict[str, StepLimits]]()
    for number, group in enumerate(grid.groups):
        progress("step limits of linear theory", number / len(grid.groups))
        scene = grid.scene(StabilityCase(group, grid.solvers[0], grid.reference_steps_per_s))
        limits[group] = predict(scene, grid.solvers)
    progress("step limits of linear theory", 1.0)

    def run(cases: Sequence[StabilityCase], task: str) -> dict[StabilityCase, RunOutcome]:
        scenes = {case: grid.scene(case) for case in cases}
        return outcomes(scenes, task=task, jobs=jobs, progress=progress)

    steps = grid.reference_steps_per_s
    pairs = {group: [StabilityCase(group, default_solver(), n) for n in (steps, steps // 2)] for group in grid.groups}
    converged = run([case for pair in pairs.values() for case in pair], "converged runs")
    right = {group: (converged[fine], converged[coarse]) for group, (fine, coarse) in pairs.items()}
    cells = [
        cell(case, grid.scene(case), outcome, *right[case.group], limits[case.group][case.solver])
        for case, outcome in run(list(grid.cases), "runs of the map").items()
    ]
    return {
        "machine": machine(), "grid": grid, "counts": counts(cells), "claims": claims(cells),
        "planted": list(planted_in(cells)), "cells": cells,
        "references": [reference(pairs[group][0], *both) for group, both in right.items()],
    }  # fmt: skip


def reference(case: StabilityCase, fine: RunOutcome, coarse: RunOutcome) -> Row:
    """A converged run, and how far the one at twice its step is off; not ok where one of the two is not."""
    worse = coarse if fine.works else fine
    return {
        **case.group._asdict(), "solver": case.solver, "dt_s": 1 / case.steps_per_s, "status": worse.status,
        "reason": worse.reason, **{name: getattr(fine, name) for name in MEASURED},
        "own_cage_error": abs(coarse.cage_ratio / fine.cage_ratio - 1),
        "own_load_error": abs(coarse.load_share / fine.load_share - 1),
    }  # fmt: skip


def cell(
    case: StabilityCase, scene: Scene, own: RunOutcome, fine: RunOutcome, coarse: RunOutcome, limits: StepLimits
) -> Row:
    """A run of the map beside the converged one, `fine`, and that at twice its step, `coarse`.

    Not a number is unlike the converged run. Loads that are next to nothing are alike. `points_per_step`: points of the
    inner race that pass a roller in a step.
    """
    part = {name: _relative(getattr(own, name), getattr(fine, name)) for name in MEASURED}
    cage_error, load_part = abs(part["cage_ratio"] - 1), part["load_share"]
    idle = max(abs(own.load_share), abs(fine.load_share)) < LEAST_SHARE
    like = cage_error <= CAGE_LIMIT and (idle or LOAD_RANGE[0] <= load_part <= LOAD_RANGE[1])
    status, reason, beyond = own.status, own.reason, own.beyond(fine)
    if own.works and not (fine.works and coarse.works):
        status, reason = NO_REFERENCE, "the converged run to compare with failed"
    elif own.works and not like:
        status, reason = (
            UNLIKE,
            (
                f"the run's own tests passed, but its cage is {cage_error:.2%} off (limit {CAGE_LIMIT:.0%}) and its "
                f"rollers carry {load_part:.1%} of the converged run's load "
                f"(allowed: {LOAD_RANGE[0]:.0%} to {LOAD_RANGE[1]:.0%})"
            ),
        )
    elif own.works and beyond:
        status = INACCURATE
        reason = f"cage and load are right, but beyond the tolerance: {'; '.join(map(str, beyond))}"
    bearing = load_bearing(scene.bearing)
    passing_hz = bearing.orders.at(scene.shaft_hz).bpfi_hz / bearing.rolling_elements
    return {
        **case.group._asdict(), "solver": case.solver, "dt_s": 1 / case.steps_per_s, "model": scene.model,
        "status": status, "reason": reason, "like_reference": like,
        "stable": status in USABLE or (status == RunStatus.ENERGY_OPEN.value and like),
        "cage_error": cage_error, "load_part": load_part, "band_rms_part": part["band_rms_m_s2"],
        "points_per_step": scene.contact.points_per_circle * passing_hz * scene.solver.step_s,
        "predicted_limit_dt_s": limits.whole_s, "predicted_elastic_limit_dt_s": limits.elastic_s,
        "run_status": own.status, "energy_imbalance": own.energy_imbalance, "cage_ratio": own.cage_ratio,
        "load_share": own.load_share, "seconds": own.seconds, "wall_s": own.wall_s,
        "errors": {e.of: e.error for e in own.errors_against(fine)},
    }  # fmt: skip


def _relative(value: float, right: float) -> float:
    return value / right if right and math.isfinite(right) else math.nan


def planted_in(cells: Sequence[Row]) -> Iterator[Row]:
    """The planted failures among `cells`: `caught` where the run's own status is not usable."""
    for one in cells:
        times = one["dt_s"] / PAPER_STEP_S
        known = any(one["solver"] == solver and math.isclose(times, n, rel_tol=1e-6) for solver, n in PLANTED)
        if known and one["rpm"] in PLANTED_RPM:
            names = (*StabilityGroup._fields, "solver", "dt_s", "run_status")
            yield {name: one[name] for name in names} | {"caught": one["run_status"] not in USABLE}


def counts(cells: Sequence[Row]) -> dict[str, int]:
    """How many cells there are, and how many of each kind."""
    failed = [one for one in cells if one["run_status"] not in USABLE]
    return {
        "cells": len(cells),
        "ok": sum(one["status"] in WITHIN for one in cells),
        "stable": sum(one["stable"] for one in cells),
        "inaccurate": sum(one["status"] == INACCURATE for one in cells),
        "caught_by_the_run": len(failed),
        "seen_by_comparison_only": sum(one["status"] in (UNLIKE, NO_REFERENCE) for one in cells),
        "flagged_with_cage_and_load_right": sum(one["like_reference"] for one in failed),
    }


def _map(result: Mapping[str, Any]) -> str:
    """The status of every cell, speeds across."""
    grid, rows = result["grid"], []
    cells = sorted(result["cells"], key=lambda one: [str(value) for value in _block(one)])
    for block, found in groupby(cells, key=_block):
        of_block = list(found)
        for steps in grid["steps_per_s"]:
            line = {one["rpm"]: one["status"] for one in of_block if round(1 / one["dt_s"]) == steps}
            rows.append((*block, steps, *(line[rpm] for rpm in grid["rpm"]), _limit_text(of_block)))
    speeds = [f"{rpm:g} rpm" for rpm in grid["rpm"]]
    return text_table(("scene", "v_c [m/s]", "solver", "1/dt [Hz]", *speeds, "predicted limit [Hz]"), rows)


def _answer(result: Mapping[str, Any]) -> str:
    """How many cells are ok, by solver, then the planted failures and the claims."""
    numbers, cells = result["counts"], result["cells"]
    solvers = list(dict.fromkeys(one["solver"] for one in cells))
    ok = [f"{name} {sum(one['status'] == 'ok' for one in cells if one['solver'] == name)}" for name in solvers]
    caught = sum(one["caught"] for one in result["planted"])
    return "\n".join([
        f"ok by solver: {', '.join(ok)} of {len(cells) // len(solvers)} cells each",
        f"{numbers['ok']} of {numbers['cells']} cells are ok; {numbers['caught_by_the_run']} were caught by the runs "
        f"themselves, {numbers['seen_by_comparison_only']} only by comparison with the converged run;",
        f"{numbers['flagged_with_cage_and_load_right']} were flagged although cage speed and load are right.",
        f"planted failures caught by the runs themselves: {caught} of {len(result['planted'])}",
        f"converged runs flagged: {_flagged(result)} of {len(result['references'])}",
        *(f"{BORNE_OUT[one['borne_out']]}: {one['claim']}" for one in result["claims"]),
    ])  # fmt: skip


def _block(one: Row) -> tuple[str, float, str]:
    return one["scene"], one["critical_velocity_m_s"], one["solver"]


def _limit_text(cells: Sequence[Row]) -> str:
    """The smallest predicted limits of a solver, of the whole system and the elastic one, as divisors of a second."""
    limits = ([one[name] for one in cells] for name in ("predicted_limit_dt_s", "predicted_elastic_limit_dt_s"))
    least = (min((limit for limit in of if limit is not None), default=None) for of in limits)
    return ", elastic ".join("none" if limit is None else f"{1 / limit:.3g}" for limit in least)


def _flagged(result: Mapping[str, Any]) -> int:
    """False alarms of the runs' own detectors: converged runs that are not ok."""
    return sum(one["status"] not in USABLE for one in result["references"])


def grid_of(options: Namespace) -> StabilityGrid:
    """The grid that the options ask for."""
    names = ("critical_velocity_m_s", "scenes", "solvers", "rpm", "steps_per_s", "seconds")
    given = {name: value for name in names if (value := getattr(options, name)) is not None}
    given = {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}
    base = RIG if given.get("scenes") == RIG_SHOWN else FULL
    return replace(QUICK if options.quick else base, **given)


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Sound where all planted failures are caught and no converged run is flagged."""
    grid = grid_of(options)
    result = to_json(run_stability(grid, jobs=options.jobs, progress=progress))
    name, sound = {FULL: "stability", RIG: "rig_stability"}.get(grid), all(one["caught"] for one in result["planted"])
    return StudyResult(
        name=name, content=result, text=_answer(result), tables=_map(result), sound=sound and not _flagged(result)
    )
