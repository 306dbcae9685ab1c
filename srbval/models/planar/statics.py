"""One roller between two races, without mass: force on the outer ring as a function of how near the rings are.

`approach` is how far the outer race has come towards the shaft at a roller's angle [m], in the bearing's radial
direction. The roller slides in its slot until both races press it alike. On a circle whose normal leans by b from the
slot and by a from the radial direction the outer race is penetrated by approach cos a + (slide + e_o) cos b, the
inner one by (e_i - slide) cos b, with e the roller's radius less the gap to the race; forces follow `line.Patch`.

The force is tabulated once per run: over the approach, and over the position of a defect besides.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.bearing import SphericalRollerGeometry
from srbval.models.full.parameters import roller_diameter_m
from srbval.models.line import Patch, Piece, patches, piece
from srbval.scene import Defect, Scene

BoolArray = NDArray[np.bool_]
NUDGE_M = 1e-9  # for the stiffness
SLIDE_M = 2e-3  # how far a roller may slide: twice the highest defect
HALVINGS = 40  # of the range in which an element is looked for: to 2e-15 m
DEEPEST_M = 2e-4  # approach of the rings that the tables reach; half of it is each race's
STEP_M = 2.5e-7  # between entries of the plain table; force is off by less than 1e-4 of a loaded roller's
DEFECT_STEP_M = 2e-6
POSITIONS = 64  # of a defect, from straight under the roller to out of its reach


class DefectHeight(NamedTuple):
    """A defect's piece on one circle of one race (0 outer, 1 inner), `middle_m` along it from the roller, any shape."""

    race: int
    circle: int
    part: Piece
    middle_m: FloatArray


class ElementContact(Protocol):
    """A rolling element between its races: `excess_m`, by how much it is thicker than the gap to each race."""

    @property
    def excess_m(self) -> tuple[float, float]:
        """Outer race first; both negative with play."""

    def press(self, approach_m: FloatArray, raised: Any = None) -> FloatArray:
        """Radial force on the outer ring [N], damper [N s/m], deepest penetration [m]: [3, ...]."""

    def on_race(self, defect: Defect, race: int, deepest_m: float) -> tuple[Callable[[FloatArray], Any], float, float]:
        """A defect on one race: what `press` takes for it at distances along the race, its reach, the race's radius.

        Distances from the element, reach and radius in m.
        """


