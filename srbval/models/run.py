"""What a model leaves behind: signals on one time axis, how the run ended, what it cost."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from srbval.scene import Scene

FloatArray = NDArray[np.float64]


class RunStatus(enum.StrEnum):
    """How a run ended. Only `OK` may be read as a bearing's vibration."""

    OK = "ok"
    NOT_FINITE = "not-finite"
    TOO_DEEP = "too-deep"
    CAGE_LOST = "cage-lost"
    LOAD_LOST = "load-lost"


@dataclass(frozen=True, kw_only=True, eq=False)
class Run:
    """A simulated run. One row per output interval, after the scene's settling time.

    `acceleration_m_s2` outer ring, shape [n, 3], the change of velocity over the interval (so anti-aliased
    by its mean); `displacement_m` outer ring, [n, 3]; `cage_rad_s` mean cage speed, [n]; `cage_tilt_rad`
    about x and y, [n, 2]; `roller_force_n` force of the rollers on the outer ring, interval mean, [n, 3];
    `depth_m` deepest penetration into an undamaged raceway, [n].
    """

    scene: Scene
    rolling_elements: int
    status: RunStatus
    reason: str
    acceleration_m_s2: FloatArray
    displacement_m: FloatArray
    cage_rad_s: FloatArray
    cage_tilt_rad: FloatArray
    roller_force_n: FloatArray
    depth_m: FloatArray
    wall_s: float
    compile_s: float

    @property
    def seconds(self) -> float:
        """Recorded duration [s]."""
        return len(self.cage_rad_s) / self.scene.output_rate_hz

    @property
    def cage_ratio(self) -> float:
        """Mean cage speed over shaft speed."""
        return float(np.mean(self.cage_rad_s)) / self.scene.shaft_speed_rad_s

    @property
    def bpfo_hz(self) -> float:
        """Outer-race line from the mean cage speed, Z f_cage [Hz]."""
        return self.rolling_elements * self.cage_ratio * self.scene.shaft_hz

    @property
    def bpfi_hz(self) -> float:
        """Inner-race line from the mean cage speed, Z (f_shaft - f_cage) [Hz]."""
        return self.rolling_elements * (1 - self.cage_ratio) * self.scene.shaft_hz

    @property
    def roller_load_share(self) -> float:
        """Part of the radial load that the rollers carry; the housing spring carries the rest."""
        load = self.scene.load
        if load.radial_n == 0:
            return math.nan
        direction = np.array([math.cos(load.direction_rad), math.sin(load.direction_rad), 0.0])
        return float(-np.mean(self.roller_force_n, axis=0) @ direction) / load.radial_n
