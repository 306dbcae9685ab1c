"""Where a run starts: rollers rolling without slip, housing spring carrying the load."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from srbval.models.full.parameters import Parameters


def rolling_state(model: Parameters) -> NDArray[np.float64]:
    """State of pure rolling at the middle circle, all slides zero, shape [4 M + 12].

    Cage speed (1 - d cos(alpha) / D) / 2 of the shaft (Randall 2011, sect. 2.2.3) and the spin that brings the
    outer contact to rest. Not an equilibrium: what remains dies out in the scene's settling time.
    """
    n = len(model.roller_angle)
    d = 2 * n + 6
    pitch_radius = model.centre_distance * model.tilt_cosine
    cage = model.shaft_speed / 2 * (1 - model.roller_radius * model.tilt_cosine / pitch_radius)
    y = np.zeros(2 * d)
    y[d + n : d + 2 * n] = -cage * pitch_radius / model.roller_radius
    y[d + 2 * n + 2] = cage
    if model.housing_stiffness > 0:
        y[2 * n + 3 : 2 * n + 6] = model.force / model.housing_stiffness
    return y
