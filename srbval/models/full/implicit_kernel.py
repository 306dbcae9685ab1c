"""Kernels: steps of the full model that take friction and contact damping implicitly, see `damping_kernel`."""

from __future__ import annotations

import math

import numpy as np

from srbval.models.full.columns import Z_WX, Z_WY, Z_WZ
from srbval.models.full.damping_kernel import factor, solve
from srbval.models.full.explicit_kernel import take_mean
from srbval.models.full.motion_kernel import right_hand_side
from srbval.models.jit import kernel


@kernel
def rosenbrock_step(y, t, step, method, model, u, trial, contact, mean, border, frozen):
    """Advance `y` in place from time `t` by `step`; add the weighed contact values to `mean`.

    `u`, [stages, size], `trial`, [size], `border`, [6, 6], and `frozen`, the contact values that the factors belong to:
    working space.
    """
    size = y.shape[0]
    a, b, c, g, powers, gamma = method.a, method.b, method.c, method.g, method.powers, method.gamma
    no_loads = contact[:0].reshape((0, 0, 0))
    for s in range(b.shape[0]):
        for m in range(size):
            trial[m] = y[m]
        for p in range(s):
            for m in range(size):
                trial[m] += a[s, p] * u[p, m]
        if s == 0:
            right_hand_side(t, trial, model, u[s], contact, no_loads, 1)
            factor(gamma * step, model, contact, border)
            frozen[:] = contact
        else:
            right_hand_side(t + c[s] * step, trial, model, u[s], contact, no_loads, None)
        take_mean(contact, powers[s], mean, s == 0)
        for p in range(s):
            weight = g[s, p] / step
            for m in range(size):
                u[s, m] += weight * u[p, m]
        solve(model, frozen, border, u[s])
        for m in range(size):
            u[s, m] *= gamma * step
    for s in range(b.shape[0]):
        for m in range(size):
            y[m] += b[s] * u[s, m]


@kernel
def leapfrog_step(y, t, step, method, model, rates, contact, mean, border, ahead):
    """Advance `y` in place from time `t` by `step`; add the contact values to `mean`; see `rosenbrock_step`.

    `ahead`, [size]: what the velocities are predicted to change by up to where forces are linear; renewed for the next
    step. With x the velocities less the predicted ones, a their accelerations and J the damping, the equation is
    x' = a + J x from x = -ahead. The rollers' angles about their axes are moved in the middle, with the mean of both
    velocities: only a damaged roller's contacts know them.
    """
    size = y.shape[0]
    half = size // 2
    b, gamma, before, share = method.b, method.gamma, method.c[0], method.ahead
    no_loads = contact[:0].reshape((0, 0, 0))
    per = 1.0 / (gamma * step)
    first, second = rates[0], rates[1]
    drift(y, before * step)
    turn_rollers(y, 0.5 * step, model)
    for m in range(half, size):
        y[m] += ahead[m]
    right_hand_side(t + before * step, y, model, first, contact, no_loads, 1)
    factor(gamma * step, model, contact, border)
    take_mean(contact, 1.0, mean, True)
    # J x = (S x - x) / (gamma h), S = (1 - gamma h J)^-1
    for m in range(half, size):
        second[m] = first[m]
        first[m] -= ahead[m] * per
    solve(model, contact, border, first)
    if b.shape[0] == 1:
        for m in range(half, size):
            first[m] = b[0] * (first[m] + ahead[m] * per)
    else:
        for m in range(half, size):
            first[m] += ahead[m] * per
            second[m] += (step * first[m] - ahead[m]) * per - 2.0 * first[m]
        solve(model, contact, border, second)
        for m in range(half, size):
            own = second[m] - (step * first[m] - ahead[m]) * per
            first[m] = b[0] * first[m] + b[1] * own
    for m in range(half, size):
        y[m] += step * first[m] - ahead[m]
        ahead[m] = share * step * first[m]
    turn_rollers(y, 0.5 * step, model)
    drift(y, (1.0 - before) * step)


@kernel
def drift(y, step):
    """Move slides, cage and ring on for `step` [s] with the velocities there are."""
    half = y.shape[0] // 2
    n = (half - 6) // 2
    for j in range(n):
        y[j] += step * y[half + j]
    c = 2 * n
    ca, sa = math.cos(y[c]), math.sin(y[c])
    cb, sb = math.cos(y[c + 1]), math.sin(y[c + 1])
    w_y = ca * y[half + c + 1] + sa * y[half + c + 2]
    w_z = ca * y[half + c + 2] - sa * y[half + c + 1]
    y[c] += step * (y[half + c] - w_z * sb / cb)
    y[c + 1] += step * w_y
    y[c + 2] += step * w_z / cb
    for m in range(3):
        y[c + 3 + m] += step * y[half + c + 3 + m]


@kernel
def turn_rollers(y, step, model):
    """Turn the rollers on for `step` [s], relative to their slots."""
    half = y.shape[0] // 2
    n = (half - 6) // 2
    space = model.scratch.space
    w_x, w_y, w_z = y[half + 2 * n], y[half + 2 * n + 1], y[half + 2 * n + 2]
    for i in range(n // 2):
        place = np.uint64(2 * i)
        for row in range(2):
            j = i + row * (n // 2)
            about = space[Z_WX + place] * w_x + space[Z_WY + place] * w_y + space[Z_WZ + place] * w_z
            y[n + j] += step * (y[half + n + j] - about)
            place += np.uint64(1)
