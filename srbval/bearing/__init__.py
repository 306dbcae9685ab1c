"""Bearings: geometry, faults and their kinematic orders, the bearings known by name."""

from srbval.bearing.catalogue import (
    DEFAULT_BEARING,
    INLINE,
    LARGEST_SLIP,
    Bearing,
    bearing_from_table,
    fault_frequencies,
    find_bearings,
    known_bearings,
    load_bearing,
    with_slip,
)
from srbval.bearing.geometry import CIRCLES, SphericalRollerGeometry
from srbval.bearing.kinematics import (
    DEFECTS,
    RACE_DEFECTS,
    ElementShape,
    Fault,
    FaultFrequencies,
    FaultOrders,
    RollingElements,
)
