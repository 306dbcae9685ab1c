"""Kernels: steps of the full model that take friction and contact damping implicitly, see `damping_kernel`."""

from __future__ import annotations

import math

import numpy as np

from srbval.models.full.columns import SIDE, SLOT_COSINE, SLOT_SINE
from srbval.models.full.damping_kernel import factor, solve
from srbval.models.full.explicit_kernel import take_mean
from srbval.models.full.motion_kernel import right_hand_side
from srbval.models.jit import kernel, kernel_part


@kernel_part
def rosenbrock_step(y, t, step, method, model, u, trial, contact, no_loads, mean, border, frozen):
    """Advance `y` in place from time `t` by `step`; add the weighed contact values to `mean`.

    `u`, [stages, size], `trial`, [size], `border`, [6, 6], and `frozen`, the contact values that the factors belong to:
    working space.
    """
    size = y.shape[0]
    a, b, c, g, powers, gamma = method.a, method.b, method.c, method.g, method.powers, method.gamma
    for s in range(b.shape[0]):
        for m in range(size):
            trial[m] = y[m]
        for p in range(s):
            for m in range(size):
                trial[m] += a[s, p] * u[p, m]
        right_hand_side(t + c[s] * step, trial, model, u[s], contact, no_loads, 1)
        if s == 0:
            factor(gamma * step, model, contact, border)
            for m in range(frozen.shape[0]):
                frozen[m] = contact[m]
        take_mean(contact, powers[s], mean, s == 0)
        for p in range(s):
            weight = g[s, p] / step
            for m in range(size):
                u[s, m] += weight * u[p, m]
        solve(gamma * step, model, frozen, border, u[s])
        for m in range(size):
            u[s, m] *= gamma * step
    for s in range(b.shape[0]):
        for m in range(size):
            y[m] += b[s] * u[s, m]


@kernel_part
def leapfrog_step(y, t, step, b, gamma, before, share, model, first, second, contact, no_loads, mean, border, ahead):
    """Advance `y` in place from time `t` by `step`; add the contact values to `mean`.

    `b`, `gamma`, `before` (the one time in `c`) and `share` (`ahead`): see `Coefficients`; they come one by one because
    a tuple with arrays would have each of them counted. `first`, `second`, [size], and `border`: working space.

    `ahead`, [size]: what the velocities are predicted to change by up to where forces are linear; renewed for the next
    step. With x the velocities less the predicted ones, a their accelerations and J the damping, the equation is
    x' = a + J x from x = -ahead. The rollers' angles about their axes are moved in the middle, with the mean of both
    velocities; where no roller is damaged, nothing asks for them there and the predicted velocities serve.
    """
    size = y.shape[0]
    first_rate, end = np.uint64(size // 2), np.uint64(size)
    per = 1.0 / (gamma * step)
    damaged = model.roller_defects.shape[0] > 0
    drift(y, before * step)
    if damaged:
        turn_rollers(y, 0.5 * step, model)
    for m in range(first_rate, end):
        y[m] += ahead[m]
    right_hand_side(t + before * step, y, model, first, contact, no_loads, 1)
    factor(gamma * step, model, contact, border)
    take_mean(contact, 1.0, mean, True)
    if not damaged:
        rollers = (first_rate - np.uint64(6)) // np.uint64(2)
        for m in range(rollers, np.uint64(2) * rollers):
            y[m] += step * first[m]
    # J x = (S x - x) / (gamma h), S = (1 - gamma h J)^-1
    for m in range(first_rate, end):
        second[m] = first[m]
        first[m] -= ahead[m] * per
    solve(gamma * step, model, contact, border, first)
    if b.shape[0] == 1:
        for m in range(first_rate, end):
            first[m] = b[0] * (first[m] + ahead[m] * per)
    else:
        for m in range(first_rate, end):
            first[m] += ahead[m] * per
            second[m] += (step * first[m] - ahead[m]) * per - 2.0 * first[m]
        solve(gamma * step, model, contact, border, second)
        for m in range(first_rate, end):
            own = second[m] - (step * first[m] - ahead[m]) * per
            first[m] = b[0] * first[m] + b[1] * own
    for m in range(first_rate, end):
        rise = step * first[m]
        y[m] += rise - ahead[m]
        ahead[m] = share * rise
    if damaged:
        turn_rollers(y, 0.5 * step, model)
    drift(y, (1.0 - before) * step)


@kernel
def drift(y, step):
    """Move slides, cage and ring on for `step` [s] with the velocities there are: the cage by the midpoint rule."""
    half = y.shape[0] // 2
    n = (half - 6) // 2
    for j in range(n):
        y[j] += step * y[half + j]
    c = 2 * n
    w_x, w_y, w_z = y[half + c], y[half + c + 1], y[half + c + 2]
    rate_x, rate_y, _ = gimbal_rates(y[c], y[c + 1], w_x, w_y, w_z)
    rate_x, rate_y, rate_z = gimbal_rates(y[c] + 0.5 * step * rate_x, y[c + 1] + 0.5 * step * rate_y, w_x, w_y, w_z)
    y[c] += step * rate_x
    y[c + 1] += step * rate_y
    y[c + 2] += step * rate_z
    for m in range(3):
        y[c + 3 + m] += step * y[half + c + 3 + m]


@kernel
def gimbal_rates(tilt_x, tilt_y, w_x, w_y, w_z):
    """Rates of the cage's three gimbal angles at its first two and its angular velocity, world axes [rad/s]."""
    c, s = math.cos(tilt_x), math.sin(tilt_x)
    about = (c * w_z - s * w_y) / math.cos(tilt_y)
    return w_x - about * math.sin(tilt_y), c * w_y + s * w_z, about


@kernel
def turn_rollers(y, step, model):
    """Turn the rollers on for `step` [s], relative to their slots as they stand in `y`."""
    half = y.shape[0] // 2
    n = (half - 6) // 2
    space = model.scratch.space
    tilt_x, tilt_y, turn = y[2 * n], y[2 * n + 1], y[2 * n + 2]
    w_x, w_y, w_z = y[half + 2 * n], y[half + 2 * n + 1], y[half + 2 * n + 2]
    ca, sa = math.cos(tilt_x), math.sin(tilt_x)
    cb, sb = math.cos(tilt_y), math.sin(tilt_y)
    ct, st = math.cos(turn), math.sin(turn)
    # the cage's angular velocity in its own tilted axes, and the part of it along each roller's axis
    along, about_y = ca * w_z - sa * w_y, ca * w_y + sa * w_z
    about_x, along = cb * w_x - sb * along, model.tilt_cosine * (sb * w_x + cb * along)
    p_c, p_s = model.tilt_sine * (ct * about_x + st * about_y), model.tilt_sine * (ct * about_y - st * about_x)
    for row in range(2):
        own, speed = n + row * (n // 2), half + n + row * (n // 2)
        for i in range(np.uint64(n // 2)):
            place = np.uint64(2) * i + np.uint64(row)
            across = space[SLOT_COSINE + place] * p_c + space[SLOT_SINE + place] * p_s
            y[np.uint64(own) + i] += step * (y[np.uint64(speed) + i] - along + space[SIDE + place] * across)
