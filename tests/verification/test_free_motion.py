"""Nothing touches: cage and rollers must move as free bodies.

Reason: with no contact every force that is left is inertia, so centrifugal, Coriolis and gyroscopic terms stand alone
and even small ones show. Source: conservation of angular momentum and energy.
"""

from typing import Any

import numpy as np
import pytest

from srbval.models.full import columns as col
from tests.verification.cases import subject
from tests.verification.harness import (
    LOOSE_FIT,
    FloatArray,
    Parameters,
    advance,
    layout_of,
    rate_of_change,
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


def floating(**load: Any) -> tuple[Parameters, World, FloatArray]:
    """A model whose rollers float midway between the races and touch nothing, and a state with everything moving."""
    model, world = subject({"contact": LOOSE_FIT, "load": load})
    y = rolling_state(model)
    where = layout_of(y)
    y[where.cage] = (0.004, -0.003, 0.7)
    y[where.cage_rate] = (0.6, -0.4, CAGE_RAD_S)
    y[where.slide] = np.linspace(-8e-4, 6e-4, where.rollers)
    y[where.slide_rate] = np.linspace(-0.05, 0.04, where.rollers)
    y[where.spin] = np.linspace(-260, -200, where.rollers)
    found = rates(model, 0.0, y)
    assert found.totals[col.DEEPEST] < 0.0
    assert not found.totals[col.RING_FORCE].any()
    assert not found.load_n.any()
    return model, world, y


@pytest.mark.parametrize("gravity", [False, True], ids=["no weight", "weight"])
def test_angular_momentum_and_energy_at_an_instant(gravity):
    """The inertia terms cancel in both and leave the torque of the weights: nothing but the right-hand side is used."""
    model, world, y = floating(gravity=gravity)
    rate = rates(model, 0.0, y).rate
    rate[layout_of(y).ring_rate] = 0.0  # the ring swings on its own
    momentum = rate_of_change(lambda _, y: world.momentum(y), y, rate, SPAN_S)
    torque = np.cross(world.centres(y), world.bodies.roller * world.gravity()).sum(axis=0)
    turnover = CAGE_RAD_S * float(np.linalg.norm(world.momentum(y)))  # of the momentum, round once per radian [N m]
    assert momentum == pytest.approx(torque, abs=BALANCED * turnover)
    energy = rate_of_change(lambda _, y: world.mechanical_energy(y), y, rate, SPAN_S)
    assert energy == pytest.approx(0.0, abs=BALANCED * turnover * CAGE_RAD_S)


def test_angular_momentum_and_energy_are_kept_over_time():
    model, world, start = floating(radial="0 N")
    y = start.copy()
    advance(model, y, step_s=STEP_S, steps=STEPS)
    momentum = world.momentum(start)
    assert world.momentum(y) == pytest.approx(momentum, abs=EXACT * float(np.linalg.norm(momentum)))
    assert world.mechanical_energy(y) == pytest.approx(world.mechanical_energy(start), rel=EXACT)
