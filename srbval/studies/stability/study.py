"""The complete stability map."""

from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

from srbval.bearing import load_bearing
from srbval.models.run import RunStatus
from srbval.processes.machine import load_average
from srbval.progress import Progress, silent
from srbval.progress.tables import text_table
from srbval.scene import Scene
from srbval.storage.stored_result import ContentStore
from srbval.studies.harness import Study, StudyResult
from srbval.studies.machine import Machine, calibrate, describe_machine
from srbval.studies.outcomes import outcome_store, outcomes
from srbval.studies.scenes import RIG_SHOWN
from srbval.studies.stability.cell import NO_REFERENCE, UNLIKE, Planted, StabilityCell, planted_in
from srbval.studies.stability.claims import Claim, claims
from srbval.studies.stability.grid import FULL, QUICK, RIG, StabilityCase, StabilityGrid, StabilityGroup
from srbval.studies.stability.reference import StabilityReference, reference_cases
from srbval.studies.stability.step_limits import StepLimits, predict

PREDICTING, CONVERGING, MAPPING = "step limits of linear theory", "converged runs", "runs of the map"


@dataclass(frozen=True, kw_only=True)
class StabilityResult:
    """All results of a map; cells are ordered by scene, critical velocity, speed, solver, step."""

    machine: Machine
    grid: StabilityGrid
    references: tuple[StabilityReference, ...]
    cells: tuple[StabilityCell, ...]
    planted: tuple[Planted, ...]
    claims: tuple[Claim, ...]

    @property
    def sound(self) -> bool:
        """Are all planted failures detected and no converged run flagged?"""
        return all(p.caught for p in self.planted) and not any(r.flagged for r in self.references)

    @property
    def counts(self) -> dict[str, int]:
        """How many cells there are, and how many of each kind."""
        cells = self.cells
        return {
            "cells": len(cells),
            "ok": sum(cell.ok for cell in cells),
            "stable": sum(cell.stable for cell in cells),
            "inaccurate": sum(cell.status == RunStatus.INACCURATE.value for cell in cells),
            "caught_by_the_run": sum(not cell.outcome.ok for cell in cells),
            "seen_by_comparison_only": sum(cell.status in (UNLIKE, NO_REFERENCE) for cell in cells),
            "flagged_with_cage_and_load_right": sum(not c.outcome.ok and c.like_reference for c in cells),
        }

    def to_dict(self) -> dict[str, Any]:
        """What is written as JSON."""
        return vars(self) | {"counts": self.counts}


def run_stability(
    grid: StabilityGrid = FULL,
    *,
    store: ContentStore | None = None,
    jobs: int | None = None,
    progress: Progress = silent,
) -> StabilityResult:
    """Run every cell of `grid`, compare each with its converged run, predict each step limit.

    `jobs` runs go at a time (default: one per usable core); each that has ended is in the store, by default in the
    user's cache, so that an interrupted map continues where it was. A failed run is a cell with its status. Raises
    `ConfigurationError` for an unknown scene or solver.
    """
    load, calibration, store = load_average(), calibrate(), store or outcome_store()
    limits = _limits(grid, progress)
    pairs = reference_cases(grid)
    both = tuple(case for pair in pairs.values() for case in pair)
    converged = outcomes(_scenes(grid, both), task=CONVERGING, store=store, jobs=jobs, progress=progress)
    references = {
        group: StabilityReference(**vars(fine), fine=converged[fine], coarse=converged[coarse])
        for group, (fine, coarse) in pairs.items()
    }
    found = outcomes(_scenes(grid, grid.cases), task=MAPPING, store=store, jobs=jobs, progress=progress)
    cells = tuple(
        StabilityCell(
            case=case,
            model=grid.scene(case).model,
            outcome=found[case],
            reference=references[case.group],
            limits=limits[case.group][case.solver],
            points_per_step=_points_per_step(grid.scene(case)),
        )
        for case in grid.cases
    )
    return StabilityResult(
        machine=describe_machine(calibration, calibrate(), load),
        grid=grid,
        references=tuple(references.values()),
        cells=cells,
        planted=planted_in(cells),
        claims=claims(cells),
    )


def _scenes(grid: StabilityGrid, cases: Iterable[StabilityCase]) -> dict[StabilityCase, Scene]:
    return {case: grid.scene(case) for case in cases}


def _limits(grid: StabilityGrid, progress: Progress) -> dict[StabilityGroup, dict[str, StepLimits]]:
    groups, found = list(grid.groups), {}
    for number, group in enumerate(groups):
        progress(PREDICTING, number / len(groups))
        case = StabilityCase(group=group, solver=grid.solvers[0], steps_per_s=grid.reference_steps_per_s)
        found[group] = predict(grid.scene(case), grid.solvers)
    progress(PREDICTING, 1.0)
    return found


