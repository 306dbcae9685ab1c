"""Localized defects: where, how high or deep, how wide, what shape."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from srbval.bearing import Fault
from srbval.config.strict import quantity
from srbval.errors import ConfigurationError


class DefectShape(enum.StrEnum):
    """Cross-section along the rolling direction: one height all over, or a raised cosine."""

    FLAT = "flat"
    COSINE = "cosine"


@dataclass(frozen=True, kw_only=True)
class Defect:
    """A localized defect on one circle of a raceway, or on one roller where that circle runs.

    Positive heights are bumps towards the other surface (the paper), negative ones pits. Without `extent_m` it is
    the paper's: `points` neighbouring points moved by `height_m`. With it, the defect is `extent_m` long in the
    rolling direction with the given `shape`, and the race's points there may be replaced by `refinement` times as
    many, each with that much less of the stiffness. `angle_rad` is that of the defect's middle at time zero: on a race
    from the middle of the load zone, on a roller from its slot's outward direction about its own axis. `row` is 1 (+z)
    or 2, `circle` 1 to 3, `roller` counts from 1 and matters for a roller's defect only.
    """

    kind: Fault
    points: int
    height_m: float = quantity("length")
    angle_rad: float = quantity("angle")
    row: int
    circle: int
    roller: int
    shape: DefectShape
    refinement: int
    extent_m: float | None = quantity("length", default=None)

    def __post_init__(self) -> None:
        limits = (("points", 1, 50), ("row", 1, 2), ("circle", 1, 3), ("refinement", 1, 50), ("roller", 1, 1000))
        for name, low, high in limits:
            value = getattr(self, name)
            if not low <= value <= high:
                raise ConfigurationError(f"defect {name} = {value} must be between {low} and {high}.")
        if not abs(self.height_m) <= 1e-3:
            raise ConfigurationError(f"defect height_m = {self.height_m} must lie within -1 mm and 1 mm.")
        if self.extent_m is not None and not 0 < self.extent_m <= 0.05:
            raise ConfigurationError(f"defect extent_m = {self.extent_m} must be above 0 and at most 50 mm.")
        if self.extent_m is None and (self.kind is Fault.ROLLER or self.refinement > 1):
            raise ConfigurationError(
                "a defect on a roller, or one with finer points, needs an extent, for example extent = '2 mm'."
            )
