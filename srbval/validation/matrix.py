"""The validation matrix: every registered record of the rig, one cell an operating point of Table 5.

A record that is registered is a cell, and a cell of a fault is a comparison of every quantity: nothing else lists them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from srbval.bearing import Fault
from srbval.recordings.datasets.description import Grid, dataset
from srbval.recordings.registry.verbs import RIG_DATASETS
from srbval.validation.analyse import Analysis
from srbval.validation.fault_call import FaultCall
from srbval.validation.model_side import ModelSide
from srbval.validation.quantity_comparison import QuantityComparison

# Verdicts of cells that hold no comparison.
NOT_DETECTED, BASELINE = "line not detected", "baseline"

Point = tuple[Fault, float, float, float]  # state, radial kN, axial kN, nominal motor rpm


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One record [kN, rpm, Hz, %], the line of its state, the model's beside it, and what may be said.

    `deviation_pct` is the rig's from kinematics at the measured speed; `comparisons` hold every quantity of the fault
    that both sides show, and `error_pct`, `uncertainty_pct` and `verdict` are the line frequency's of them; `model_hz`
    is None where the cell is no fault's or the model's run failed (`remark` says why). `call` is the fault call against
    the healthy record of the same point.
    """

    state: Fault
    radial_kn: float
    axial_kn: float
    nominal_rpm: float
    file: str
    shaft_rpm: float
    speed_ci95_rpm: float
    speed_source: str
    line: str
    kinematic_hz: float
    rig_hz: float | None
    rig_ci95_hz: float | None
    snr: float | None
    depth: float | None
    detected: bool
    deviation_pct: float | None
    deviation_ci95_pct: float | None
    model_hz: float | None
    error_pct: float | None
    uncertainty_pct: float | None
    verdict: str
    call: FaultCall
    comparisons: tuple[QuantityComparison, ...] = ()
    remark: str = ""

    @property
    def point(self) -> Point:
        """State, radial and axial load [kN], nominal motor speed [rpm]."""
        return self.state, self.radial_kn, self.axial_kn, self.nominal_rpm

    def to_dict(self) -> dict[str, Any]:
        """Plain values for ``report.json``."""
        compared = [row.to_dict() for row in self.comparisons]
        told = {"state": self.state.value, "call": self.call.to_dict(), "comparisons": compared}
        return dataclasses.asdict(self) | told


@dataclass(frozen=True, kw_only=True, eq=False)
class Sides:
    """Both sides of a cell in full, for figures; the model's is the reason where its run failed."""

    rig: Analysis
    model: ModelSide | str


@dataclass(frozen=True, kw_only=True)
class Matrix:
    """The cells there are data for, on the grid of Table 5; `unusable` are records with the reason.

    `kept` are the sides of the cells that were asked for: a full grid of them would not fit into memory.
    """

    grid: Grid
    cells: tuple[Cell, ...] = ()
    unusable: tuple[tuple[str, str], ...] = ()
    kept: Mapping[Point, Sides] = field(default_factory=dict)

    def at(self, point: Point) -> Cell | None:
        """The cell of one operating point, None where nothing was measured."""
        return next((c for c in self.cells if c.point == point), None)

    @property
    def size(self) -> int:
        """Operating points of the grid."""
        return len(self.grid.states) * len(self.grid.radial_kn) * len(self.grid.nominal_rpm)


def rig_grid() -> Grid:
    """The grid of Table 5."""
    grid = dataset(RIG_DATASETS[0]).grid
    assert grid is not None, "a test holds the rig's description to its grid"
    return grid
