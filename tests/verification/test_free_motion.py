"""Nothing touches: cage and rollers must move as free bodies.

Reason: with no contact every force that is left is inertia and weight, so centrifugal, Coriolis and gyroscopic terms
stand alone and even small ones show. Source: conservation of angular momentum and energy.
"""

import numpy as np
import pytest

from srbval.models.full import columns as col
from tests.verification.cases import subject
from tests.verification.harness import layout_of, rate_of_change, rates, rolling_state

# A difference quotient of the momentum loses rounding over the time it spans; what must cancel is its inertia terms.
BALANCED = 1e-8
SPAN_S = 1e-5
CAGE_RAD_S = 33.0


def test_angular_momentum_and_energy_at_an_instant():
    """Inertia terms cancel in both and leave the torque of the weights; rollers float midway between the races."""
    model, world = subject({"contact": {"radial_play": "3 mm"}, "load": {"gravity": True}})
    y = rolling_state(model)
    where = layout_of(y)
    y[where.cage] = (0.004, -0.003, 0.7)
    y[where.cage_rate] = (0.6, -0.4, CAGE_RAD_S)
    y[where.slide] = np.linspace(-8e-4, 6e-4, where.rollers)
    y[where.slide_rate] = np.linspace(-0.05, 0.04, where.rollers)
    y[where.spin] = np.linspace(-260, -200, where.rollers)
    found = rates(model, 0.0, y)
    rate = found.rate
    assert found.totals[col.DEEPEST] < 0.0
    rate[where.ring_rate] = 0.0  # the ring swings on its own
    momentum = rate_of_change(lambda _, y: world.momentum(y), y, rate, SPAN_S)
    torque = np.cross(world.centres(y), world.bodies.roller * world.gravity()).sum(axis=0)
    turnover = CAGE_RAD_S * float(np.linalg.norm(world.momentum(y)))  # of the momentum, round once per radian [N m]
    assert momentum == pytest.approx(torque, abs=BALANCED * turnover)
    energy = rate_of_change(lambda _, y: world.mechanical_energy(y), y, rate, SPAN_S)
    assert energy == pytest.approx(0.0, abs=BALANCED * turnover * CAGE_RAD_S)
