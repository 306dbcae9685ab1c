"""A roller's force on the ring, tabulated once a run: over the approach, and over a defect's place besides."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from srbval.models.planar.statics import Slot, raised_at
from srbval.scene import Defect

FloatArray = NDArray[np.float64]

DEEPEST_M = 2e-4  # approach of the rings that the tables reach; half of it is each race's
STEP_M = 2.5e-7  # between entries of the plain table; force is off by less than 1e-4 of a loaded roller's
DEFECT_STEP_M = 2e-6
PLACES = 64  # of a defect, from straight under the roller to out of its reach


@dataclass(frozen=True, kw_only=True, eq=False)
class Plain:
    """Undamaged roller: rows force [N], damper [Ns/m], depth [m] over ``start_m + i step_m``."""

    start_m: float
    step_m: float
    values: FloatArray

    def force_n(self, approach_m: FloatArray) -> FloatArray:
        """Force at each approach; the table's end beyond it."""
        grid = self.start_m + self.step_m * np.arange(self.values.shape[1])
        return np.interp(approach_m, grid, self.values[0])


@dataclass(frozen=True, kw_only=True, eq=False)
class Bump:
    """What a defect adds to a roller's force [N]: over ``start_m + i step_m`` of approach and ``k place_m`` of place.

    A place is the distance along the race from roller to defect, without sign: defects are symmetric.
    """

    start_m: float
    step_m: float
    place_m: float
    values: FloatArray

    @property
    def reach_m(self) -> float:
        """Where the defect is no longer felt."""
        return self.place_m * (self.values.shape[1] - 1)


def plain_table(slot: Slot, highest_m: float) -> Plain:
    """Undamaged roller, from clear of everything to `DEEPEST_M`."""
    start = -_free(slot, highest_m)
    approach = np.arange(start, DEEPEST_M, STEP_M)
    pressed = slot.press(approach)
    return Plain(start_m=start, step_m=STEP_M, values=np.array([pressed.force_n, pressed.damper_ns_m, pressed.depth_m]))


def bump_table(slot: Slot, plain: Plain, defect: Defect, *, race: int) -> Bump:
    """A defect on one race, or a roller's defect against it."""
    patch = (slot.outer, slot.inner)[race][defect.circle - 1]
    part = raised_at(defect, slot, np.zeros(1), race=race).part
    deepest = DEEPEST_M + max(0.0, defect.height_m)
    reach = math.sqrt(2 * deepest / patch.curvature_1_m) + part.length_m / 2
    place = np.linspace(0.0, reach, PLACES)
    approach = np.arange(plain.start_m, DEEPEST_M, DEFECT_STEP_M)
    pressed = slot.press(approach[:, None], [raised_at(defect, slot, place[None, :], race=race)])
    return Bump(
        start_m=plain.start_m,
        step_m=DEFECT_STEP_M,
        place_m=float(place[1]),
        values=pressed.force_n - plain.force_n(approach)[:, None],
    )


def _free(slot: Slot, highest_m: float) -> float:
    """Distance of the rings at which nothing touches, the highest bump included [m]."""
    squeezed = max(0.0, slot.outer_excess_m + slot.inner_excess_m)
    return 1.1 * (highest_m + squeezed) + 2e-4
