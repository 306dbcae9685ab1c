"""Failures that are known to be silent and must be caught by the runs themselves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from srbval.bench.scenes import PAPER_STEP_S
from srbval.stability.cell import StabilityCell

# Solver and step over the paper's: every roller ends thrown clear, acceleration exactly zero, nothing is NaN.
PLANTED = (("ode1", 2), ("ode1", 4), ("ode2", 4))
PLANTED_RPM = (710.0, 3000.0)


@dataclass(frozen=True, kw_only=True)
class Planted:
    """A planted failure: caught where the run's own status is not ``ok``."""

    JSON_PROPERTIES: ClassVar = ("caught",)

    scene: str
    critical_velocity_m_s: float
    solver: str
    dt_s: float
    rpm: float
    run_status: str

    @property
    def caught(self) -> bool:
        """Did the run find it by itself?"""
        return self.run_status != "ok"


def planted_in(cells: Sequence[StabilityCell]) -> tuple[Planted, ...]:
    """The planted failures among `cells`."""
    return tuple(
        Planted(
            scene=cell.case.group.scene,
            critical_velocity_m_s=cell.case.group.critical_velocity_m_s,
            solver=cell.case.solver,
            dt_s=cell.case.step_s,
            rpm=cell.case.group.rpm,
            run_status=cell.outcome.status,
        )
        for cell in cells
        if _is_planted(cell)
    )


def _is_planted(cell: StabilityCell) -> bool:
    times = cell.case.step_s / PAPER_STEP_S
    known = any(cell.case.solver == solver and math.isclose(times, n, rel_tol=1e-6) for solver, n in PLANTED)
    return known and cell.case.group.rpm in PLANTED_RPM
