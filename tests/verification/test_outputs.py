"""What a run records is what the states between its output instants say.

Reason: the equations may be right and the record of them wrong. Source: a Runge-Kutta method written out once more in
the checks' own harness, and definitions: mean acceleration is change of velocity over the interval, mean cage speed is
change of angle over it, powers and forces are means over the stages, energies are those of the interval's start.
"""

from typing import Any

import numpy as np
import pytest

from srbval.models import outputs
from srbval.models.full import columns as col
from tests.verification.cases import CASES, disturbed, subject
from tests.verification.harness import PAPER_STEP_S, advance, layout_of, rates, rolling_state, runge_kutta_step

STEPS = 2
SAME = 1e-9  # the same arithmetic in another order, through contacts that magnify rounding by 1e4
MASS_BY_SLICES = 1e-8
POWERS = {
    col.DRIVE_POWER: outputs.MEAN_DRIVE_POWER,
    col.LOAD_POWER: outputs.MEAN_LOAD_POWER,
    col.FRICTION_POWER: outputs.MEAN_FRICTION_POWER,
    col.DAMPING_POWER: outputs.MEAN_DAMPING_POWER,
    col.HOUSING_POWER: outputs.MEAN_HOUSING_POWER,
}


@pytest.fixture(params=["play, paper's case", "every force at once, changing speed and load"], scope="module")
def interval(request):
    """World, state at the start and end of an output interval, mean and first contact values, and the record."""
    model, world = subject(CASES[request.param][0])
    start = disturbed(rolling_state(model), seed=3, cage_angle=world.scene.load.zone_rad)
    end = start.copy()
    mean = np.mean([runge_kutta_step(model, end, i * PAPER_STEP_S, PAPER_STEP_S) for i in range(STEPS)], axis=0)
    first = rates(model, 0.0, start).totals
    (record,) = advance(model, start.copy(), step_s=PAPER_STEP_S, steps=STEPS)
    return world, start, end, mean, first, record


def same(found: Any, expected: Any, tolerance: float = SAME) -> None:
    assert found == pytest.approx(expected, abs=tolerance * float(np.abs(expected).max()))


def test_motion(interval):
    _, start, end, _, _, record = interval
    where, seconds = layout_of(start), STEPS * PAPER_STEP_S
    same(record[outputs.ACCELERATION_XYZ], (end - start)[where.ring_rate] / seconds)
    same(record[outputs.DISPLACEMENT_XYZ], end[where.ring])
    same(record[outputs.CAGE_TILT_XY], end[where.cage][:2])
    same(record[outputs.CAGE_SPEED], (end - start)[where.cage][2] / seconds)


def test_forces_and_powers(interval):
    _, _, _, mean, _, record = interval
    same(record[outputs.MEAN_RING_FORCE_XYZ], mean[col.RING_FORCE])
    largest = np.abs(mean[col.DRIVE_POWER : col.INERTIA_XX]).max()
    for index, column in POWERS.items():
        assert record[column] == pytest.approx(mean[index], rel=SAME, abs=SAME * largest)


def test_energies(interval):
    """Of the bodies, weight included, and of the housing's spring: as in world axes."""
    world, start, _, _, first, record = interval
    ring = start[layout_of(start).ring]
    spring = world.housing_stiffness() * float(ring @ ring) / 2
    assert record[outputs.SPRING_ENERGY_AT_START] == pytest.approx(spring, rel=SAME)
    assert record[outputs.CONTACT_ENERGY_AT_START] == pytest.approx(first[col.CONTACT_ENERGY], rel=SAME)
    bodies = world.mechanical_energy(start) - spring
    assert record[outputs.BODY_ENERGY_AT_START] == pytest.approx(bodies, rel=MASS_BY_SLICES)
