"""One step and the next of each implicit method, against the same formulas with dense matrices.

Reason: an implicit method that is wired up wrongly still converges, only less well. Source: the methods' formulas as
their papers give them, with the mass and damping matrix of `matrices.py`, exact flow of the positions, and
`numpy.linalg`; accelerations from the model, which `test_equations_of_motion.py` holds against a second formulation.

The powers that a step records must be those of the forces that it applies, friction and damping at the speeds to which
it relaxes them: with the shaft as one more speed in u and D, drive and losses change by x's share of u D u.
"""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from srbval.bearing import Fault
from srbval.models.full import columns as col
from tests.verification.cases import CASES, TWO_CAGES, disturbed, in_short_form, subject
from tests.verification.harness import PAPER_STEP_S, FloatArray, Parameters, layout_of, rates, rolling_state, stepped
from tests.verification.matrices import damping_with_shaft, mass_matrix
from tests.verification.world import World

FIRST_STEP, STEPS = 1333, 2  # some 22 ms into the run: speed and load are changing; the second step has a memory
GAMMA_IMEX2 = 1 - np.sqrt(0.5)
# Of each kind's change in the step. The model's matrices are the dense ones to 2e-10 (masses by slices), and a second
# step's contacts magnify that by ten.
SAME_CHANGE = 1e-8
SAME_POWERS = 1e-6  # of the largest change: the matrices' accuracy over that of a difference
SCENES = ("every force at once, changing speed and load", "interference, damaged roller", TWO_CAGES)
LOSSES = [col.FRICTION_POWER, col.DAMPING_POWER, col.HOUSING_POWER]
# A step's end, and the powers of the force that it applies.
Stepper = Callable[[Parameters, World, FloatArray, float, float, FloatArray], tuple[FloatArray, FloatArray]]


def powers_of(
    model: Parameters, world: World, t: float, y: FloatArray, beyond: FloatArray, damping: FloatArray
) -> FloatArray:
    """Powers of the drive and of all losses [W], [2, 2]: in total, and the part that the change `beyond` adds.

    `beyond`: change of the speeds by friction and damping, whose forces are linearised with the matrix `damping`.
    """
    totals, more = rates(model, t, y).totals, np.append(beyond, 0.0)
    speeds, change_n = np.append(y[len(beyond) :], world.shaft(t)[0]), damping @ more
    change = np.array([speeds[-1] * change_n[-1], (2 * speeds + more) @ change_n])
    at_speeds = np.array([totals[col.DRIVE_POWER], totals[LOSSES].sum()])
    return np.array([at_speeds + change, change])


def implicit_part(world: World, t: float, y: FloatArray, weight_s: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """D with the shaft, J = - M^-1 D at a state, and S = (1 - `weight_s` J)^-1."""
    damping = damping_with_shaft(world, t, y)
    jacobian = -np.linalg.solve(mass_matrix(world, y), damping[:-1, :-1])
    return damping, jacobian, np.linalg.inv(np.eye(len(jacobian)) - weight_s * jacobian)


def flown(y: FloatArray, seconds: float) -> FloatArray:
    """Slides, cage and ring where constant velocities bring them: the cage turns about its axis of rotation."""
    where, on = layout_of(y), y.copy()
    on[where.slide] += seconds * y[where.slide_rate]
    on[where.ring] += seconds * y[where.ring_rate]
    on[where.relative_angle] += seconds * y[where.relative_rate]
    turned = Rotation.from_rotvec(seconds * y[where.cage_rate]) * Rotation.from_euler("XYZ", y[where.cage])
    on[where.cage] = turned.as_euler("XYZ")
    return on


def rolled(world: World, y: FloatArray, seconds: float) -> FloatArray:
    """Rollers turned on relative to their slots."""
    where, on = layout_of(y), y.copy()
    on[where.rotation] += seconds * (y[where.spin] - (world.slots(y)[:, :, 2] * world.cage_omega(y)).sum(axis=1))
    return on


def leapfrog(before: float, weights: tuple[float, ...], gamma: float, share: float) -> Stepper:
    def step(
        model: Parameters, world: World, y: FloatArray, t: float, h: float, ahead: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        half, at, mid = layout_of(y).half, t + before * h, flown(y, before * h)
        damaged = any(d.kind is Fault.ROLLER for d in world.scene.defects)
        mid = rolled(world, mid, h / 2) if damaged else mid
        mid[half:] += ahead
        mid = mid if damaged else rolled(world, mid, h)  # nothing asks where they stand
        start = rates(model, at, mid).rate[half:]
        damping, jacobian, s = implicit_part(world, at, mid, gamma * h)
        k1 = s @ (start - jacobian @ ahead)
        k2 = s @ (start + jacobian @ (h * k1 - ahead) - 2 * k1)
        change = h * sum(b * k for b, k in zip(weights, (k1, k2), strict=False))
        # where the linear force is that which the change takes: M change / h = F - D x
        beyond = np.linalg.solve(jacobian, change / h - start)
        powers = powers_of(model, world, at, mid, beyond, damping)
        mid[half:] += change - ahead
        ahead[:] = share * change
        return flown(rolled(world, mid, h / 2) if damaged else mid, (1 - before) * h), powers

    return step


METHODS: dict[str, Stepper] = {
    "imex1": leapfrog(0.0, (1.0,), 1.0, 0.0),
    "imex2": leapfrog(0.5, (1.5, 0.5), GAMMA_IMEX2, 0.5),
}


@pytest.mark.parametrize("name", in_short_form(SCENES))
@pytest.mark.parametrize("method", METHODS)
def test_steps_by_dense_matrices(method, name):
    model, world = subject(CASES[name][0])
    start = disturbed(rolling_state(model), seed=2, cage_angle=world.scene.load.zone_rad)
    found, powers = stepped(model, start, method, step_s=PAPER_STEP_S, first=FIRST_STEP, steps=STEPS)
    expected, ahead = [start], np.zeros(len(start) // 2)
    for i in range(STEPS):
        t = (FIRST_STEP + i) * PAPER_STEP_S
        after, (whole, change) = METHODS[method](model, world, expected[-1], t, PAPER_STEP_S, ahead)
        expected.append(after)
        assert powers[i] == pytest.approx(whole, abs=SAME_POWERS * np.abs(change).max())
    where = layout_of(start)
    for before, after, same in zip(expected, expected[1:], found, strict=False):
        for part in where.parts:
            change = np.abs((after - before)[part]).max()
            assert same[part] == pytest.approx(after[part], abs=SAME_CHANGE * change)
