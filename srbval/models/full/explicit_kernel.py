"""Kernel: explicit Runge-Kutta steps of the full model, with the outputs averaged over each interval."""

from __future__ import annotations

import numpy as np

from srbval.models.full.energy_kernel import mechanical_energy
from srbval.models.full.motion_kernel import CONTACT_VALUES, right_hand_side
from srbval.models.jit import kernel

OUTPUTS = 21  # columns of `out`, see `advance`


@kernel
def advance(y, first_step, step, steps_per_output, a, b, c, model, out, per_detail, spins, loads):
    """Advance `y` in place over ``out.shape[0]`` output intervals, from step number `first_step`.

    Columns of `out`, one row an interval: 0-2 outer ring acceleration, as change of velocity over the interval
    [m/s2]; 3-5 outer ring displacement at its end [m]; 6 cage speed, mean [rad/s]; 7-8 cage tilts at its end [rad];
    9-11 force of the rollers on the outer ring, mean [N]; 12 deepest penetration [m]; 13-17 mean powers [W]: drive,
    load, lost to friction, to contact damping, in the housing; 18-20 energy at its start [J]: bodies, contacts, housing
    spring. Powers are weighted as the method weighs its stages, so that energy closes to the method's order.

    Every `per_detail` intervals (0: never) roller spins, [k, 2 M] [rad/s], and contact loads, [k, 2, 2 M, 3] [N], are
    taken at the interval's start.
    """
    size = y.shape[0]
    stages = b.shape[0]
    half = size // 2
    turn = half - 4
    rollers = (half - 6) // 2
    rates = np.zeros((stages, size))
    trial = np.zeros(size)
    contact = np.zeros(CONTACT_VALUES)
    mean = np.zeros(CONTACT_VALUES)
    no_loads = np.zeros((0, 0, 0))
    interval = step * steps_per_output
    for i in range(out.shape[0]):
        if per_detail > 0 and i % per_detail == 0:
            taken = i // per_detail
            right_hand_side((first_step + i * steps_per_output) * step, y, model, rates[0], contact, loads[taken], None)
            spins[taken] = y[half + rollers : half + 2 * rollers]
        v0, v1, v2, turned = y[size - 3], y[size - 2], y[size - 1], y[turn]
        mean[:] = 0.0
        deepest = -1.0
        out[i, 18] = mechanical_energy(y, model)
        spring = y[half - 3] ** 2 + y[half - 2] ** 2 + y[half - 1] ** 2
        out[i, 20] = 0.5 * model.housing_stiffness * spring
        for j in range(steps_per_output):
            t = (first_step + i * steps_per_output + j) * step
            for s in range(stages):
                for m in range(size):
                    trial[m] = y[m]
                for p in range(s):
                    weight = step * a[s, p]
                    if weight != 0.0:
                        for m in range(size):
                            trial[m] += weight * rates[p, m]
                right_hand_side(t + c[s] * step, trial, model, rates[s], contact, no_loads, None)
                for m in range(CONTACT_VALUES):
                    mean[m] += b[s] * contact[m]
                deepest = max(deepest, contact[3])
                if s == 0 and j == 0:
                    out[i, 19] = contact[7]
            for s in range(stages):
                weight = step * b[s]
                for m in range(size):
                    y[m] += weight * rates[s, m]
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
        out[i, 12] = deepest
        out[i, 13] = mean[8] / steps_per_output
        out[i, 14] = mean[9] / steps_per_output
        out[i, 15] = mean[5] / steps_per_output
        out[i, 16] = mean[6] / steps_per_output
        out[i, 17] = mean[10] / steps_per_output
