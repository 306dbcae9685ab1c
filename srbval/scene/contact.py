"""Contact between raceway points and rollers, and how the rollers fit."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from srbval.config.strict import quantity
from srbval.errors import ConfigurationError
from srbval.scene.checks import not_negative, positive


class RollerFit(enum.StrEnum):
    """How the roller diameter is found: from the radial play, or as printed in Table 1."""

    PLAY = "play"
    PRINTED = "printed"


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Contact between one raceway point and one roller (paper, eqs 18 and 19, Table 4).

    `stiffness_n_m` and `damping_ns_m` are per point, so `points_per_circle` is part of the stiffness.
    `radial_play_m` is the gap between the raceways at a roller less the roller's diameter.
    """

    stiffness_n_m: float = quantity("stiffness")
    damping_ns_m: float = quantity("damping")
    smoothing_width_m: float = quantity("length")
    static_friction: float
    dynamic_friction: float
    critical_velocity_m_s: float = quantity("velocity")
    points_per_circle: int
    radial_play_m: float = quantity("length")
    roller_fit: RollerFit

    def __post_init__(self) -> None:
        positive(self, "stiffness_n_m", "smoothing_width_m", "critical_velocity_m_s")
        not_negative(self, "damping_ns_m", "dynamic_friction")
        if self.static_friction < self.dynamic_friction:
            raise ConfigurationError(
                f"static_friction = {self.static_friction} must not be below dynamic_friction = "
                f"{self.dynamic_friction}."
            )
        if not 60 <= self.points_per_circle <= 100_000:
            raise ConfigurationError(f"points_per_circle = {self.points_per_circle} must be between 60 and 100000.")
