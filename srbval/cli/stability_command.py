"""``srbval stability``: where each method of time integration fails."""

import argparse
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any

from srbval.cli.measured import measure_and_print
from srbval.cli.output import print_table
from srbval.storage.stored_result import OWN_VERDICTS, RIG_STABILITY, STABILITY
from srbval.storage.strict_json import json_object
from srbval.studies.run_verdicts.study import OwnVerdicts, judge_own_verdicts
from srbval.studies.scenes import PAPER_STEP_S, RIG_SHOWN
from srbval.studies.stability.grid import FULL, QUICK, StabilityGrid
from srbval.studies.stability.study import StabilityResult, run_stability

SOUND, UNSOUND = 0, 1
QUICK_SHARE = 1 / 40
RIG = replace(  # its default step among them; oil has its own critical velocity: no run reads this one
    FULL,
    scenes=RIG_SHOWN,
    critical_velocity_m_s=(0.1,),
    steps_per_s=tuple(sorted({*FULL.steps_per_s, 40960}, reverse=True)),
)


def run(options: argparse.Namespace) -> int:
    """Map and print; exit code 1 where a planted failure was missed or a converged run was flagged."""
    if options.verdicts:
        return _verdicts(options)
    grid = grid_of(options)
    result = measure_and_print(
        RIG_STABILITY if grid.scenes == RIG_SHOWN else STABILITY,
        options,
        lambda progress: run_stability(grid, jobs=options.jobs, progress=progress),
        complete=grid in (FULL, RIG),
        show=show,
    )
    return SOUND if result.sound else UNSOUND


def _verdicts(options: argparse.Namespace) -> int:
    share = QUICK_SHARE if options.quick else 1.0
    result = measure_and_print(
        OWN_VERDICTS,
        options,
        lambda progress: judge_own_verdicts(seed=options.seed, share=share, jobs=options.jobs, progress=progress),
        complete=not options.quick,
        show=_show_verdicts,
    )
    return SOUND if result.sound else UNSOUND


def _show_verdicts(result: OwnVerdicts) -> None:
    """Print the counts, and every run whose verdict is wrong."""
    print(
        ", ".join(f"{count} {status}" for status, count in Counter(run.own.status for run in result.runs).most_common())
    )
    counts = result.counts
    print(
        f"\n{counts['runs']} runs, seed {result.seed}: {counts['says_ok']} report ok without caution, "
        f"{counts['falsely_ok']} of them are wrong; {counts['falsely_failed']} report failure but agree with the "
        "converged run"
    )
    rows = [
        (run.case.condition.scene, f"{run.case.condition.rpm:g}", f"{run.case.condition.load:g}", run.case.solver,
         f"{1 / (PAPER_STEP_S * run.case.times):.0f}", run.own.status, "; ".join(map(str, run.own.beyond(run.right))))
        for run in result.runs
        if run.falsely_ok or run.falsely_failed
    ]  # fmt: skip
    if rows:
        print_table(("scene", "rpm", "load", "solver", "1/dt [Hz]", "status", "beyond tolerance"), rows)


def grid_of(options: argparse.Namespace) -> StabilityGrid:
    """The grid that the command line asks for."""
    names = {"critical_velocity_m_s": "critical_velocity"} | {
        name: name for name in ("scenes", "solvers", "rpm", "steps_per_s", "seconds")
    }
    values = {field: getattr(options, option) for field, option in names.items()}
    given: dict[str, Any] = {
        field: tuple(value) if isinstance(value, list) else value
        for field, value in values.items()
        if value is not None
    }
    base = RIG if given.get("scenes") == RIG_SHOWN else FULL
    return replace(QUICK if options.quick else base, **given)


def show(result: StabilityResult) -> None:
    """Print the map, the planted failures, and the claims."""
    document = json_object(result)
    key = ("scene", "critical_velocity_m_s", "solver")
    cells = sorted(document["cells"], key=lambda cell: [str(cell[name]) for name in key])
    speeds = [f"{rpm:g} rpm" for rpm in result.grid.rpm]
    rows = []
    for (scene, velocity, solver), of_solver in groupby(cells, key=lambda cell: [cell[name] for name in key]):
        block = list(of_solver)
        for steps in result.grid.steps_per_s:
            line = {c["rpm"]: c["status"] for c in block if round(1 / c["dt_s"]) == steps}
            rows.append((scene, velocity, solver, steps, *(line[rpm] for rpm in result.grid.rpm), _limit(block)))
    print_table(("scene", "v_c [m/s]", "solver", "1/dt [Hz]", *speeds, "predicted limit [Hz]"), rows)
    _show_rest(result, document["counts"])


def _show_rest(result: StabilityResult, counts: Mapping[str, Any]) -> None:
    print(
        f"\n{counts['ok']} of {counts['cells']} cells are ok; {counts['caught_by_the_run']} were caught by the runs "
        f"themselves, {counts['seen_by_comparison_only']} only by comparison with the converged run; "
        f"{counts['flagged_with_cage_and_load_right']} were flagged although cage speed and load are right."
    )
    caught = sum(p.caught for p in result.planted)
    flagged = sum(r.flagged for r in result.references)
    print(f"planted failures caught by the runs themselves: {caught} of {len(result.planted)}")
    print(f"converged runs flagged: {flagged} of {len(result.references)}")
    for claim in result.claims:
        print(f"\n{claim.claim}\n  {claim.answer}")
        print("\n".join(f"  - {line}" for line in claim.evidence))


def _limit(cells: Sequence[Mapping[str, Any]]) -> str:
    """The smallest predicted limits of a solver, of the whole system and the elastic one, as divisors of a second."""
    names = ("predicted_limit_dt_s", "predicted_elastic_limit_dt_s")
    least = (min((c[name] for c in cells if c[name] is not None), default=None) for name in names)
    return ", elastic ".join("none" if limit is None else f"{1 / limit:.3g}" for limit in least)
