"""What pushes the bearing."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from srbval.config.strict import quantity
from srbval.scene.checks import not_negative


class LoadPath(enum.StrEnum):
    """What carries the external load: housing spring and rollers in parallel, or the rollers alone."""

    HOUSING = "housing"
    BEARING = "bearing"


@dataclass(frozen=True, kw_only=True)
class Load:
    """External force on the outer ring: `radial_n` along `direction_rad` in the x-y plane, `axial_n` along z.

    The load zone lies opposite to the direction of the force. `gravity` adds the weight of rollers, outer ring and
    housing mass, along -y; the paper does not mention it.
    """

    radial_n: float = quantity("force")
    axial_n: float = quantity("force")
    direction_rad: float = quantity("angle")
    path: LoadPath
    gravity: bool

    def __post_init__(self) -> None:
        not_negative(self, "radial_n")

    @property
    def zone_rad(self) -> float:
        """Angle of the middle of the load zone, from x towards y [rad]."""
        return self.direction_rad + math.pi