@dataclass(frozen=True, kw_only=True)
class Slot:
    """A roller's contacts, outer race first: `patches` of each race, `excess_m` over the gap to each at rest."""

    patches: tuple[list[Patch], list[Patch]]
    excess_m: tuple[float, float]

    def on_race(
        self, defect: Defect, race: int, deepest_m: float
    ) -> tuple[Callable[[FloatArray], DefectHeight], float, float]:
        """See `ElementContact`."""
        circle = defect.circle - 1
        patch = self.patches[race][circle]
        part = piece(defect, patch.spacing_m)
        half_m = part.part_m * len(part.offset_m) / 2
        reach_m = math.sqrt(2 * (deepest_m + max(0.0, defect.height_m)) / patch.curvature_1_m) + half_m
        return (lambda middle: DefectHeight(race, circle, part, middle)), reach_m, patch.race_radius_m

    def press(self, approach_m: FloatArray, raised: DefectHeight | None = None) -> FloatArray:
        """Balance the roller at each `approach_m`, any shape; bisection, since more slide always presses outwards.

        Radial force on the outer ring [N], both races' dampers in series [N s/m], deepest penetration [m]: [3, ...].
        """
        shape = approach_m.shape if raised is None else np.broadcast_shapes(approach_m.shape, raised.middle_m.shape)
        slide = bisected(
            lambda s: self._side(0, approach_m, s, raised)[0] > self._side(1, approach_m, s, raised)[0],
            np.full(shape, -SLIDE_M), np.full(shape, SLIDE_M),
        )  # fmt: skip
        depth = np.maximum(self._depth(0, 1, approach_m, slide), self._depth(1, 1, approach_m, slide))
        return np.array([self._side(0, approach_m, slide, raised)[1], self._damper(approach_m, slide), depth])

    def _depth(self, race: int, circle: int, approach: FloatArray, slide: FloatArray) -> FloatArray:
        patch = self.patches[race][circle]
        lean = math.cos(patch.lean_rad)
        if race == 0:
            return approach * math.cos(patch.normal_rad) + (slide + self.excess_m[0]) * lean
        return (self.excess_m[1] - slide) * lean

    def _side(
        self, race: int, approach: FloatArray, slide: FloatArray, raised: DefectHeight | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Force of a race along the slot, and along the bearing's radius."""
        along, radial = np.zeros(slide.shape), np.zeros(slide.shape)
        for circle, patch in enumerate(self.patches[race]):
            depth = self._depth(race, circle, approach, slide)
            force = patch.force_n(depth)
            if raised is not None and (raised.race, raised.circle) == (race, circle):
                force = force + patch.raised_force_n(depth, raised.middle_m, raised.part)
            along += force * math.cos(patch.lean_rad)
            radial += force * math.cos(patch.normal_rad)
        return along, radial

    def _damper(self, approach: FloatArray, slide: FloatArray) -> FloatArray:
        """Both races' dampers in series with the split of motion that the stiffnesses make, radial."""
        stiffness, damper = [], []
        for race, sign in ((0, 1.0), (1, -1.0)):
            near, _ = self._side(race, approach, slide)
            far, _ = self._side(race, approach, slide + sign * NUDGE_M)
            stiffness.append((far - near) / NUDGE_M + 1.0)
            each = enumerate(self.patches[race])
            damper.append(sum(p.damper_ns_m(self._depth(race, i, approach, slide)) for i, p in each))
        whole = stiffness[0] + stiffness[1]
        return damper[0] * (stiffness[1] / whole) ** 2 + damper[1] * (stiffness[0] / whole) ** 2


def bisected(too_far: Callable[[FloatArray], BoolArray], low: FloatArray, high: FloatArray) -> FloatArray:
    """Where `too_far` begins between `low` and `high`, of any shape, by `HALVINGS` of the range."""
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        beyond = too_far(middle)
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return (low + high) / 2


def make_slot(scene: Scene, geometry: SphericalRollerGeometry) -> Slot:
    """The scene's roller between its races."""
    radius = roller_diameter_m(scene, geometry) / 2
    gap_outer = geometry.raceway_radius_m - geometry.roller_centre_distance_m
    gap_inner = geometry.zero_play_diameter_m - gap_outer
    outer, inner = (patches(geometry, scene.contact, radius, inner=inner) for inner in (False, True))
    return Slot(patches=(outer, inner), excess_m=(radius - gap_outer, radius - gap_inner))


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceTable:
    """Undamaged roller: rows force [N], damper [Ns/m], depth [m] over ``start_m + i step_m``, up to `deepest_m`.

    `bump_step_m`: step of the bumps' tables.
    """

    start_m: float
    step_m: float
    bump_step_m: float
    deepest_m: float
    values: FloatArray

    def at(self, approach_m: FloatArray) -> FloatArray:
        """The rows at each approach; the table's end beyond it."""
        grid = self.start_m + self.step_m * np.arange(self.values.shape[1])
        return np.array([np.interp(approach_m, grid, row) for row in self.values])


def plain_table(slot: ElementContact, highest_m: float, deepest_m: float = DEEPEST_M) -> ForceTable:
    """Undamaged roller, from clear of everything, the highest bump included, to `deepest_m`.

    Steps are those of `DEEPEST_M`, in proportion to the depth.
    """
    scale = deepest_m / DEEPEST_M
    start = -(1.1 * (highest_m + max(0.0, sum(slot.excess_m))) + deepest_m)
    values = slot.press(np.arange(start, deepest_m, scale * STEP_M))
    return ForceTable(
        start_m=start, step_m=scale * STEP_M, bump_step_m=scale * DEFECT_STEP_M, deepest_m=deepest_m, values=values
    )


def bump_table(slot: ElementContact, plain: ForceTable, defect: Defect, race: int) -> tuple[FloatArray, float, float]:
    """Force that a defect on one race, or a roller's defect against it, adds to a roller's [N], [approach, positions].

    The approach begins as in `plain` and goes by its `bump_step_m`; the race's radius [m] and the step of the positions
    [m] are returned too. A position is the distance along the race from roller to defect, without sign: defects are
    symmetric.
    """
    raised, reach_m, race_radius_m = slot.on_race(defect, race, plain.deepest_m)
    position = np.linspace(0.0, reach_m, POSITIONS)
    approach = np.arange(plain.start_m, plain.deepest_m, plain.bump_step_m)
    force_n = slot.press(approach[:, None], raised(position[None, :]))[0] - plain.at(approach)[0][:, None]
    return force_n, race_radius_m, float(position[1])
