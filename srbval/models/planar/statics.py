"""One roller between two races, without mass: force on the outer ring as a function of how near the rings are.

`approach` is how far the outer race has come towards the shaft at a roller's angle [m], in the bearing's radial
direction. The roller slides in its slot until both races press it alike. On a circle whose normal leans by b from the
slot and by a from the radial direction the outer race is penetrated by approach cos a + (slide + e_o) cos b, the
inner one by (e_i - slide) cos b, with e the roller's radius less the gap to the race; forces follow `patch`.

The force is tabulated once per run: over the approach, and over the position of a defect besides.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing, Fault, SphericalRollerGeometry
from srbval.errors import ConfigurationError
from srbval.models.full.parameters import roller_diameter_m
from srbval.models.patch import Patch, Piece, patches, piece
from srbval.scene import Defect, Scene

NUDGE_M = 1e-9  # for the stiffness
SLIDE_M = 2e-3  # how far a roller may slide: twice the highest defect
HALVINGS = 40  # of that range: to 2e-15 m
DEEPEST_M = 2e-4  # approach of the rings that the tables reach; half of it is each race's
STEP_M = 2.5e-7  # between entries of the plain table; force is off by less than 1e-4 of a loaded roller's
DEFECT_STEP_M = 2e-6
POSITIONS = 64  # of a defect, from straight under the roller to out of its reach


@dataclass(frozen=True, kw_only=True)
class Raised:
    """A defect's piece on one circle of one race (0 outer, 1 inner), `middle_m` along it from the roller, any shape."""

    race: int
    circle: int
    part: Piece
    middle_m: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Pressed:
    """A roller in balance: radial `force_n` on the outer ring, both races' dampers in series, deepest penetration."""

    force_n: FloatArray
    damper_ns_m: FloatArray
    depth_m: FloatArray


@dataclass(frozen=True, kw_only=True)
class Slot:
    """A roller's contacts: `outer` and `inner` patches, roller's excess over the gap to each race at rest [m]."""

    outer: tuple[Patch, ...]
    inner: tuple[Patch, ...]
    outer_excess_m: float
    inner_excess_m: float

    def press(self, approach_m: FloatArray, raised: Sequence[Raised] = ()) -> Pressed:
        """Balance the roller at each `approach_m`, any shape; bisection, since more slide always presses outwards."""
        shape = np.broadcast_shapes(approach_m.shape, *(r.middle_m.shape for r in raised))
        low, high = np.full(shape, -SLIDE_M), np.full(shape, SLIDE_M)
        for _ in range(HALVINGS):
            slide = (low + high) / 2
            inwards, _ = self._side(0, approach_m, slide, raised)
            outwards, _ = self._side(1, approach_m, slide, raised)
            too_far = inwards > outwards
            low, high = np.where(too_far, low, slide), np.where(too_far, slide, high)
        slide = (low + high) / 2
        _, force = self._side(0, approach_m, slide, raised)
        return Pressed(
            force_n=force,
            damper_ns_m=self._damper(approach_m, slide),
            depth_m=np.maximum(self._depth(0, 1, approach_m, slide), self._depth(1, 1, approach_m, slide)),
        )

    def _depth(self, race: int, circle: int, approach: FloatArray, slide: FloatArray) -> FloatArray:
        patch = (self.outer, self.inner)[race][circle]
        lean = math.cos(patch.lean_rad)
        if race == 0:
            return approach * math.cos(patch.normal_rad) + (slide + self.outer_excess_m) * lean
        return (self.inner_excess_m - slide) * lean

    def _side(
        self, race: int, approach: FloatArray, slide: FloatArray, raised: Sequence[Raised]
    ) -> tuple[FloatArray, FloatArray]:
        """Force of a race along the slot, and along the bearing's radius."""
        along, radial = np.zeros(slide.shape), np.zeros(slide.shape)
        for circle, patch in enumerate((self.outer, self.inner)[race]):
            depth = self._depth(race, circle, approach, slide)
            force = patch.force_n(depth)
            for r in raised:
                if (r.race, r.circle) == (race, circle):
                    force = force + patch.raised_force_n(depth, r.middle_m, r.part)
            along += force * math.cos(patch.lean_rad)
            radial += force * math.cos(patch.normal_rad)
        return along, radial

    def _damper(self, approach: FloatArray, slide: FloatArray) -> FloatArray:
        """Both races' dampers in series with the split of motion that the stiffnesses make, radial."""
        stiffness, damper = [], []
        for race, sign in ((0, 1.0), (1, -1.0)):
            near, _ = self._side(race, approach, slide, ())
            far, _ = self._side(race, approach, slide + sign * NUDGE_M, ())
            stiffness.append((far - near) / NUDGE_M + 1.0)
            each = (self.outer, self.inner)[race]
            damper.append(sum(p.damper_ns_m(self._depth(race, i, approach, slide)) for i, p in enumerate(each)))
        whole = stiffness[0] + stiffness[1]
        series: FloatArray = damper[0] * (stiffness[1] / whole) ** 2 + damper[1] * (stiffness[0] / whole) ** 2
        return series


