"""Bearings: geometry, kinematic fault orders, the bearings known by name."""

from srbval.bearing.bearing import Bearing
from srbval.bearing.catalogue import DEFAULT_BEARING, known_bearings, load_bearing
from srbval.bearing.geometry import SphericalRollerGeometry
from srbval.bearing.kinematics import FaultFrequencies, FaultOrders

__all__ = [
    "DEFAULT_BEARING",
    "Bearing",
    "FaultFrequencies",
    "FaultOrders",
    "SphericalRollerGeometry",
    "known_bearings",
    "load_bearing",
]
