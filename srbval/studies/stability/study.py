"""The complete stability map."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from srbval.bearing import load_bearing
from srbval.models.run import RunStatus
from srbval.processes.machine import load_average
from srbval.progress import Progress, silent
from srbval.scene import Scene
from srbval.storage.content_store import ContentStore
from srbval.studies.machine import Machine, calibrate, describe_machine
from srbval.studies.stability.cell import NO_REFERENCE, UNLIKE, Planted, StabilityCell, planted_in
from srbval.studies.stability.claims import Claim, claims
from srbval.studies.stability.grid import FULL, StabilityCase, StabilityGrid, StabilityGroup
from srbval.studies.stability.outcome import StabilityReference, outcome_store, outcomes, reference_cases
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

    def to_dict(self) -> dict[str, Any]:
        """What is written as JSON."""
        return {
            "machine": self.machine,
            "grid": self.grid,
            "counts": {
                "cells": len(self.cells),
                "ok": sum(cell.ok for cell in self.cells),
                "stable": sum(cell.stable for cell in self.cells),
                "inaccurate": sum(cell.status == RunStatus.INACCURATE.value for cell in self.cells),
                "caught_by_the_run": sum(not cell.outcome.ok for cell in self.cells),
                "seen_by_comparison_only": sum(cell.status in (UNLIKE, NO_REFERENCE) for cell in self.cells),
                "flagged_with_cage_and_load_right": sum(
                    not cell.outcome.ok and cell.like_reference for cell in self.cells
                ),
            },
            "claims": self.claims,
            "planted": self.planted,
            "references": self.references,
            "cells": self.cells,
        }


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
