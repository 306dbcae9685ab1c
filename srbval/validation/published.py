"""The paper's Table 6 as data."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from srbval.config.strict import build, read_toml


@dataclass(frozen=True, kw_only=True)
class PrintedRow:
    """One row of Table 6: frequencies [Hz] and deviations as printed [%]."""

    defect: str
    line: str
    kinematic_hz: float
    model_hz: float
    model_printed_pct: float
    rig_hz: float
    rig_printed_pct: float


@dataclass(frozen=True, kw_only=True)
class Table6:
    """Table 6 with the speed and load it was taken at."""

    table: str
    shaft_rpm: float
    motor_rpm: int
    radial_kn: float
    row: tuple[PrintedRow, ...]

    def of(self, defect: str) -> PrintedRow:
        """The row of a defect (``outer`` or ``inner``)."""
        return next(row for row in self.row if row.defect == defect)


def table6() -> Table6:
    """The paper's Table 6."""
    path = Path(str(resources.files("srbval.validation") / "paper" / "table6.toml"))
    return build(Table6, read_toml(path), "table6.toml")