def make_slot(scene: Scene, geometry: SphericalRollerGeometry) -> Slot:
    """The scene's roller between its races."""
    radius = roller_diameter_m(scene, geometry) / 2
    gap_outer = geometry.raceway_radius_m - geometry.roller_centre_distance_m
    gap_inner = geometry.zero_play_diameter_m - gap_outer
    return Slot(
        outer=tuple(patches(geometry, scene.contact, radius, inner=False)),
        inner=tuple(patches(geometry, scene.contact, radius, inner=True)),
        outer_excess_m=radius - gap_outer,
        inner_excess_m=radius - gap_inner,
    )


def raised_at(defect: Defect, slot: Slot, middle_m: FloatArray, *, race: int) -> Raised:
    """A defect met by a race's patch at `middle_m` from the roller."""
    circle = defect.circle - 1
    spacing = (slot.outer, slot.inner)[race][circle].spacing_m
    return Raised(race=race, circle=circle, part=piece(defect, spacing), middle_m=middle_m)


def geometry_of(bearing: Bearing, model: str) -> SphericalRollerGeometry:
    """The bearing's geometry; `ConfigurationError` for a bearing without one."""
    if bearing.geometry is None:
        raise ConfigurationError(f"bearing {bearing.name!r} has no [geometry]; the {model} model cannot run it.")
    return bearing.geometry


def races_of(defect: Defect) -> tuple[int, ...]:
    """Which races a defect is met at: its own, or both for a roller's."""
    return {Fault.OUTER: (0,), Fault.INNER: (1,), Fault.ROLLER: (0, 1)}.get(defect.kind, ())


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
    """Force that a defect adds to a roller's [N]: approach ``start_m + i step_m``, position ``k position_step_m``.

    A position is the distance along the race from roller to defect, without sign: defects are symmetric.
    """

    start_m: float
    step_m: float
    position_step_m: float
    values: FloatArray


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
    position = np.linspace(0.0, reach, POSITIONS)
    approach = np.arange(plain.start_m, DEEPEST_M, DEFECT_STEP_M)
    pressed = slot.press(approach[:, None], [raised_at(defect, slot, position[None, :], race=race)])
    return Bump(
        start_m=plain.start_m,
        step_m=DEFECT_STEP_M,
        position_step_m=float(position[1]),
        values=pressed.force_n - plain.force_n(approach)[:, None],
    )


def _free(slot: Slot, highest_m: float) -> float:
    """Distance of the rings at which nothing touches, the highest bump included [m]."""
    squeezed = max(0.0, slot.outer_excess_m + slot.inner_excess_m)
    return 1.1 * (highest_m + squeezed) + 2e-4
