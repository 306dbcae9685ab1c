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
from tests.verification.cases import CASES, Case, make_case
from tests.verification.harness import FloatArray, layout_of

# Two ways of finding 10 um of penetration in lengths of 0.16 m differ by rounding of 2e-16 * 0.16 / 1e-5 = 4e-12, and
# the model's series for the distance by (depth / 0.16 m)^3; friction's slope multiplies both.
FORCES = 1e-9
# Difference quotients of momenta over 2e-6 s lose some 1e-16 / 1e-6 of values that are a hundredth of their rates.
QUOTIENTS = 1e-7
SPAN_S = 1e-6
INERTIA_N = 1e-4  # difference quotients of the lightest roller's momentum
LEAST_LOAD_N = 100.0  # the state must press some rollers, or nothing is tested


@pytest.fixture(params=CASES, scope="module")
def case(request: pytest.FixtureRequest) -> Case:
    return make_case(request.param)


def along_the_motion(case: Case, function: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Rate of change of a function of the state, fourth-order difference along the model's rates."""
    y, rate = case.y, case.found.rate
    near, far = (function(y + k * SPAN_S * rate) - function(y - k * SPAN_S * rate) for k in (1, 2))
    return (8 * near - far) / (12 * SPAN_S)


def assert_same(found: FloatArray, expected: FloatArray, tolerance: float, least: float = 0.0) -> None:
    scale = float(np.abs(expected).max())
    assert scale > least
    assert found == pytest.approx(expected, abs=tolerance * scale)


def test_force_on_the_outer_ring(case: Case) -> None:
    assert_same(case.found.totals[col.RING_FORCE], case.expected.on_ring, FORCES, LEAST_LOAD_N)


def test_torque_on_the_shaft(case: Case) -> None:
    """Force and arm at every point of the inner race, about the shaft's axis."""
    assert case.found.totals[col.SHAFT_TORQUE] == pytest.approx(case.expected.on_shaft, rel=FORCES)


def test_losses_and_stored_energy(case: Case) -> None:
    expected = [case.expected.rubbed, case.expected.damped, case.expected.stored]
    found = case.found.totals[[col.FRICTION_POWER, col.DAMPING_POWER, col.CONTACT_ENERGY]]
    assert found == pytest.approx(expected, rel=FORCES)


def test_powers_of_drive_load_and_housing(case: Case) -> None:
    """Torque times speed, force times speed, damper's force times speed."""
    ring_rate = case.y[layout_of(case.y).ring_rate]
    drive = -case.expected.on_shaft * case.world.shaft(case.time)[0]
    lost = case.world.scene.housing.damping_ns_m * ring_rate @ ring_rate
    assert case.found.totals[[col.DRIVE_POWER, col.LOAD_POWER, col.HOUSING_POWER]] == pytest.approx(
        [drive, case.world.external_load(case.time) @ ring_rate, lost], rel=FORCES
    )


def test_normal_force_of_every_circle(case: Case) -> None:
    assert_same(case.found.load_n, case.expected.load, FORCES, LEAST_LOAD_N)


def test_positions_follow_velocities(case: Case) -> None:
    """Cage angles turn the cage at its angular velocity; slides, spins and ring follow their speeds."""
    where, world = layout_of(case.y), case.world
    turning = along_the_motion(case, world.slots)
    across = [np.cross(omega, np.eye(3)).T for omega in world.cage_omega(case.y)]  # across @ v = omega x v
    assert_same(turning, np.array(across) @ world.slots(case.y), QUOTIENTS)
    assert_same(along_the_motion(case, world.centres), world.centre_rates(case.y), QUOTIENTS)
    relative = case.y[where.spin] - (world.slots(case.y)[:, :, 2] * world.cage_omega(case.y)).sum(axis=1)
    assert_same(case.found.rate[where.rotation], relative, FORCES)
    assert np.array_equal(case.found.rate[where.ring], case.y[where.ring_rate])


def test_rollers_slide_by_the_force_along_their_slots(case: Case) -> None:
    """m d(velocity)/dt along the slot = contact force and weight along it: the slot holds without friction."""
    world, slot = case.world, case.world.slots(case.y)[:, :, 0]
    push = case.expected.force + world.bodies.roller * world.gravity()
    found = world.bodies.roller * (along_the_motion(case, world.centre_rates) * slot).sum(axis=1)
    assert_same(found, (push * slot).sum(axis=1), QUOTIENTS)
    quietest = np.abs(case.expected.force).sum(axis=1).argmin()  # where inertia alone moves the roller
    assert found[quietest] == pytest.approx(push[quietest] @ slot[quietest], abs=INERTIA_N)


def test_rollers_spin_by_the_torque_about_their_axes(case: Case) -> None:
    where, axis = layout_of(case.y), case.world.slots(case.y)[:, :, 2]
    torque = (case.expected.torque * axis).sum(axis=1)
    assert_same(case.world.bodies.roller_axial * case.found.rate[where.spin], torque, FORCES)


def test_angular_momentum_of_cage_and_rollers(case: Case) -> None:
    """Contacts and weights are all that turns cage and rollers about the bearing centre."""
    world, centres = case.world, case.world.centres(case.y)
    push = case.expected.force + world.bodies.roller * world.gravity()
    torque = (np.cross(centres, push) + case.expected.torque).sum(axis=0)
    assert along_the_motion(case, world.momentum) == pytest.approx(torque, abs=QUOTIENTS * largest_torque(case))


def test_the_second_cage_turns_by_the_torque_of_its_rollers(case: Case) -> None:
    """Kane's equation of the lead: partial velocities t x r of a roller's centre, t across its axis of its rotation."""
    world, second = case.world, case.world.side < 0
    axis, own, centres = world.cage_axis(case.y), world.slots(case.y)[:, :, 2], world.centres(case.y)[second]
    across = axis - (own @ axis)[second, None] * own[second]

    def torque(force: FloatArray, about: FloatArray) -> float:
        return float((np.cross(centres, force) @ axis).sum() + (about * across).sum())

    push = case.expected.force + world.bodies.roller * world.gravity()
    found = torque(
        along_the_motion(case, lambda y: world.lead_momentum(y)[0]),
        along_the_motion(case, lambda y: world.lead_momentum(y)[1]),
    )
    found += axis @ along_the_motion(case, lambda y: world.lead_momentum(y)[2])
    left = abs(found - torque(push[second], case.expected.torque[second]))
    # with one cage, row 1 drives row 2 or holds it back
    assert (left <= QUOTIENTS * largest_torque(case)) == (layout_of(case.y).relative_rate.start < len(case.y))


def largest_torque(case: Case) -> float:
    """Sum of the magnitudes that cancel in the balance of angular momentum [N m]."""
    return float(np.abs(np.cross(case.world.centres(case.y), case.expected.force)).sum())


def test_outer_ring_between_rollers_load_and_housing(case: Case) -> None:
    where, world, housing = layout_of(case.y), case.world, case.world.scene.housing
    ring, ring_rate = case.y[where.ring], case.y[where.ring_rate]
    force = world.external_load(case.time) + world.bodies.ring * world.gravity() + case.expected.on_ring
    force -= world.housing_stiffness() * ring + housing.damping_ns_m * ring_rate
    assert_same(world.bodies.ring * case.found.rate[where.ring_rate], force, FORCES)
