"""The validation matrix: every registered record of the rig, one cell per operating point of Table 5.

Every registered record fills a cell, and every cell of a fault compares every quantity; there is no other list.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from srbval.bearing import Fault
from srbval.recordings import ShaftSpeed
from srbval.recordings.datasets.description import OperatingGrid, dataset
from srbval.recordings.registry import RIG_DATASETS
from srbval.validation.analyse import Analysis
from srbval.validation.compared_quantities import FREQUENCY
from srbval.validation.comparison import Comparison, ComparisonVerdict
from srbval.validation.counterpart import AnalysedRun
from srbval.validation.fault_call import FaultCall
from srbval.validation.lines import Line, line_entry

# Verdicts of cells that hold no comparison.
NOT_DETECTED, BASELINE = "line not detected", "baseline"


class Point(NamedTuple):
    """An operating point of Table 5: state, loads [kN], nominal motor speed [rpm]."""

    state: Fault
    radial_kn: float
    axial_kn: float
    nominal_rpm: float


@dataclass(frozen=True, kw_only=True)
class MatrixCell:
    """One record [kN, rpm], its shaft speed, the line of its state, the model's, and what may be said.

    `comparisons` hold every quantity of the fault that both sides show; error, uncertainty and verdict of the cell are
    those of the line frequency. `model_hz` is the model's line at the same speed, None where the cell is no fault's or
    the model's run failed (`remark` says why). `call` is the fault call against the healthy record of the same point.
    """

    state: Fault
    radial_kn: float
    axial_kn: float
    nominal_rpm: float
    file: str
    speed: ShaftSpeed
    line: Line
    model_hz: float | None
    call: FaultCall
    comparisons: tuple[Comparison, ...] = ()
    remark: str = ""

    @property
    def point(self) -> Point:
        """The cell's place in the matrix."""
        return Point(self.state, self.radial_kn, self.axial_kn, self.nominal_rpm)

    @property
    def shaft_rpm(self) -> float:
        """Mean shaft speed [rpm]."""
        return 60 * self.speed.value_hz

    @property
    def frequency(self) -> Comparison | None:
        """The comparison of the line's frequency."""
        return next((row for row in self.comparisons if row.kind == FREQUENCY.name), None)

    @property
    def error_pct(self) -> float | None:
        """Its comparison error [%]."""
        return None if self.frequency is None else self.frequency.error

    @property
    def uncertainty_pct(self) -> float | None:
        """Its validation uncertainty [%]."""
        return None if self.frequency is None else self.frequency.uncertainty

    @property
    def verdict(self) -> str:
        """What may be said of the model at this point."""
        if not self.line.detected:
            return NOT_DETECTED
        if self.state is Fault.HEALTHY:
            return BASELINE
        return (ComparisonVerdict.INSUFFICIENT if self.frequency is None else self.frequency.verdict).value

    def to_dict(self) -> dict[str, Any]:
        """Plain values for ``report.json``; the deviation from kinematics is null where the line is not detected."""
        line = self.line
        entry = vars(self) | line_entry(line)
        del entry["speed"]
        return entry | {
            "shaft_rpm": self.shaft_rpm,
            "speed_ci95_rpm": 60 * self.speed.ci95_hz,
            "speed_source": self.speed.source,
            "rig_hz": line.found_hz,
            "rig_ci95_hz": line.ci95_hz,
            "deviation_pct": line.detected_deviation_pct,
            "deviation_ci95_pct": line.deviation_ci95_pct if line.detected else None,
            "error_pct": self.error_pct,
            "uncertainty_pct": self.uncertainty_pct,
            "verdict": self.verdict,
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class CellSides:
    """Both sides of a cell in full, for figures; the model's is the reason where its run failed."""

    rig: Analysis
    model: AnalysedRun | str


@dataclass(frozen=True, kw_only=True)
class Matrix:
    """The cells there are data for, on the grid of Table 5; `unusable` are records with the reason.

    `sides` are those of the cells that were asked for: those of a full grid would not fit into memory.
    """

    grid: OperatingGrid
    cells: tuple[MatrixCell, ...] = ()
    unusable: tuple[tuple[str, str], ...] = ()
    sides: Mapping[Point, CellSides] = field(default_factory=dict)

    def at(self, point: tuple[Fault, float, float, float]) -> MatrixCell | None:
        """The cell of one operating point, None where nothing was measured."""
        return next((c for c in self.cells if c.point == point), None)

    @property
    def size(self) -> int:
        """Operating points of the grid."""
        return len(self.grid.states) * len(self.grid.radial_kn) * len(self.grid.nominal_rpm)


def rig_grid() -> OperatingGrid:
    """The grid of Table 5."""
    grid = dataset(RIG_DATASETS[0]).grid
    assert grid is not None, "a test holds the rig's description to its grid"
    return grid
