"""Kernels: defects on the rollers' own surfaces.

A height h of the roller's surface is met as if the race's point stood h higher, along its own normal n_p. The spring
force S then also does work on the angle th from the defect to the point, d(depth) = -(n n_p) h'(th) d(th): besides
-S n a force on the roller -S (n n_p) h'(th) / rho along the direction e_th in which th grows, at the distance rho of
the race's point, follows from the spring's potential energy (virtual work: Goldstein, Poole & Safko, Classical
Mechanics, 2002, sect. 1.4).
"""

from __future__ import annotations

import math

import numpy as np

from srbval.models.full.columns import (
    A_X,
    A_Y,
    A_Z,
    B_X,
    B_Y,
    B_Z,
    DAMPING_SUMS,
    F_X,
    F_Y,
    F_Z,
    O_X,
    O_Y,
    O_Z,
    STRIDE,
    SUMS,
    T_X,
    T_Y,
    T_Z,
    Z_X,
    Z_Y,
    Z_Z,
)  # fmt: skip
from srbval.models.full.contact_kernel import contact_columns, elastic
from srbval.models.jit import kernel

FIRST_SUM, LAST_SUM, LAST_DAMPING_SUM = SUMS.start, SUMS.stop, DAMPING_SUMS.stop


@kernel
def raised_points(shape, points, race, window, spare, candidates, columns, column):
    """Fill the window `spare` of a race with a window's candidates as a damaged roller meets them.

    `shape`: see `lift_at`; the roller's frame is that of `column`.
    """
    for i in range(candidates):
        along, across, axial = points[race, window, 0, i], points[race, window, 1, i], points[race, window, 2, i]
        lift, _, _, _ = lift_at(shape, along, across, axial, columns, column)
        points[race, spare, 0, i] = along + lift * points[race, window, 4, i]
        points[race, spare, 1, i] = across + lift * points[race, window, 5, i]
        points[race, spare, 2, i] = axial + lift * points[race, window, 6, i]
        points[race, spare, 3, i] = points[race, window, 3, i]


@kernel
def lift_at(shape, along, across, axial, columns, column):
    """Height of a damaged roller's surface at a race's point [m], its rise with the angle [m/rad], point's x, y [m].

    `shape`: the rollers' radius and half the distance between their circles, all rollers' defects, shape [D, 6] (see
    `Parameters.roller_defects`), which roller, and its angle about its axis relative to its slot. A flat defect's edges
    have no rise: what they would do is left out.
    """
    roller_radius, circle_half_gap, defects, roller, turned = shape
    j = np.uint64(column)
    x = columns[O_X + j] + along * columns[A_X + j] + across * columns[B_X + j] + axial * columns[Z_X + j]
    y = columns[O_Y + j] + along * columns[A_Y + j] + across * columns[B_Y + j] + axial * columns[Z_Y + j]
    z = columns[O_Z + j] + along * columns[A_Z + j] + across * columns[B_Z + j] + axial * columns[Z_Z + j]
    lift, rise = 0.0, 0.0
    for d in range(defects.shape[0]):
        if defects[d, 0] != roller or abs(z - defects[d, 2]) > circle_half_gap:
            continue
        away = math.atan2(y, x) - turned - defects[d, 1]
        away -= 2.0 * math.pi * math.floor(away / (2.0 * math.pi) + 0.5)
        away *= roller_radius / defects[d, 4]
        if abs(away) <= 0.5:
            cosine = 0.5 + 0.5 * math.cos(2.0 * math.pi * away)
            lift += defects[d, 3] * (cosine if defects[d, 5] > 0.0 else 1.0)
            if defects[d, 5] > 0.0:
                per_radian = math.pi * roller_radius / defects[d, 4]
                rise -= defects[d, 3] * per_radian * math.sin(2.0 * math.pi * away)
    return lift, rise, x, y


@kernel
def flank_forces(law, shape, points, race, window, spare, candidates, columns, column, damping):
    """Add to a column's sums what the flanks of its roller's defects push along the race.

    `spare`: the window that `raised_points` filled from `window`. `column` is the first of an eight of its own; the
    next serves to keep its sums in. Only the spring pushes: the damper's share of the work on the angle is left out of
    force and balance alike.
    """
    j = np.uint64(column)
    kept = j + np.uint64(1)
    last_row = LAST_SUM if damping is None else LAST_DAMPING_SUM
    spring = elastic(law, 0.0)
    for i in range(candidates):
        along, across, axial = points[race, window, 0, i], points[race, window, 1, i], points[race, window, 2, i]
        _, rise, x, y = lift_at(shape, along, across, axial, columns, column)
        if rise == 0.0:
            continue
        for row in range(FIRST_SUM, last_row):
            start = np.uint64(row * STRIDE)
            columns[start + kept], columns[start + j] = columns[start + j], 0.0
        contact_columns(spring, points, race, spare, i, i + 1, columns, column, column + 1, damping, None)
        f_x, f_y, f_z = columns[F_X + j], columns[F_Y + j], columns[F_Z + j]
        for row in range(FIRST_SUM, last_row):
            start = np.uint64(row * STRIDE)
            columns[start + j], columns[start + kept] = columns[start + kept], 0.0
        n_a, n_b, n_z = points[race, window, 4, i], points[race, window, 5, i], points[race, window, 6, i]
        normal_x = n_a * columns[A_X + j] + n_b * columns[B_X + j] + n_z * columns[Z_X + j]
        normal_y = n_a * columns[A_Y + j] + n_b * columns[B_Y + j] + n_z * columns[Z_Y + j]
        normal_z = n_a * columns[A_Z + j] + n_b * columns[B_Z + j] + n_z * columns[Z_Z + j]
        z = columns[O_Z + j] + along * columns[A_Z + j] + across * columns[B_Z + j] + axial * columns[Z_Z + j]
        # e_th / rho = (-y, x) / rho^2
        push = (f_x * normal_x + f_y * normal_y + f_z * normal_z) * rise / (x * x + y * y)
        columns[F_X + j] -= push * y
        columns[F_Y + j] += push * x
        columns[T_X + j] -= z * push * x
        columns[T_Y + j] -= z * push * y
        columns[T_Z + j] += push * (x * x + y * y)
