"""Constants of the contact law, as the kernels read them."""

from __future__ import annotations

from typing import NamedTuple


class ContactLaw(NamedTuple):
    """Shape of the rollers' profile and the constants of eqs (18) and (19). Numbers only."""

    profile_radius: float  # of the roller's profile arc [m]
    roller_radius: float  # at the roller's middle [m]
    stiffness: float
    damping: float
    smoothing: float
    static_friction: float
    dynamic_friction: float
    critical_velocity: float
    onset_s: float  # time over which a point's coming into contact is averaged, 0 for not at all
