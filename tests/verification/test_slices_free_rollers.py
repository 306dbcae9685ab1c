"""Where rollers that only slide along their slots are right: against rollers that also tilt and slide along their axes.

Reason: the model's rollers do neither, and axial load reaches them through the ring's displacement alone. Source:
`slices_reference.py`. Its free rollers do so without friction, which is the extreme: each turns until both contacts lie
in its middle. Real ones are between both.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from srbval.scene import load_scene
from tests.verification.harness import FloatArray
from tests.verification.slices_reference import Contacts, SlicedBearing, balanced_ratio, slices_model
from tests.verification.test_slices_rolling import friction_of

pytestmark = pytest.mark.long_form  # both sides are references: what the theory states, not what the program does

RADIAL_N, AXIAL_N, OSCULATION = 124.8e3, 20e3, 0.97
BALANCED = 1e-9  # of a roller's load: forces along slot and axis, and moment over half the roller's length
CLOSED_FORM_M = 5e-9  # the deepest place lies up to 0.15 mm beside one of the reference's: 2.3 nm in either contact
LEAST_SHARE = 0.05  # of the largest load: which rollers' contacts count
# What the theory states of held rollers: right to this of the largest load, and of the cage ratio, without axial load.
LOADS, RATIO = 2e-3, 3e-4
# With it loads are off by this for each unit of axial over radial load: by 1 % at a hundredth, `LOADS` included.
LOADS_PER_AXIAL = 0.75
HALF_ROLLER_M = 18.5e-3


@dataclass(frozen=True, kw_only=True)
class Balanced:
    """A bearing in balance: ring [m], loads of the outer contacts, [rollers], where along the roller they are [m]."""

    ring: FloatArray
    along: FloatArray
    contacts: Contacts

    @property
    def load_n(self) -> FloatArray:
        """Of each roller on the outer race."""
        found: FloatArray = self.contacts.force_n[0].sum(axis=1)
        return found

    @property
    def farthest_m(self) -> float:
        """How far from the roller's middle a loaded contact has its middle."""
        loads = self.contacts.force_n.sum(axis=2)
        counts = loads > LEAST_SHARE * loads.max()
        middle = (self.contacts.force_n * self.contacts.x_m).sum(axis=2)[counts] / loads[counts]
        return float(np.abs(middle).max())


@cache
def bearings() -> tuple[SlicedBearing, SlicedBearing]:
    """That of the scene `rig`, with held and with free rollers."""
    profiles = {"outer_osculation": OSCULATION, "inner_osculation": OSCULATION}
    scene = load_scene("rig", {"line_contact": profiles})
    held = SlicedBearing.like(slices_model(scene), scene)
    return held, replace(held, free=True)


@cache
def in_balance(axial_n: float, free: bool) -> Balanced:
    bearing = bearings()[free]
    ring, along = bearing.balance(load(axial_n))
    return Balanced(ring=ring, along=along, contacts=bearing.contacts(along, ring))


def load(axial_n: float) -> FloatArray:
    return np.array([0.0, -RADIAL_N, axial_n])


def ratio(axial_n: float, free: bool) -> float:
    """Cage over shaft speed at one cage angle, one cage for both rows."""
    scene, found = load_scene("rig"), in_balance(axial_n, free)
    slide, *_ = bearings()[free].pose(found.along, found.ring)
    return balanced_ratio([(found.contacts, slide)], scene.shaft_speed_rad_s, friction_of(scene))


def off_by(axial_n: float) -> float:
    """By how much any roller's load differs between held and free, of the largest load."""
    held, free = (in_balance(axial_n, free).load_n for free in (False, True))
    return float(np.abs(held - free).max() / held.max())


@pytest.mark.parametrize("axial_n", [0.0, AXIAL_N])
def test_free_rollers_are_in_balance(axial_n: float) -> None:
    """No force along slot or axis and no moment is left; their approach is what the races' arcs leave between them."""
    found = in_balance(axial_n, free=True)
    c, bearing = found.contacts, bearings()[1]
    # in slot axes the moment about the roller's middle, of places in the roller's own meridian turned back
    turn = np.array([np.cos(c.tilt_rad), np.sin(c.tilt_rad)])[:, :, None]
    s, x = c.s_m * turn[0] - c.x_m * turn[1], c.s_m * turn[1] + c.x_m * turn[0]
    moment = (c.force_n * (s * c.normal_x - x * c.normal_s)).sum(axis=(0, 2)) / HALF_ROLLER_M
    for left in (*((c.force_n * n).sum(axis=(0, 2)) for n in (c.normal_s, c.normal_x)), moment):
        assert np.abs(left).max() < BALANCED * found.load_n.max()
    arc, centre_s, centre_x = bearing.arcs(found.ring)
    apart = np.hypot(centre_s[1] - centre_s[0], centre_x[1] - centre_x[0])
    approach = apart + 2 * bearing.roller_m - arc.sum()
    profile = bearing.outer_osculation * arc[0, 0]
    each = profile - np.hypot(c.s_m + np.array([1, -1])[:, None, None] * (profile - bearing.roller_m), c.x_m)
    deepest = each.max(axis=2).sum(axis=0)
    loaded = found.load_n > LEAST_SHARE * found.load_n.max()
    assert deepest[loaded] == pytest.approx(approach[loaded], abs=CLOSED_FORM_M)


def test_without_axial_load_held_rollers_carry_what_free_ones_do() -> None:
    assert off_by(0.0) < LOADS
    held, free = (ratio(0.0, free) for free in (False, True))
    assert 0 < free / held - 1 < RATIO


def test_with_axial_load_they_are_off_in_proportion() -> None:
    """So loads are right to 1 % up to an axial load of a hundredth of the radial one."""
    assert in_balance(AXIAL_N, free=True).farthest_m < CLOSED_FORM_M
    assert off_by(AXIAL_N) < LOADS + LOADS_PER_AXIAL * AXIAL_N / RADIAL_N
