"""Bearings: geometry, localized faults, kinematic orders of these faults, and a catalogue of bearings by name."""

from srbval.bearing.catalogue import (
    DEFAULT_BEARING,
    LARGEST_SLIP,
    Bearing,
    bearing_from_table,
    fault_frequencies,
    find_bearings,
    known_bearings,
    load_bearing,
)
from srbval.bearing.geometry import CIRCLES, SphericalRollerGeometry
from srbval.bearing.kinematics import DEFECTS, RACE_DEFECTS, ElementShape, Fault, FaultOrders, RollingElements
