"""Nothing touches: cage and rollers must move as free bodies.

Reason: with no contact every force that is left is inertia, so centrifugal, Coriolis and gyroscopic terms stand alone
and even small ones show. Source: conservation of angular momentum and energy.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from srbval.models.full import columns as col
from tests.verification.cases import subject
from tests.verification.harness import LOOSE_FIT, FloatArray, Parameters, advance, layout_of, rates, rolling_state
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
    """A model whose rollers float midway between the races and touch nothing, with everything moving."""

    model: Parameters
    world: World
    y: FloatArray


def floating(**changes: Any) -> Free:
    _, model, world = subject({"contact": LOOSE_FIT}, changes)
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
    return Free(model, world, y)


@pytest.mark.parametrize("gravity", [False, True], ids=["no weight", "weight"])
def test_angular_momentum_and_energy_at_an_instant(gravity):
    """The inertia terms cancel in both and leave the torque of the weights: nothing but the right-hand side is used."""
    free = floating(load={"gravity": gravity})
    rate = rates(free.model, 0.0, free.y).rate
    rate[layout_of(free.y).ring_rate] = 0.0  # the ring swings on its own
    ahead, behind = free.y + SPAN_S * rate, free.y - SPAN_S * rate
    momentum = (free.world.momentum(ahead) - free.world.momentum(behind)) / (2 * SPAN_S)
    torque = np.cross(free.world.centres(free.y), free.world.bodies.roller * free.world.gravity()).sum(axis=0)
    assert momentum == pytest.approx(torque, abs=BALANCED * turnover(free))
    energy = (free.world.mechanical_energy(ahead) - free.world.mechanical_energy(behind)) / (2 * SPAN_S)
    assert energy == pytest.approx(0.0, abs=BALANCED * turnover(free) * CAGE_RAD_S)


def turnover(free: Free) -> float:
    """Angular momentum of the cage and its rollers, turned round once per radian [N m]."""
    return CAGE_RAD_S * float(np.linalg.norm(free.world.momentum(free.y)))


def test_angular_momentum_and_energy_are_kept_over_time():
    free = floating(load={"radial": "0 N"})
    y = free.y.copy()
    advance(free.model, y, step_s=STEP_S, steps=STEPS)
    before, after = free.world.momentum(free.y), free.world.momentum(y)
    assert after == pytest.approx(before, abs=EXACT * float(np.linalg.norm(before)))
    assert free.world.mechanical_energy(y) == pytest.approx(free.world.mechanical_energy(free.y), rel=EXACT)
