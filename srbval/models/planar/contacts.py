"""Massless roller between two races: force on the outer ring as a function of the approach of the rings.

`approach` is the displacement of the outer race towards the shaft at a roller's angle [m], in the bearing's radial
direction. A roller slides along its slot, its place in the cage, by `slide` towards the outer race, until both races
press equally. Spherical rollers touch a race on three circles. Let the normal of a circle make the angle b with the
slot and the angle a with the radial direction. At the outer race the penetration is then approach cos a + (slide + e_o)
cos b, at the inner race (e_i - slide) cos b. Here e_o and e_i are the penetrations on the middle circles (b = 0) of the
outer and the inner race at zero approach and slide, negative for a gap.

`line.Patch` is the law of the contact on one circle. Balls and cylindrical rollers touch a race in one place, with the
law `Race`: a is the contact angle, b is zero. The force is tabulated over the approach; a second table contains
the force that a defect adds, over the approach and the defect's position.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import ElementShape, RollingElements, SphericalRollerGeometry
from srbval.errors import ConfigurationError
from srbval.models.full.parameters import POISSON, YOUNG_N_M2, roller_diameter_m
from srbval.models.line import DefectOnRace, Patch, patches
from srbval.models.planar.ring_kernel import ForceTable
from srbval.models.slices import LINE_STIFFNESS
from srbval.scene import Defect, DefectShape, Scene

SLIDE_DIFFERENCE_M = 1e-9  # step of the difference quotient of the stiffness
SLIDE_M = 2e-3  # largest slide of a roller: twice the highest defect
HALVINGS = 40  # of the search range: to 2e-15 m
MAX_APPROACH_M = 2e-4  # largest approach of the rings in the tables; each race has half of it
STEP_M = 2.5e-7  # between approaches in the table of an undamaged contact; error below 1e-4 of a loaded roller's force
DEFECT_STEPS = 8  # of these steps between approaches in the table of a defect
STRIPS = 24  # across a defect
LINE_EXPONENT = 10 / 9
TABLE_LOAD_FACTOR = 4.0  # tables reach this many times the load of the most loaded element without clearance
# Largest element load over load / number of elements, without clearance (Stribeck).
STRIBECK_FACTOR = {ElementShape.BALL: 4.37, ElementShape.ROLLER: 4.08}
LEAST_DEPTH_M, TOUCHING_M = 1e-6, 1e-12  # for the stiffness; the second is above the error of the search
MAX_AXIS_RATIO = 1e4  # largest ratio of an ellipse's axes in the search; grooves of 0.502 give some 40
POSITIONS = 64  # tabulated positions of a defect, from under the roller to the end of its reach


@dataclass(frozen=True)
class Race:
    """Contact of a ball or cylindrical roller with one race, divided into strips along the race.

    The laws are on the page "The model hierarchy" of the theory, section "planar". The force of a strip is its width
    times `stiffness` times penetration^`exponent`. The penetration of a ball falls across the race, by `fall_1_m`
    x^2 / 2 at the distance x from the middle; that of a roller (`fall_1_m` is 0) is constant over its `length_m`.
    `along_1_m`: curvature of the gap along the race; `radius_m`: radius of the race; `normal_rad`: contact angle;
    `damping_s`: time constant of the damper, see `LineContact`.
    """

    stiffness: float
    exponent: float
    fall_1_m: float
    length_m: float
    along_1_m: float
    radius_m: float
    normal_rad: float
    damping_s: float
    lean_rad: float = 0.0

    def force_n(self, depth_m: FloatArray) -> FloatArray:
        """Compute the normal force [N] at the penetrations `depth_m`, an array of any shape."""
        depth = np.maximum(depth_m, 0.0)
        if self.fall_1_m > 0:
            return self.stiffness * (4 / 3) * math.sqrt(2 / self.fall_1_m) * depth**1.5
        return self.stiffness * self.length_m * depth**self.exponent

    def damper_ns_m(self, depth_m: FloatArray) -> FloatArray:
        """Compute the radial damping coefficient [N s/m], `damping_s` times the radial stiffness, at each `depth_m`."""
        power = 1.5 if self.fall_1_m > 0 else self.exponent
        depth = np.maximum(depth_m, LEAST_DEPTH_M)
        slope = np.where(depth_m > TOUCHING_M, power * self.force_n(depth) / depth, 0.0)
        return math.cos(self.normal_rad) ** 2 * self.damping_s * slope

    def added_n(self, depth_m: FloatArray, defect: DefectOnRace) -> FloatArray:
        """Compute the force [N] that a defect adds, negative for a pit; broadcasts `depth_m` and `defect.middle_m`."""
        added = np.zeros(np.broadcast_shapes(depth_m.shape, defect.middle_m.shape))
        for x, half in zip(defect.across_m, defect.half_m, strict=True):
            level = depth_m - self.fall_1_m * x**2 / 2
            lifted = np.maximum(level + _lift_m(defect, half, self.along_1_m), 0.0)
            added += lifted**self.exponent - np.maximum(level, 0.0) ** self.exponent
        return self.stiffness * defect.strip_m * added

    def place(self, defect: Defect, deepest_m: float) -> DefectOnRace:
        """Divide a defect into strips, together at most as wide as the contact at the approach `deepest_m`.

        Raises `ConfigurationError` for a defect without `extent_m`.
        """
        if defect.extent_m is None:
            raise ConfigurationError(
                f"the defect has no extent, only points = {defect.points}, but races of ball and cylindrical roller "
                "bearings are not modelled as points: give the defect's length, for example extent = '0.5 mm'."
            )
        hole = defect.shape is DefectShape.HOLE
        widest = self.length_m if self.fall_1_m == 0 else 2 * math.sqrt(2 * deepest_m / self.fall_1_m)
        width = min(widest, defect.extent_m if hole else (defect.width_m or widest))
        across = (np.arange(STRIPS) + 0.5) / STRIPS * width - width / 2
        half = np.full(STRIPS, defect.extent_m / 2)
        half = np.sqrt(half**2 - across**2) if hole else half
        reach_m = float(half.max()) + math.sqrt(2 * max(0.0, defect.height_m) / self.along_1_m)
        return DefectOnRace(defect.height_m, half, reach_m, self.radius_m, across_m=across, strip_m=width / STRIPS)


def _lift_m(defect: DefectOnRace, half_m: float, along_1_m: float) -> FloatArray:
    """Compute how far one strip of the defect moves the ball or roller off the race [m], negative in a pit."""
    if defect.height_m > 0:
        beside = np.maximum(np.abs(defect.middle_m) - half_m, 0.0)
        return np.maximum(0.0, defect.height_m - along_1_m * beside**2 / 2)
    inside = np.maximum(half_m - np.abs(defect.middle_m), 0.0)
    return -np.minimum(along_1_m * inside**2 / 2, -defect.height_m)


ElementContact = Patch | Race


@dataclass(frozen=True, kw_only=True)
class Slot:
    """Contacts of a ball or roller with the outer and the inner race, `races`: three of a spherical roller, else one.

    `excess_m`: penetrations into both races if the rings are concentric and the ball or roller is in its middle [m].
    """

    races: tuple[Sequence[ElementContact], Sequence[ElementContact]]
    excess_m: tuple[float, float]

    def place_on_race(self, defect: Defect, race: int, deepest_m: float) -> DefectOnRace:
        """Place a defect on a race (0 outer, 1 inner), for approaches of the rings up to `deepest_m`."""
        circle = min(defect.circle, len(self.races[race])) - 1
        return self.races[race][circle].place(defect, deepest_m)._replace(race=race, circle=circle)

    def press(self, approach_m: FloatArray, raised: DefectOnRace | None = None) -> FloatArray:
        """Balance the ball or roller between both races at each approach, an array of any shape, by bisection.

        Returns radial force on the outer ring [N], damping of both races in series [N s/m] and the larger penetration
        [m] as one array, [3, ...]. `raised`: a defect at the ball or roller, None for undamaged races.
        """
        slide, high = np.array(-SLIDE_M), np.array(SLIDE_M)
        for _ in range(HALVINGS):
            middle = (slide + high) / 2
            outer, inner = (self._race_force(race, approach_m, middle, raised)[0] for race in (0, 1))
            slide, high = np.where(outer > inner, slide, middle), np.where(outer > inner, middle, high)
        middles = (own[len(own) // 2] for own in self.races)
        depth = np.maximum(*(self._depth(race, own, approach_m, slide) for race, own in enumerate(middles)))
        return np.array([self._race_force(0, approach_m, slide, raised)[1], self._damper(approach_m, slide), depth])

    def _depth(self, race: int, contact: ElementContact, approach: FloatArray, slide: FloatArray) -> FloatArray:
        lean = math.cos(contact.lean_rad)
        if race == 0:
            return approach * math.cos(contact.normal_rad) + (slide + self.excess_m[0]) * lean
        return (self.excess_m[1] - slide) * lean

    def _race_force(
        self, race: int, approach: FloatArray, slide: FloatArray, raised: DefectOnRace | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Compute the components of a race's force on the ball or roller [N]: along the slot, and radial."""
        along = radial = np.zeros(())
        for circle, contact in enumerate(self.races[race]):
            depth = self._depth(race, contact, approach, slide)
            force = contact.force_n(depth)
            if raised is not None and (raised.race, raised.circle) == (race, circle):
                force = force + contact.added_n(depth, raised)
            along = along + force * math.cos(contact.lean_rad)
            radial = radial + force * math.cos(contact.normal_rad)
        return along, radial

    def _damper(self, approach: FloatArray, slide: FloatArray) -> FloatArray:
        """Compute the radial damping of both races in series [N s/m]; the softer race takes more of the motion."""
        stiffness, damper = [], []
        for race, sign in ((0, 1.0), (1, -1.0)):
            near, _ = self._race_force(race, approach, slide)
            far, _ = self._race_force(race, approach, slide + sign * SLIDE_DIFFERENCE_M)
            stiffness.append((far - near) / SLIDE_DIFFERENCE_M + 1.0)
            damper.append(sum(c.damper_ns_m(self._depth(race, c, approach, slide)) for c in self.races[race]))
        whole = stiffness[0] + stiffness[1]
        return damper[0] * (stiffness[1] / whole) ** 2 + damper[1] * (stiffness[0] / whole) ** 2


