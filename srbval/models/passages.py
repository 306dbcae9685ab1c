"""When rolling elements pass a defect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import Fault
from srbval.models.prescribed import Prescribed
from srbval.scene import Defect

FloatArray = NDArray[np.float64]

GRID_S = 1e-3  # on which angles are inverted to times; between, speeds are taken as constant


@dataclass(frozen=True, kw_only=True, eq=False)
class Passages:
    """Passages of one defect: `time_s` of the run, rising, `race` that is hit (0 outer, 1 inner), both [k]."""

    time_s: FloatArray
    race: NDArray[np.int64]


def passages(
    defect: Defect,
    motion: Prescribed,
    rolling_elements: int,
    zone_rad: float,
    seconds: float,
    jitter: FloatArray | None = None,
) -> Passages:
    """All passages from 0 to `seconds`, a few before and after besides.

    `jitter`, [k] or longer: random parts of the spacings, relative to the mean one, added up one after the other: a
    process of stationary increments (Antoni & Randall 2003, J. Vib. Acoust. 125, 282), whose phase wanders off. None:
    strictly periodic in the shaft's angle.
    """
    grid = np.arange(-20 * GRID_S, seconds + 20 * GRID_S, GRID_S)
    phase = _phase(defect, motion, rolling_elements, zone_rad, grid)
    numbers = np.arange(np.ceil(phase[0]), np.floor(phase[-1]) + 1)
    wander = np.zeros(len(numbers)) if jitter is None else np.cumsum(jitter[: len(numbers)])
    time_s = np.interp(numbers + wander, phase, grid)
    if defect.kind is Fault.ROLLER:
        race = numbers.astype(np.int64) % 2
    else:
        race = np.full(len(numbers), int(defect.kind is Fault.INNER))
    return Passages(time_s=time_s, race=race)


def _phase(
    defect: Defect, motion: Prescribed, rolling_elements: int, zone_rad: float, time_s: FloatArray
) -> FloatArray:
    """Number of passages so far, rising; whole at each one. A roller's defect meets the outer race at even ones."""
    fixed = defect.angle_rad + zone_rad
    per_turn = rolling_elements / (2 * np.pi)
    if defect.kind is Fault.OUTER:
        return (motion.cage_rad(time_s) - fixed) * per_turn
    if defect.kind is Fault.INNER:
        return (fixed + motion.shaft_rad(time_s) - motion.cage_rad(time_s)) * per_turn
    return -(motion.spun_rad(time_s) + defect.angle_rad) / np.pi
