"""The converged runs of the map."""

import math
from dataclasses import dataclass
from typing import Any

from srbval.models.health import default_solver
from srbval.studies.outcomes import MEASURED, RunOutcome
from srbval.studies.stability.grid import StabilityCase, StabilityGrid, StabilityGroup


@dataclass(frozen=True, kw_only=True)
class StabilityReference:
    """A converged run and the one at twice its step; `flagged`: one of the two found something wrong with itself."""

    group: StabilityGroup
    solver: str
    steps_per_s: int
    fine: RunOutcome
    coarse: RunOutcome

    @property
    def flagged(self) -> bool:
        """False alarm of the run's own detectors, or no reference after all."""
        return not (self.fine.ok and self.coarse.ok)

    @property
    def own_cage_error(self) -> float:
        """How far the cage speed at twice the step is off, relative."""
        return abs(self.coarse.cage_ratio / self.fine.cage_ratio - 1)

    @property
    def own_load_error(self) -> float:
        """How far the rollers' load at twice the step is off, relative."""
        return abs(self.coarse.load_share / self.fine.load_share - 1)

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        worse = self.coarse if self.fine.ok else self.fine
        return {
            **vars(self.group),
            "solver": self.solver,
            "dt_s": 1 / self.steps_per_s,
            "status": worse.status,
            "reason": worse.reason,
            **{name: getattr(self.fine, name) for name in MEASURED},
            "own_cage_error": self.own_cage_error,
            "own_load_error": self.own_load_error,
        }


def reference_cases(grid: StabilityGrid) -> dict[StabilityGroup, tuple[StabilityCase, StabilityCase]]:
    """For each part of the map the reference and the run at twice its step."""
    fine = grid.reference_steps_per_s

    def case(group: StabilityGroup, steps: int) -> StabilityCase:
        return StabilityCase(group=group, solver=default_solver(), steps_per_s=steps)

    return {group: (case(group, fine), case(group, fine // 2)) for group in grid.groups}


def relative(value: float, reference: float) -> float:
    """`value` over `reference`; NaN where one of them is missing."""
    return value / reference if reference and math.isfinite(reference) else math.nan
