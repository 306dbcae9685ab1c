"""The converged run of each speed and critical velocity, and how converged it is."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

from srbval.bench.reference import reference_solver
from srbval.stability.grid import StabilityCase, StabilityGrid, StabilityGroup
from srbval.stability.outcome import StabilityOutcome


@dataclass(frozen=True, kw_only=True)
class StabilityReference:
    """A converged run and the one at twice its step; `flagged`: one of the two found something wrong with itself."""

    group: StabilityGroup
    solver: str
    steps_per_s: int
    fine: StabilityOutcome
    coarse: StabilityOutcome

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
            **asdict(self.group),
            "solver": self.solver,
            "dt_s": 1 / self.steps_per_s,
            "status": worse.status,
            "reason": worse.reason,
            "cage_ratio": self.fine.cage_ratio,
            "load_share": self.fine.load_share,
            "band_rms_m_s2": self.fine.band_rms_m_s2,
            "energy_imbalance": self.fine.energy_imbalance,
            "own_cage_error": self.own_cage_error,
            "own_load_error": self.own_load_error,
        }


def reference_cases(grid: StabilityGrid) -> dict[StabilityGroup, tuple[StabilityCase, StabilityCase]]:
    """For each part of the map the reference and the run at twice its step."""
    solver, steps = reference_solver(), grid.reference_steps_per_s
    return {
        group: (
            StabilityCase(group=group, solver=solver, steps_per_s=steps),
            StabilityCase(group=group, solver=solver, steps_per_s=steps // 2),
        )
        for group in grid.groups
    }


def reference_of(
    pair: tuple[StabilityCase, StabilityCase], found: dict[StabilityCase, StabilityOutcome]
) -> StabilityReference:
    """The reference that a pair of runs makes."""
    fine, coarse = pair
    return StabilityReference(
        group=fine.group, solver=fine.solver, steps_per_s=fine.steps_per_s, fine=found[fine], coarse=found[coarse]
    )


def relative(value: float, reference: float) -> float:
    """`value` over `reference`; NaN where one of them is missing."""
    return value / reference if reference and math.isfinite(reference) else math.nan
