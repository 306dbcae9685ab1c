"""Kernel: steps of the full model by any method, with the outputs averaged over each interval."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from srbval.models.full.damping_kernel import BORDER
from srbval.models.full.energy_kernel import mechanical_energy
from srbval.models.full.explicit_kernel import runge_kutta_step
from srbval.models.full.implicit_kernel import leapfrog_step, rosenbrock_step
from srbval.models.full.motion_kernel import CONTACT_VALUES, right_hand_side
from srbval.models.jit import kernel
from srbval.models.solvers.method import ROSENBROCK, RUNGE_KUTTA

FloatArray = NDArray[np.float64]
OUTPUTS = 21  # columns of `out`, see `advance`


def working_space(size: int, stages: int) -> tuple[FloatArray, ...]:
    """Arrays for `advance` and a state of `size` values: rates, trial, border, contact, mean, frozen, no loads."""
    return (
        np.zeros((max(2, stages), size)), np.zeros(size), np.zeros((BORDER, BORDER)),
        np.zeros(CONTACT_VALUES), np.zeros(CONTACT_VALUES), np.zeros(CONTACT_VALUES), np.zeros((0, 0, 0)),
    )  # fmt: skip


@kernel
def advance(y, ahead, first_step, step, steps_per_output, method, model, work, out, per_detail, spins, loads):
    """Advance `y` in place over ``out.shape[0]`` output intervals, from step number `first_step`.

    `ahead`, [size]: what a leapfrog remembers of the step before; zeros at the start of a run. `work`: see
    `working_space`.

    Columns of `out`, one row an interval: 0-2 outer ring acceleration, as change of velocity over the interval
    [m/s2]; 3-5 outer ring displacement at its end [m]; 6 cage speed, mean [rad/s]; 7-8 cage tilts at its end [rad];
    9-11 force of the rollers on the outer ring, mean [N]; 12 deepest penetration [m]; 13-17 mean powers [W]: drive,
    load, lost to friction, to contact damping, in the housing; 18-20 energy at its start [J]: bodies, contacts (at the
    first evaluation), housing spring. Powers are weighed as the method weighs its stages, so that energy closes to the
    method's order.

    Every `per_detail` intervals (0: never) roller spins, [k, 2 M] [rad/s], and contact loads, [k, 2, 2 M, 3] [N], are
    taken at the interval's start.
    """
    size = y.shape[0]
    half = size // 2
    turn = half - 4
    rollers = (half - 6) // 2
    rates, trial, border, contact, mean, frozen, no_loads = work
    first, second = rates[0], rates[1]
    b, gamma, before, share = method.b, method.gamma, method.c[0], method.ahead
    interval = step * steps_per_output
    for i in range(out.shape[0]):
        if per_detail > 0 and i % per_detail == 0:
            at = i // per_detail
            t = (first_step + i * steps_per_output) * step
            right_hand_side(t, y, model, rates[0], contact, loads[at], None)
            for j in range(rollers):
                spins[at, j] = y[half + rollers + j]
        v0, v1, v2, turned = y[size - 3], y[size - 2], y[size - 1], y[turn]
        for m in range(CONTACT_VALUES):
            mean[m] = 0.0
        mean[3] = mean[7] = -1.0
        out[i, 18] = mechanical_energy(y, model)
        spring = y[half - 3] ** 2 + y[half - 2] ** 2 + y[half - 1] ** 2
        out[i, 20] = 0.5 * model.housing_stiffness * spring
        for j in range(steps_per_output):
            t = (first_step + i * steps_per_output + j) * step
            if method.family == RUNGE_KUTTA:
                runge_kutta_step(y, t, step, method, model, rates, trial, contact, no_loads, mean)
            elif method.family == ROSENBROCK:
                rosenbrock_step(y, t, step, method, model, rates, trial, contact, no_loads, mean, border, frozen)
            else:
                leapfrog_step(
                    y, t, step, b, gamma, before, share, model, first, second, contact, no_loads, mean, border, ahead
                )  # fmt: skip
        out[i, 0] = (y[size - 3] - v0) / interval
        out[i, 1] = (y[size - 2] - v1) / interval
        out[i, 2] = (y[size - 1] - v2) / interval
        out[i, 3] = y[half - 3]
        out[i, 4] = y[half - 2]
        out[i, 5] = y[half - 1]
        out[i, 6] = (y[turn] - turned) / interval
        out[i, 7] = y[turn - 2]
        out[i, 8] = y[turn - 1]
        for m in range(3):
            out[i, 9 + m] = mean[m] / steps_per_output
        out[i, 12] = mean[3]
        out[i, 13] = mean[8] / steps_per_output
        out[i, 14] = mean[9] / steps_per_output
        out[i, 15] = mean[5] / steps_per_output
        out[i, 16] = mean[6] / steps_per_output
        out[i, 17] = mean[10] / steps_per_output
        out[i, 19] = mean[7]
