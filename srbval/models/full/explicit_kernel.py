"""Kernel: an explicit Runge-Kutta step of the full model."""

from __future__ import annotations

from srbval.models.full.motion_kernel import CONTACT_VALUES, right_hand_side
from srbval.models.jit import kernel, kernel_part


@kernel_part
def runge_kutta_step(y, t, step, method, model, rates, trial, contact, no_loads, mean):
    """Advance `y` in place from time `t` by `step`; add the weighed contact values to `mean`.

    `rates`, [stages, size], and `trial`, [size]: working space. `no_loads`: empty. `mean`: see `take_mean`.
    """
    size = y.shape[0]
    a, b, c, powers = method.a, method.b, method.c, method.powers
    stages = b.shape[0]
    for s in range(stages):
        for m in range(size):
            trial[m] = y[m]
        for p in range(s):
            weight = step * a[s, p]
            if weight != 0.0:
                for m in range(size):
                    trial[m] += weight * rates[p, m]
        right_hand_side(t + c[s] * step, trial, model, rates[s], contact, no_loads, None)
        take_mean(contact, powers[s], mean, s == 0)
    for s in range(stages):
        weight = step * b[s]
        for m in range(size):
            y[m] += weight * rates[s, m]


@kernel
def take_mean(contact, weight, mean, first):
    """Add `weight` times the contact values to `mean`.

    But ``mean[3]`` becomes the deepest penetration so far, and ``mean[7]``, where it is still negative, the contacts'
    energy at the `first` evaluation.
    """
    for m in range(CONTACT_VALUES):
        if m == 3:
            mean[m] = max(mean[m], contact[m])
        elif m == 7:
            mean[m] = contact[m] if first and mean[m] < 0.0 else mean[m]
        else:
            mean[m] += weight * contact[m]