def make_roller_slot(scene: Scene, geometry: SphericalRollerGeometry) -> Slot:
    """Build the contacts of a spherical roller of the scene with both races."""
    radius = roller_diameter_m(scene, geometry) / 2
    gap_outer = geometry.raceway_radius_m - geometry.roller_centre_distance_m
    gap_inner = geometry.zero_play_diameter_m - gap_outer
    outer, inner = (patches(geometry, scene.contact, radius, inner=inner) for inner in (False, True))
    return Slot(races=(outer, inner), excess_m=(radius - gap_outer, radius - gap_inner))


def make_element_slot(scene: Scene, elements: RollingElements) -> Slot:
    """Build the contacts of a ball or cylindrical roller of the scene with both races.

    The curvature of the gap along a race is D / (d R), with the diameter d of the ball or roller, the pitch diameter D,
    and the race's radius R at the contact. Across a race it is 2 / d minus the curvature of the groove (Harris &
    Kotzalas 2006, chapter 2; from memory).
    """
    d, angle, half_pitch = elements.element_diameter_m, elements.contact_angle_rad, elements.pitch_diameter_m / 2
    damping_s, races = scene.line_contact.damping_s, []
    for sign, groove in ((1.0, elements.outer_groove), (-1.0, elements.inner_groove)):
        radius = half_pitch + sign * d / 2 * math.cos(angle)
        along = 2 * half_pitch / (d * radius)
        if elements.shape is ElementShape.BALL:
            touch = ellipse(along, (2 - 1 / groove) / d)
            stiffness, exponent = 3 / (4 * touch.across_m * touch.approach_m), 1.0
            fall, length = 2 * touch.approach_m / touch.across_m**2, 0.0
        else:
            exponent, fall, length = LINE_EXPONENT, 0.0, elements.length_m or elements.element_diameter_m
            stiffness = LINE_STIFFNESS * length ** (8 / 9) * 2**LINE_EXPONENT / length
        races.append([Race(stiffness, exponent, fall, length, along, radius, normal_rad=angle, damping_s=damping_s)])
    half_play = scene.contact.radial_play_m / 2
    return Slot(races=(races[0], races[1]), excess_m=(-half_play, -half_play))