def _points_per_step(scene: Scene) -> float:
    bearing = load_bearing(scene.bearing)
    passing_hz = bearing.orders.at(scene.shaft_hz).bpfi_hz / bearing.rolling_elements
    return scene.contact.points_per_circle * passing_hz * scene.solver.step_s


def _text(result: StabilityResult) -> str:
    """The map, the planted failures, and the claims."""
    cells = sorted(result.cells, key=lambda cell: [str(value) for value in _block(cell)])
    rows = []
    for block, found in groupby(cells, key=_block):
        of_block = list(found)
        for steps in result.grid.steps_per_s:
            line = {cell.case.group.rpm: cell.status for cell in of_block if cell.case.steps_per_s == steps}
            rows.append((*block, steps, *(line[rpm] for rpm in result.grid.rpm), _limit_text(of_block)))
    speeds = [f"{rpm:g} rpm" for rpm in result.grid.rpm]
    table = text_table(("scene", "v_c [m/s]", "solver", "1/dt [Hz]", *speeds, "predicted limit [Hz]"), rows)
    counts = result.counts
    caught, flagged = sum(p.caught for p in result.planted), sum(r.flagged for r in result.references)
    return "\n".join([
        table,
        f"\n{counts['ok']} of {counts['cells']} cells are ok; {counts['caught_by_the_run']} were caught by the runs "
        f"themselves, {counts['seen_by_comparison_only']} only by comparison with the converged run; "
        f"{counts['flagged_with_cage_and_load_right']} were flagged although cage speed and load are right.",
        f"planted failures caught by the runs themselves: {caught} of {len(result.planted)}",
        f"converged runs flagged: {flagged} of {len(result.references)}",
        *("\n".join([f"\n{c.claim}\n  {c.answer}", *(f"  - {line}" for line in c.evidence)]) for c in result.claims),
    ])  # fmt: skip


def _block(cell: StabilityCell) -> tuple[str, float, str]:
    return cell.case.group.scene, cell.case.group.critical_velocity_m_s, cell.case.solver


def _limit_text(cells: Sequence[StabilityCell]) -> str:
    """The smallest predicted limits of a solver, of the whole system and the elastic one, as divisors of a second."""
    limits = ([c.limits.whole_s for c in cells], [c.limits.elastic_s for c in cells])
    least = (min((limit for limit in of if limit is not None), default=None) for of in limits)
    return ", elastic ".join("none" if limit is None else f"{1 / limit:.3g}" for limit in least)


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--quick", action="store_true", help="a small part of the map, short runs")
    parser.add_argument("--scenes", metavar="NAME", nargs="+", help="such as interference-outer (default: both outer)")
    parser.add_argument("--solvers", metavar="NAME", nargs="+", help="solvers, such as ode4 (default: all)")
    parser.add_argument("--rpm", metavar="R", nargs="+", type="positive", help="shaft speeds (default: 127 to 6000)")
    parser.add_argument(
        "--critical-velocity", metavar="V", nargs="+", type="positive", dest="critical_velocity_m_s",
        help="critical velocities of friction [m/s] (default: 0.001 0.5)",
    )  # fmt: skip
    parser.add_argument(
        "--steps-per-s", metavar="N", nargs="+", type="count",
        help="steps as divisors of a second (default: 245760 to 7680)",
    )  # fmt: skip
    parser.add_argument("--seconds", metavar="S", type="positive", help="minimum duration of a run")


def grid_of(options: Namespace) -> StabilityGrid:
    """The grid that the options ask for."""
    names = ("critical_velocity_m_s", "scenes", "solvers", "rpm", "steps_per_s", "seconds")
    given = {name: value for name in names if (value := getattr(options, name)) is not None}
    given = {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}
    base = RIG if given.get("scenes") == RIG_SHOWN else FULL
    return replace(QUICK if options.quick else base, **given)


def _run(options: Namespace, progress: Progress) -> StudyResult:
    grid = grid_of(options)
    result = run_stability(grid, jobs=options.jobs, progress=progress)
    name = {FULL: "stability", RIG: "rig_stability"}.get(grid)
    return StudyResult(name=name, content=result, text=_text(result), sound=result.sound)


STUDY = Study(
    question="Where does each solver fail, over step and speed, and where does linear theory predict it?",
    minutes=90, run=_run, options=_options,
)  # fmt: skip
