"""Kernels: what drives the bearing from outside, as functions of time."""

import numpy as np

from srbval.models.jit import kernel


@kernel
def shaft_motion(t, drive):
    """Speed and angle of the shaft at time `t`: linear between the table's entries, constant outside."""
    table = drive.speed
    last = table.shape[1] - 1
    if t <= table[0, 0]:
        return table[1, 0], table[2, 0] + table[1, 0] * (t - table[0, 0])
    if t >= table[0, last]:
        return table[1, last], table[2, last] + table[1, last] * (t - table[0, last])
    i = np.searchsorted(table[0], t) - 1
    since = t - table[0, i]
    slope = (table[1, i + 1] - table[1, i]) / (table[0, i + 1] - table[0, i])
    return table[1, i] + slope * since, table[2, i] + (table[1, i] + 0.5 * slope * since) * since


@kernel
def external_load(t, drive):
    """Radial and axial load at time `t`: linear between the table's entries, constant outside."""
    table = drive.load
    last = table.shape[1] - 1
    if t <= table[0, 0]:
        return table[1, 0], table[2, 0]
    if t >= table[0, last]:
        return table[1, last], table[2, last]
    i = np.searchsorted(table[0], t) - 1
    share = (t - table[0, i]) / (table[0, i + 1] - table[0, i])
    return table[1, i] + share * (table[1, i + 1] - table[1, i]), table[2, i] + share * (table[2, i + 1] - table[2, i])