def deepest_approach_m(slot: Slot, scene: Scene, elements: RollingElements) -> float:
    """Find an approach of the rings [m] up to which contacts are tabulated, from the scene's largest load."""
    load = max(scene.load_table()[1])
    carried = elements.rows * elements.rolling_elements * math.cos(elements.contact_angle_rad)
    needed_n = TABLE_LOAD_FACTOR * STRIBECK_FACTOR[elements.shape] * max(load, 1.0) / carried
    approach = LEAST_DEPTH_M + max(0.0, scene.contact.radial_play_m)
    while slot.press(np.array([approach]))[0, 0] < needed_n:
        approach *= 1.2
    return float(approach)


class Ellipse(NamedTuple):
    """Contact ellipse under a load of 1 N: approach of the bodies [m], half axes across and along the race [m].

    The approach is proportional to load^(2/3), the axes to load^(1/3).
    """

    approach_m: float
    across_m: float
    along_m: float


@cache
def ellipse(along_1_m: float, across_1_m: float) -> Ellipse:
    """Solve Hertz's contact of two steel bodies under a load of 1 N.

    `along_1_m`, `across_1_m`: curvature of the gap along and across the race.
    After Harris & Kotzalas, Essential Concepts of Bearing Technology (2006), chapter 6 (quoted from memory; compared
    with the displacement of a half-space under the pressure found, in ``tests/models/test_elements.py``); the equation
    of the ratio of the ellipse's axes is on the page "The model hierarchy" of the theory.
    """
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipk

    total = along_1_m + across_1_m

    def missing(k: float) -> float:
        m = 1 - 1 / k**2
        return float(((k**2 + 1) * ellipe(m) - 2 * ellipk(m)) / ((k**2 - 1) * ellipe(m)))

    share = (along_1_m - across_1_m) / total
    k = float(brentq(lambda k: missing(k) - share, 1 + 1e-6, MAX_AXIS_RATIO)) if share > 1e-9 else 1.0
    first, second = float(ellipk(1 - 1 / k**2)), float(ellipe(1 - 1 / k**2))
    size = (3 / total * (1 - POISSON**2) / YOUNG_N_M2) ** (1 / 3)  # two equal materials, under 1 N
    return Ellipse(
        across_m=size * (2 * k**2 * second / math.pi) ** (1 / 3),
        along_m=size * (2 * second / (math.pi * k)) ** (1 / 3),
        approach_m=size**2 * total / math.pi * first * (math.pi / (2 * k**2 * second)) ** (1 / 3),
    )


