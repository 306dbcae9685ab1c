"""Kernel: explicit Runge-Kutta steps of the full model, with the outputs averaged over each interval."""

from __future__ import annotations

import numpy as np

from srbval.models.full.motion_kernel import CONTACT_VALUES, right_hand_side
from srbval.models.jit import kernel

OUTPUTS = 13  # columns of `out`, see `advance`


@kernel
def advance(y, first_step, step, steps_per_output, a, b, c, model, out):
    """Advance `y` in place over ``out.shape[0]`` output intervals, from step number `first_step`.

    Columns of `out`, one row an interval: 0-2 outer ring acceleration, as change of velocity over the interval
    [m/s2]; 3-5 outer ring displacement at its end [m]; 6 cage speed, mean [rad/s]; 7-8 cage tilts at
    its end [rad]; 9-11 force of the rollers on the outer ring, mean [N]; 12 deepest penetration [m].
    """
    size = y.shape[0]
    stages = b.shape[0]
    half = size // 2
    turn = half - 4
    rates = np.zeros((stages, size))
    trial = np.zeros(size)
    contact = np.zeros(CONTACT_VALUES)
    interval = step * steps_per_output
    for i in range(out.shape[0]):
        v0, v1, v2, turned = y[size - 3], y[size - 2], y[size - 1], y[turn]
        f0 = f1 = f2 = 0.0
        deepest = -1.0
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
                right_hand_side(t + c[s] * step, trial, model, rates[s], contact)
                if s == 0:
                    f0 += contact[0]
                    f1 += contact[1]
                    f2 += contact[2]
                    deepest = max(deepest, contact[3])
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
        out[i, 9] = f0 / steps_per_output
        out[i, 10] = f1 / steps_per_output
        out[i, 11] = f2 / steps_per_output
        out[i, 12] = deepest
