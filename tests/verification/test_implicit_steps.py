"""One step and the next of each implicit method, against the same formulas with dense matrices.

Reason: an implicit method that is wired up wrongly still converges, only less well. Source: the methods' formulas as
their papers give them, with the mass and damping matrix of `matrices.py`, exact flow of the positions, and
`numpy.linalg`; accelerations from the model, which `test_equations_of_motion.py` holds against a second formulation.

The powers that a step records must be those of the forces that it applies, friction and damping at the speeds to which
it relaxes them: with the shaft as one more speed in u and D, drive and losses change by x's share of u D u.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from srbval.bearing import Fault
from srbval.models.full import columns as col
from tests.verification.cases import CASES, disturbed, subject
from tests.verification.harness import PAPER_STEP_S, FloatArray, Parameters, layout_of, rates, stepped
from tests.verification.matrices import damping_matrix, damping_with_shaft, mass_matrix
from tests.verification.world import World

FIRST_STEP, STEPS = 1333, 2  # some 22 ms into the run: speed and load are changing; the second step has a memory
GAMMA_ROS2, GAMMA_IMEX2 = 1 + np.sqrt(0.5), 1 - np.sqrt(0.5)
# Of each kind's change in the step. The model's matrices are the dense ones to 2e-10 (masses by slices), and a second
# step's contacts magnify that by ten.
LEAPFROG = 1e-8
# In the second stage the model turns its factors with the cage, by 35 rad/s * 1/61440 s = 6e-4, which any W-method may.
ROSENBROCK = 1e-3
# Of the largest change: the matrices' accuracy over that of a difference. In ros2 D is that of the first stage, M too.
POWERS = {"imex1": 1e-6, "imex2": 1e-6, "ros2": 1e-2}
SCENES = (
    "every force at once, changing speed and load",
    "interference, damaged roller",
    "every force at once, two cages",
)
LOSSES = [col.FRICTION_POWER, col.DAMPING_POWER, col.HOUSING_POWER]
Stepper = Callable[[Parameters, World, FloatArray, float, float, FloatArray, "list[Applied]"], FloatArray]


@dataclass(frozen=True)
class Applied:
    """A `share` of the mean force of a step: that at time `t` and state `y`, friction and damping `beyond` its speeds.

    `linear`: time and state of its damping matrix.
    """

    share: float
    t: float
    y: FloatArray
    beyond: FloatArray
    linear: tuple[float, FloatArray]

    def powers(self, model: Parameters, world: World) -> FloatArray:
        """Of drive and of all losses [W], and their part from `beyond`, [2 parts, 2]."""
        totals = rates(model, self.t, self.y).totals
        damping = damping_with_shaft(world, *self.linear)
        speeds = np.append(self.y[len(self.beyond) :], world.shaft(self.t)[0])
        more = damping @ np.append(self.beyond, 0.0)
        change = np.array([speeds[-1] * more[-1], (2 * speeds + np.append(self.beyond, 0.0)) @ more])
        at_speeds = np.array([totals[col.DRIVE_POWER], totals[LOSSES].sum()])
        return self.share * np.array([at_speeds + change, change])


def implicit_part(world: World, t: float, y: FloatArray, weight_s: float) -> tuple[FloatArray, FloatArray]:
    """J = - M^-1 D at a state, and S = (1 - `weight_s` J)^-1."""
    jacobian = -np.linalg.solve(mass_matrix(world, y), damping_matrix(world, t, y))
    return jacobian, np.linalg.inv(np.eye(len(jacobian)) - weight_s * jacobian)


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
        model: Parameters, world: World, y: FloatArray, t: float, h: float, ahead: FloatArray, applied: list[Applied]
    ) -> FloatArray:
        half, mid = layout_of(y).half, flown(y, before * h)
        damaged = any(d.kind is Fault.ROLLER for d in world.scene.defects)
        mid = rolled(world, mid, h / 2) if damaged else mid
        mid[half:] += ahead
        mid = mid if damaged else rolled(world, mid, h)  # nothing asks where they stand
        start = rates(model, t + before * h, mid).rate[half:]
        jacobian, s = implicit_part(world, t + before * h, mid, gamma * h)
        k1 = s @ (start - jacobian @ ahead)
        k2 = s @ (start + jacobian @ (h * k1 - ahead) - 2 * k1)
        change = h * sum(b * k for b, k in zip(weights, (k1, k2), strict=False))
        # where the linear force is that which the change takes: M change / h = F - D x
        beyond = np.linalg.solve(jacobian, change / h - start)
        applied.append(Applied(1.0, t + before * h, mid.copy(), beyond, (t + before * h, mid.copy())))
        mid[half:] += change - ahead
        ahead[:] = share * change
        return flown(rolled(world, mid, h / 2) if damaged else mid, (1 - before) * h)

    return step


def w_method(
    model: Parameters, world: World, y: FloatArray, t: float, h: float, _: FloatArray, applied: list[Applied]
) -> FloatArray:
    half = layout_of(y).half
    _, s = implicit_part(world, t, y, GAMMA_ROS2 * h)

    def filtered(rate: FloatArray) -> FloatArray:
        return np.concatenate([rate[:half], s @ rate[half:]])

    k1 = filtered(rates(model, t, y).rate)
    k2 = filtered(rates(model, t + h, y + h * k1).rate - 2 * k1)
    for at, state, k in ((t, y, k1), (t + h, y + h * k1, k2)):
        applied.append(Applied(0.5, at, state, GAMMA_ROS2 * h * k[half:], (t, y)))
    return y + h * (1.5 * k1 + 0.5 * k2)


METHODS: dict[str, tuple[Stepper, float]] = {
    "imex1": (leapfrog(0.0, (1.0,), 1.0, 0.0), LEAPFROG),
    "imex2": (leapfrog(0.5, (1.5, 0.5), GAMMA_IMEX2, 0.5), LEAPFROG),
    "ros2": (w_method, ROSENBROCK),
}
EACH: list[Any] = list(product(METHODS, SCENES))
EACH[-1] = pytest.param(*EACH[-1], marks=pytest.mark.long_form)  # whose kernel nothing else needs


@pytest.mark.parametrize(("method", "name"), EACH)
def test_steps_by_dense_matrices(method, name):
    scene, model, world = subject(CASES[name][0])
    start = disturbed(model, seed=2, cage_angle=scene.load.zone_rad)
    step, tolerance = METHODS[method]
    found, powers = stepped(model, start, method, step_s=PAPER_STEP_S, first=FIRST_STEP, steps=STEPS)
    expected, ahead = [start], np.zeros(len(start) // 2)
    for i in range(STEPS):
        t = (FIRST_STEP + i) * PAPER_STEP_S
        applied: list[Applied] = []
        expected.append(step(model, world, expected[-1], t, PAPER_STEP_S, ahead, applied))
        whole, change = sum(one.powers(model, world) for one in applied)
        assert powers[i] == pytest.approx(whole, abs=POWERS[method] * np.abs(change).max())
    where = layout_of(start)
    for before, after, same in zip(expected, expected[1:], found, strict=False):
        for part in where.parts:
            change = np.abs((after - before)[part]).max()
            assert same[part] == pytest.approx(after[part], abs=tolerance * change)