def tabulate_force(slot: Slot, highest_m: float, deepest_m: float = MAX_APPROACH_M) -> ForceTable:
    """Tabulate the force of an undamaged contact up to the approach `deepest_m` of the rings.

    `highest_m`, sum of the heights of all defects and of a roller's interference between concentric rings, extends the
    table to negative approaches, at which raised defects still touch.
    """
    step = deepest_m / MAX_APPROACH_M * STEP_M
    start = -(1.1 * highest_m + deepest_m)
    return ForceTable(slot.press(np.arange(start, deepest_m, step)), start, step, deepest_m)


def tabulate_bump(slot: Slot, plain: ForceTable, defect: Defect, race: int) -> tuple[FloatArray, float, float]:
    """Tabulate the force [N] that a defect adds to a contact with the race `race`, [approaches, positions].

    The defect is on the race, or on a roller that touches the race with it. The approaches begin at `plain.start_m`, in
    steps of `DEFECT_STEPS` times `plain.step_m`. Positions are distances from roller to defect along the race, from 0,
    since defects are symmetric. Also returns the race's radius and the step of the positions [m].
    """
    raised = slot.place_on_race(defect, race, plain.deepest_m)
    position = np.linspace(0.0, raised.reach_m, POSITIONS)
    approach = np.arange(plain.start_m, plain.deepest_m, DEFECT_STEPS * plain.step_m)
    whole_n = slot.press(approach[:, None], raised._replace(middle_m=position[None, :]))[0]
    return whole_n - plain.at(approach)[0][:, None], raised.race_radius_m, float(position[1])
