"""Rolling resistance, drag and pockets of a bearing in oil against a second formulation: virtual work of free bodies.

Each force is what one law of the oil adds to the equations of motion. Generalised forces Q = M (a - a without oil) with
the mass matrix of `matrices.py` are compared with what the same forces do on each body's own velocity, from closed
forms of `srbval.models.oil`, in every speed.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
import pytest

from srbval.models.full import columns as col
from srbval.models.oil import thermal_factor
from srbval.models.slices import sliced_contacts
from srbval.scene import Scene, load_scene
from tests.verification import harness
from tests.verification.matrices import mass_matrix
from tests.verification.world import World

ONLY = {
    "rolling": {"fill": 0, "pocket_friction": 0},
    "drag": {"rolling_resistance": False, "pocket_friction": 0},
    "pockets": {"rolling_resistance": False, "fill": 0},
    "all": {},
}
POWERS = {"rolling": col.ROLLING_POWER, "drag": col.DRAG_POWER, "pockets": col.POCKET_POWER}
RING_M = 1.5e-4  # displacement of the ring into the load zone
CLOSED = 1e-3  # of the power of the oil that bodies and shaft do not show
FORM = 0.02  # the kernel's roots of load and rate are the formula's powers to 1 %; friction is in its loads


class Case(NamedTuple):
    """A state of rollers that slip and a cage that lags: with the oil's forces, without, and what they are made of."""

    model: harness.Parameters
    state: harness.FloatArray
    wet: harness.Rates
    dry: harness.Rates
    force: harness.FloatArray  # generalised, of the oil, at the places of the speeds in the state
    scene: Scene


@functools.cache
def case(name: str) -> Case:
    """The scene `rig-oil` with one force of the oil, or all, at 859 rpm."""
    scene = load_scene("rig-oil", {"oil": ONLY[name], "line_contact": {"slices": 5}})
    model = harness.parameters(scene)
    state, rng = harness.rolling_state(model), np.random.default_rng(38)
    layout = harness.layout_of(state)
    state[layout.ring] = 0.0, -RING_M, 0.0
    state[layout.slide] = -0.5 * RING_M * np.sin(model.slot_angle)
    state[layout.spin] *= 1 + 0.02 * rng.standard_normal(len(model.slot_angle))
    state[layout.shaft_cage_rate] *= 0.97
    wet = harness.rates(model, 0.0, state)
    without = model.oil._replace(rolling=np.zeros((2, 2)), drag=0.0, pocket=0.0)
    dry = harness.rates(model._replace(oil=without), 0.0, state)
    force = np.zeros_like(state)
    force[layout.half :] = mass_matrix(World(scene), state) @ (wet.rate - dry.rate)[layout.half :]
    return Case(model, state, wet, dry, force, scene)


def expected(one: Case) -> tuple[harness.FloatArray, float, float, float]:
    """Couples on the rollers about their axes, torques on the cages about the shaft and on the shaft, and the power.

    Row 1 is the state's first half. Bodies: rollers turn at their spin about axes that stand at the tilt to the shaft,
    the outer ring is at rest, the shaft turns.
    """
    model, oil, layout = one.model, one.scene.oil, harness.layout_of(one.state)
    n, cosine, shaft = len(model.slot_angle), math.cos(harness.geometry().tilt_rad), one.scene.mean_shaft_rad_s
    spin, cage = one.state[layout.spin], float(one.state[layout.shaft_cage_rate][0])
    shapes = sliced_contacts(one.scene, harness.geometry())
    rolling = 0.5 * (shapes[0].radius_m * cage + shapes[1].radius_m * (shaft - cage))
    heat, load = thermal_factor(oil, rolling), one.dry.load_n.sum(axis=2)
    area = 2 * model.law.roller_radius * harness.geometry().roller_width_m
    reach = model.centre_distance + one.state[layout.slide]
    speed = reach * cage * cosine
    drag = 0.5 * oil.fill * oil.density_kg_m3 * oil.drag_coefficient * area * speed**2
    couples, on_shaft, power = np.zeros(n), 0.0, float(drag @ speed)
    for race, j in np.argwhere(load > 0) if oil.rolling_resistance else ():
        rate, shape, load_n = race * shaft * cosine - spin[j], shapes[race].shape, load[race, j]
        size = shape.rolling_couple_nm(oil, abs(rate), load_n, shape.length_m(load_n)) * heat
        couples[j] += math.copysign(size, rate)
        on_shaft -= race * cosine * math.copysign(size, rate)
        power += size * abs(rate)
    return couples, -cosine * float(drag @ reach), on_shaft, power


@pytest.mark.parametrize("name", ["rolling", "drag"])
def test_forces_are_those_of_free_bodies(name):
    one = case(name)
    parts, (couples, cages, on_shaft, power) = harness.layout_of(one.state), expected(one)
    idle = one.dry.load_n.sum(axis=(0, 2)) == 0
    assert name == "drag" or 0 < np.count_nonzero(idle) == np.count_nonzero(couples == 0) < len(idle)
    np.testing.assert_allclose(one.force[parts.spin], couples, rtol=FORM, atol=FORM * 1e-3)
    rounding = 1e-6 * max(1.0, float(abs(couples).max()))
    assert one.force[parts.shaft_cage_rate].sum() == pytest.approx(cages, rel=FORM, abs=rounding)
    # half of the rollers are in row 2, at like places
    assert one.force[parts.relative_rate].sum() == pytest.approx(cages / 2, rel=FORM, abs=rounding)
    torque = one.wet.totals[col.SHAFT_TORQUE] - one.dry.totals[col.SHAFT_TORQUE]
    assert torque == pytest.approx(on_shaft, rel=FORM, abs=1e-9)
    assert one.wet.totals[POWERS[name]] == pytest.approx(power, rel=FORM)


def test_pockets_rub_between_rollers_and_their_cage():
    """Equal and opposite on roller and cage, against the relative turning, no more than friction times the push."""
    one = case("pockets")
    parts, cosine = harness.layout_of(one.state), math.cos(harness.geometry().tilt_rad)
    couples = one.force[parts.spin]
    turning = one.state[parts.spin] - float(one.state[parts.shaft_cage_rate][0]) * cosine
    assert np.all(couples * turning <= 0)
    assert one.force[parts.shaft_cage_rate].sum() == pytest.approx(-cosine * couples.sum(), rel=1e-6)
    weight = one.model.roller_mass * one.model.gravity
    idle = one.dry.load_n.sum(axis=(0, 2)) == 0  # these are pushed by their weight alone
    most = one.scene.oil.pocket_friction * one.model.law.roller_radius * abs(weight)
    push = np.abs(np.cos(one.model.slot_angle[idle])) * most  # its part along the race
    np.testing.assert_allclose(np.abs(couples[idle]), push, rtol=1e-3, atol=1e-6 * most)
    assert one.wet.totals[POWERS["pockets"]] == pytest.approx(-float(couples @ turning), rel=1e-6)


@pytest.mark.parametrize("name", ONLY)
def test_power_balance(name):
    """What the shaft brings and the bodies do not take goes into the oil; nothing else changes."""
    one = case(name)
    bodies = float(one.force @ one.state)
    drive = float(one.wet.totals[col.DRIVE_POWER] - one.dry.totals[col.DRIVE_POWER])
    lost = [float(one.wet.totals[column]) for column in POWERS.values()]
    assert drive - bodies == pytest.approx(sum(lost), rel=CLOSED)
    assert all(value > 0 for value in lost) if name == "all" else np.count_nonzero(lost) == 1
