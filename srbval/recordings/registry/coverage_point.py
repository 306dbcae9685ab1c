"""The grid of a data set's operating points (for the rig: the paper's Table 5) and what is there of it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from srbval.bearing import Fault


@dataclass(frozen=True, kw_only=True)
class GridPoint:
    """One operating point [kN, rpm] and the registered files that are there for it."""

    state: Fault
    radial_kn: float
    axial_kn: float
    nominal_rpm: float
    files: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """All points of one data set's grid."""

    dataset: str
    points: tuple[GridPoint, ...]

    @property
    def missing(self) -> tuple[GridPoint, ...]:
        """Points without a usable file."""
        return tuple(p for p in self.points if not p.files)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        points = [dataclasses.asdict(p) | {"files": list(p.files)} for p in self.points]
        return {"dataset": self.dataset, "points": points, "missing": len(self.missing)}
