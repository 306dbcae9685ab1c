"""A bearing as the rest of the program sees it: a name, fault orders and, where known, its geometry."""

from __future__ import annotations

from dataclasses import dataclass

from srbval.bearing.geometry import SphericalRollerGeometry
from srbval.bearing.kinematics import FaultOrders


@dataclass(frozen=True, kw_only=True)
class Bearing:
    """A rolling bearing.

    `rolling_elements` counts one row. `geometry` is there only for bearings the bundled model can
    simulate; the orders of the others come from their dimensions or from a published table, as `source` says.
    """

    name: str
    title: str
    source: str
    rolling_elements: int
    orders: FaultOrders
    geometry: SphericalRollerGeometry | None = None
