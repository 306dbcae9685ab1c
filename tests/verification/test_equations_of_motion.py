"""The equations of motion at an instant, against a second formulation in world axes (`world.py`).

Reason: every force and inertia term enters one of these balances, so a wrong sign in any of them shows at once.
Source: eqs (16) to (19) of the paper for the contacts; Newton's and Euler's laws for the bodies, written as rates of
change of momentum and energy that are found by difference quotients along the model's own rates. No mass matrix, no
centrifugal, Coriolis or gyroscopic term is written down here.
"""

from collections.abc import Callable

import numpy as np
import pytest

from srbval.models.full import columns as col
from tests.verification.cases import CASES, Case, in_short_form, make_case
from tests.verification.harness import FloatArray, layout_of, rate_of_change
from tests.verification.matrices import partial_velocities

# Two ways of finding 10 um of penetration in lengths of 0.16 m differ by rounding of 2e-16 * 0.16 / 1e-5 = 4e-12, and
# the model's series for the distance by (depth / 0.16 m)^3; friction's slope multiplies both.
FORCES = 1e-9
# Difference quotients of momenta over 2e-6 s lose some 1e-16 / 1e-6 of values that are a hundredth of their rates.
QUOTIENTS = 1e-7
SPAN_S = 1e-6
INERTIA_N = 1e-4  # difference quotients of the lightest roller's momentum
LEAST_LOAD_N = 100.0  # the state must press some rollers, or nothing is tested


@pytest.fixture(params=in_short_form(CASES), scope="module")
def case(request):
    return make_case(request.param)


def along_the_motion(case: Case, function: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Rate of change of a function of the state along the model's rates, of fourth order."""
    near, far = (rate_of_change(lambda _, y: function(y), case.y, case.found.rate, k * SPAN_S) for k in (1, 2))
    return (4 * near - far) / 3


def assert_same(found: FloatArray, expected: FloatArray, tolerance: float, least: float = 0.0) -> None:
    scale = float(np.abs(expected).max())
    assert scale > least
    assert found == pytest.approx(expected, abs=tolerance * scale)


def test_force_on_the_outer_ring(case):
    assert_same(case.found.totals[col.RING_FORCE], case.expected.on_ring, FORCES, LEAST_LOAD_N)


def test_torque_on_the_shaft(case):
    """Force and arm at every point of the inner race, about the shaft's axis."""
    assert case.found.totals[col.SHAFT_TORQUE] == pytest.approx(case.expected.on_shaft, rel=FORCES)


def test_losses_and_stored_energy(case):
    expected = [case.expected.rubbed, case.expected.damped, case.expected.stored]
    found = case.found.totals[[col.FRICTION_POWER, col.DAMPING_POWER, col.CONTACT_ENERGY]]
    assert found == pytest.approx(expected, rel=FORCES)


def test_powers_of_drive_load_and_housing(case):
    """Torque times speed, force times speed, damper's force times speed."""
    ring_rate = case.y[layout_of(case.y).ring_rate]
    drive = -case.expected.on_shaft * case.world.shaft(case.time)[0]
    lost = case.world.scene.housing.damping_ns_m * ring_rate @ ring_rate
    assert case.found.totals[[col.DRIVE_POWER, col.LOAD_POWER, col.HOUSING_POWER]] == pytest.approx(
        [drive, case.world.external_load(case.time) @ ring_rate, lost], rel=FORCES
    )


def test_normal_force_of_every_circle(case):
    assert_same(case.found.load_n, case.expected.load, FORCES, LEAST_LOAD_N)


def test_positions_follow_velocities(case):
    """Cage angles turn the cage at its angular velocity; slides, spins and ring follow their speeds."""
    where, world = layout_of(case.y), case.world
    turning = along_the_motion(case, world.slots)
    across = [np.cross(omega, np.eye(3)).T for omega in world.cage_omega(case.y)]  # across @ v = omega x v
    assert_same(turning, np.array(across) @ world.slots(case.y), QUOTIENTS)
    assert_same(along_the_motion(case, world.centres), world.centre_rates(case.y), QUOTIENTS)
    relative = case.y[where.spin] - (world.slots(case.y)[:, :, 2] * world.cage_omega(case.y)).sum(axis=1)
    assert_same(case.found.rate[where.rotation], relative, FORCES)
    assert np.array_equal(case.found.rate[where.ring], case.y[where.ring_rate])


def test_every_speed_obeys_the_forces_on_its_bodies(case):
    """Kane's equations: forces less rates of change of momenta have no power in any of the generalised speeds.

    Forces on the rollers are those of contacts and weights: slots hold rollers without friction.
    """
    world, y, where = case.world, case.y, layout_of(case.y)
    p, b, housing, n = partial_velocities(world, y), world.bodies, world.scene.housing, where.rollers

    def power(force: FloatArray, torque: FloatArray, on_ring: FloatArray) -> FloatArray:
        return np.einsum("kja,ja->k", p.centre, force) + np.einsum("kja,ja->k", p.omega, torque) + p.ring @ on_ring

    push = case.expected.force + b.roller * world.gravity()
    on_ring = world.external_load(case.time) + b.ring * world.gravity() + case.expected.on_ring
    on_ring -= world.housing_stiffness() * y[where.ring] + housing.damping_ns_m * y[where.ring_rate]
    momenta = (lambda y: b.roller * world.centre_rates(y), world.own_momenta, lambda y: b.ring * y[where.ring_rate])
    applied = power(push, case.expected.torque, on_ring)
    left = applied - power(*(along_the_motion(case, momentum) for momentum in momenta))
    cages = along_the_motion(case, world.cage_momenta)
    left[2 * n : 2 * n + 3] -= cages.sum(axis=0)
    left[2 * n + 6 :] -= world.cage_axis(y) @ cages[1]
    turning = float(np.abs(np.cross(world.centres(y), case.expected.force)).sum())  # of magnitudes that cancel
    assert left[:n] == pytest.approx(0.0, abs=QUOTIENTS * np.abs(applied[:n]).max())
    assert left[n : 2 * n] == pytest.approx(0.0, abs=QUOTIENTS * np.abs(applied[n : 2 * n]).max())
    assert left[2 * n + 3 : 2 * n + 6] == pytest.approx(0.0, abs=QUOTIENTS * np.abs(on_ring).max())
    assert np.delete(left[2 * n :], [3, 4, 5]) == pytest.approx(0.0, abs=QUOTIENTS * turning)
    quietest = np.abs(case.expected.force).sum(axis=1).argmin()  # where inertia alone moves the roller
    assert left[quietest] == pytest.approx(0.0, abs=INERTIA_N)
