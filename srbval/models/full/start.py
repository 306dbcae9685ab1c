"""Velocities a run starts with: cage and rollers rolling without slip; and the state without any load balance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from srbval.models.full.motion_kernel import external_load, shaft_motion
from srbval.models.full.parameters import Parameters


def rolling_speeds(model: Parameters) -> tuple[float, float]:
    """Cage speed and roller spin of pure rolling at the middle circle [rad/s].

    Cage speed (1 - d cos(alpha) / D) / 2 of the shaft (Randall 2011, sect. 2.2.3) and the spin that brings the
    outer contact to rest, at time zero.
    """
    pitch_radius = model.centre_distance * model.tilt_cosine
    shaft = shaft_motion(0.0, model.drive)[0]
    cage = shaft / 2 * (1 - model.law.roller_radius * model.tilt_cosine / pitch_radius)
    return cage, -cage * pitch_radius / model.law.roller_radius


def rolling_state(model: Parameters) -> NDArray[np.float64]:
    """State of pure rolling at the middle circle, all slides zero, shape [4 M + 12].

    The ring stands where the housing spring alone would carry the load. Not an equilibrium: what remains dies out
    in the scene's settling time; see `equilibrium.py` for one.
    """
    n = len(model.roller_angle)
    d = 2 * n + 6
    y = np.zeros(2 * d)
    y[d + 2 * n + 2], y[d + n : d + 2 * n] = rolling_speeds(model)
    if model.housing_stiffness > 0:
        radial, axial = external_load(0.0, model.drive)
        push = (radial * model.drive.direction_cosine, radial * model.drive.direction_sine, axial)
        y[2 * n + 3 : 2 * n + 6] = np.array(push) / model.housing_stiffness
    return y
