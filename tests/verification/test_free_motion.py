"""Nothing touches: cage and rollers must move as free bodies.

Reason: with no contact every force that is left is inertia, so centrifugal, Coriolis and gyroscopic terms stand alone
and even small ones show. Sources: closed forms of a bead on a turning rod and of a tumbling symmetric top (Goldstein,
Classical Mechanics, 3rd ed., sect. 5.6), conservation of angular momentum and energy, a falling stone.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from srbval.models.full import columns as col
from tests.verification.harness import (
    LOOSE_FIT,
    FloatArray,
    Parameters,
    advance,
    geometry,
    layout_of,
    merged,
    paper_scene,
    parameters,
    rates,
    rolling_state,
)
from tests.verification.world import World

STEP_S, STEPS = 2e-5, 25
# Fourth order at 35 rad/s: (35 * 2e-5)^4 is far below rounding, which 25 steps of double precision gather.
EXACT = 1e-11
# A difference quotient of the momentum loses rounding over the time it spans; what must cancel is its inertia terms.
BALANCED = 1e-8
SPAN_S = 1e-5
CAGE_RAD_S = 33.0


@dataclass(frozen=True)
class Free:
    """A model whose rollers float midway between the races, with everything moving."""

    model: Parameters
    world: World
    y: FloatArray


def floating(**changes: Any) -> Free:
    scene = paper_scene(**merged({"contact": LOOSE_FIT}, changes))
    model = parameters(scene)
    y = rolling_state(model)
    where = layout_of(y)
    y[where.cage] = (0.004, -0.003, 0.7)
    y[where.cage_rate] = (0.6, -0.4, CAGE_RAD_S)
    y[where.slide] = np.linspace(-8e-4, 6e-4, where.rollers)
    y[where.slide_rate] = np.linspace(-0.05, 0.04, where.rollers)
    y[where.spin] = np.linspace(-260, -200, where.rollers)
    return Free(model, World(scene, geometry()), y)


def test_nothing_touches() -> None:
    """The state that the checks below rest on."""
    free = floating()
    found = rates(free.model, 0.0, free.y)
    assert found.totals[col.DEEPEST] < 0.0
    assert not found.totals[col.RING_FORCE].any()
    assert not found.load_n.any()


@pytest.mark.parametrize("gravity", [False, True], ids=["no weight", "weight"])
def test_angular_momentum_and_energy_at_an_instant(gravity: bool) -> None:
    """The inertia terms cancel in both and leave the torque of the weights: nothing but the right-hand side is used."""
    free = floating(load={"gravity": gravity})
    rate = rates(free.model, 0.0, free.y).rate
    rate[layout_of(free.y).ring_rate] = 0.0  # the ring swings on its own
    ahead, behind = free.y + SPAN_S * rate, free.y - SPAN_S * rate
    momentum = (free.world.momentum(ahead) - free.world.momentum(behind)) / (2 * SPAN_S)
    weight = free.world.bodies.roller * free.world.gravity()
    torque = np.cross(free.world.centres(free.y), weight).sum(axis=0)
    assert momentum == pytest.approx(torque, abs=BALANCED * turnover(free))
    energy = (free.world.mechanical_energy(ahead) - free.world.mechanical_energy(behind)) / (2 * SPAN_S)
    assert energy == pytest.approx(0.0, abs=BALANCED * turnover(free) * CAGE_RAD_S)


def turnover(free: Free) -> float:
    """Angular momentum of the cage and its rollers, turned round once per radian [N m]."""
    return CAGE_RAD_S * float(np.linalg.norm(free.world.momentum(free.y)))


def test_angular_momentum_and_energy_are_kept_over_time() -> None:
    free = floating(load={"radial": "0 N"})
    y = free.y.copy()
    advance(free.model, y, step_s=STEP_S, steps=STEPS)
    before, after = free.world.momentum(free.y), free.world.momentum(y)
    assert after == pytest.approx(before, abs=EXACT * float(np.linalg.norm(before)))
    assert free.world.mechanical_energy(y) == pytest.approx(free.world.mechanical_energy(free.y), rel=EXACT)


def test_rollers_fly_outwards_from_a_steady_cage() -> None:
    """A bead on a turning rod: u = (L + u0) cosh(w t) + v0 / w sinh(w t) - L, w = W cos(tilt); steady spin."""
    free = floating()
    model = free.model._replace(cage_axial=1e12, cage_transverse=1e12)  # a cage that rollers cannot slow down
    y, where = free.y.copy(), layout_of(free.y)
    y[where.cage], y[where.cage_rate] = 0.0, (0.0, 0.0, CAGE_RAD_S)
    start = y.copy()
    advance(model, y, step_s=STEP_S, steps=STEPS)
    g, t = geometry(), STEP_S * STEPS
    rate, reach = CAGE_RAD_S * np.cos(g.tilt_rad), g.pitch_radius_m / np.cos(g.tilt_rad)
    expected = (reach + start[where.slide]) * np.cosh(rate * t) - reach
    expected += start[where.slide_rate] / rate * np.sinh(rate * t)
    assert y[where.slide] == pytest.approx(expected, abs=EXACT * reach)
    assert np.array_equal(y[where.spin], start[where.spin])
    along = start[where.spin] - CAGE_RAD_S * np.cos(g.tilt_rad)
    assert y[where.rotation] == pytest.approx(along * t, rel=EXACT)
    assert y[where.cage] == pytest.approx([0.0, 0.0, CAGE_RAD_S * t], abs=EXACT)


def test_cage_alone_tumbles_as_a_symmetric_top() -> None:
    """Rollers without mass: the cage's axis turns about its constant angular momentum H at |H| / I_t."""
    free = floating()
    model = free.model._replace(roller_mass=1e-15, roller_axial=1e-18, roller_transverse=1e-18)
    y, where = free.y.copy(), layout_of(free.y)
    y[where.slide] = y[where.slide_rate] = 0.0
    y[where.cage_rate] = (5.0, -3.0, 20.0)
    axis, omega = free.world.cage_axis(y), y[where.cage_rate].copy()
    transverse = model.cage_transverse * (omega - (omega @ axis) * axis)
    h = transverse + model.cage_axial * (omega @ axis) * axis
    advance(model, y, step_s=STEP_S, steps=STEPS)
    turned = np.linalg.norm(h) / model.cage_transverse * STEP_S * STEPS
    pole = h / np.linalg.norm(h)
    along = (axis @ pole) * pole
    expected = along + np.cos(turned) * (axis - along) + np.sin(turned) * np.cross(pole, axis)
    assert free.world.cage_axis(y) == pytest.approx(expected, abs=EXACT)
    steady = transverse / model.cage_transverse
    assert y[where.cage_rate] @ free.world.cage_axis(y) == pytest.approx(omega @ axis, rel=EXACT)
    whole = np.hypot(np.linalg.norm(steady), omega @ axis)
    assert np.linalg.norm(y[where.cage_rate]) == pytest.approx(whole, rel=EXACT)


def test_ring_without_housing_falls_like_a_stone() -> None:
    """Constant force: x0 + v0 t + F t^2 / 2 m, gravity included; exact for any method of order 2 or more."""
    load = {"radial": "500 N", "axial": "70 N", "direction": "-30 deg", "path": "bearing", "gravity": True}
    free = floating(load=load)  # with this path nothing but the rollers would hold it
    y, where = free.y.copy(), layout_of(free.y)
    y[where.ring], y[where.ring_rate] = (1e-5, 2e-5, -1e-5), (0.01, -0.02, 0.03)
    start, t = y.copy(), STEP_S * STEPS
    advance(free.model, y, step_s=STEP_S, steps=STEPS)
    push = free.world.external_load(0.0) / free.world.bodies.ring + free.world.gravity()
    expected = start[where.ring] + start[where.ring_rate] * t + push * t**2 / 2
    mass_by_slices = 1e-9  # how well the ring's mass is known to the expectation
    assert y[where.ring] == pytest.approx(expected, rel=mass_by_slices)
    assert y[where.ring_rate] == pytest.approx(start[where.ring_rate] + push * t, rel=mass_by_slices)
