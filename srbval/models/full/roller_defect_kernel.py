"""Kernels: defects on the rollers' own surfaces.

A height h of the roller's surface is met as if the race's point stood h higher, along its own normal n_p. The spring
force S then also does work on the angle th from the defect to the point, d(depth) = -(n n_p) h'(th) d(th): besides
-S n a force on the roller -S (n n_p) h'(th) / rho along the direction e_th in which th grows, at the distance rho of
the race's point, follows from the spring's potential energy (virtual work: Goldstein, Poole & Safko, Classical
Mechanics, 2002, sect. 1.4).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from srbval.models.full import columns as col
from srbval.models.full.contact_kernel import Candidates, contact_columns, elastic, place_of_point
from srbval.models.jit import kernel


class RollerSurface(NamedTuple):
    """Surface of one damaged roller.

    `radius` at its middle and half the distance between two circles along it [m], all rollers' `defects`, shape
    [D, col.DEFECT_COLUMNS], number of the `roller`, and its `rotation` about its axis relative to its slot [rad].
    """

    radius: float
    circle_half_gap: float
    defects: Any
    roller: int
    rotation: float


@kernel
def raised_points(surface, candidates, spare, space, column):
    """Fill the window `spare` of a race with candidates as a damaged roller meets them in the frame of `column`."""
    points, race, window, first, last = candidates
    for i in range(first, last):
        radial, tangential = points[race, window, col.POINT_RADIAL, i], points[race, window, col.POINT_TANGENTIAL, i]
        axial = points[race, window, col.POINT_AXIAL, i]
        p_x, p_y, p_z = place_of_point(radial, tangential, axial, space, np.uint64(column))
        lift, _ = lift_at(surface, p_x, p_y, p_z)
        points[race, spare, col.POINT_RADIAL, i] = radial + lift * points[race, window, col.NORMAL_RADIAL, i]
        points[race, spare, col.POINT_TANGENTIAL, i] = (
            tangential + lift * points[race, window, col.NORMAL_TANGENTIAL, i]
        )
        points[race, spare, col.POINT_AXIAL, i] = axial + lift * points[race, window, col.NORMAL_AXIAL, i]
        points[race, spare, col.POINT_SHARE, i] = points[race, window, col.POINT_SHARE, i]


@kernel
def lift_at(surface, x, y, z):
    """Height of a damaged roller's surface at a point in its slot axes [m], and its rise with the angle [m/rad].

    The edges of a flat defect have no rise: their effect is left out.
    """
    radius, circle_half_gap, defects, roller, rotation = surface
    lift, rise = 0.0, 0.0
    for d in range(defects.shape[0]):
        if defects[d, col.DEFECT_ROLLER] != roller or abs(z - defects[d, col.DEFECT_AXIAL]) > circle_half_gap:
            continue
        away = math.atan2(y, x) - rotation - defects[d, col.DEFECT_ANGLE]
        away -= 2.0 * math.pi * math.floor(away / (2.0 * math.pi) + 0.5)
        away *= radius / defects[d, col.DEFECT_EXTENT]
        if abs(away) <= 0.5:
            cosine = 0.5 + 0.5 * math.cos(2.0 * math.pi * away)
            lift += defects[d, col.DEFECT_HEIGHT] * (cosine if defects[d, col.DEFECT_COSINE] > 0.0 else 1.0)
            if defects[d, col.DEFECT_COSINE] > 0.0:
                per_radian = math.pi * radius / defects[d, col.DEFECT_EXTENT]
                rise -= defects[d, col.DEFECT_HEIGHT] * per_radian * math.sin(2.0 * math.pi * away)
    return lift, rise


@kernel
def flank_forces(law, surface, candidates, spare, space, column, damping):
    """Add the forces along the race of the flanks of a roller's defects to the sums of its `column`.

    `spare`: the window that `raised_points` filled from the candidates. `column` is the first of a lane group of its
    own; the next one stores its sums meanwhile. Only the spring pushes: the damper's share of the work on the angle is
    left out of force and energy balance alike.
    """
    points, race, window, first, last = candidates
    j = np.uint64(column)
    store = j + np.uint64(1)
    last_row = col.LAST_SUM if damping is None else col.LAST_DAMPING_SUM
    spring = elastic(law, 0.0)
    for i in range(first, last):
        x, y, z = place_of_point(
            points[race, window, col.POINT_RADIAL, i], points[race, window, col.POINT_TANGENTIAL, i],
            points[race, window, col.POINT_AXIAL, i], space, j,
        )  # fmt: skip
        _, rise = lift_at(surface, x, y, z)
        if rise == 0.0:
            continue
        for row in range(col.FIRST_SUM, last_row):
            start = np.uint64(row * col.STRIDE)
            space[start + store], space[start + j] = space[start + j], 0.0
        contact_columns(spring, Candidates(points, race, spare, i, i + 1), space, column, column + 1, damping, None)
        f_x, f_y, f_z = space[col.F_X + j], space[col.F_Y + j], space[col.F_Z + j]
        for row in range(col.FIRST_SUM, last_row):
            start = np.uint64(row * col.STRIDE)
            space[start + j], space[start + store] = space[start + store], 0.0
        n_a, n_b = points[race, window, col.NORMAL_RADIAL, i], points[race, window, col.NORMAL_TANGENTIAL, i]
        n_z = points[race, window, col.NORMAL_AXIAL, i]
        normal_x = n_a * space[col.A_X + j] + n_b * space[col.B_X + j] + n_z * space[col.Z_X + j]
        normal_y = n_a * space[col.A_Y + j] + n_b * space[col.B_Y + j] + n_z * space[col.Z_Y + j]
        normal_z = n_a * space[col.A_Z + j] + n_b * space[col.B_Z + j] + n_z * space[col.Z_Z + j]
        # e_th / rho = (-y, x) / rho^2
        push = (f_x * normal_x + f_y * normal_y + f_z * normal_z) * rise / (x * x + y * y)
        space[col.F_X + j] -= push * y
        space[col.F_Y + j] += push * x
        space[col.T_X + j] -= z * push * x
        space[col.T_Y + j] -= z * push * y
        space[col.T_Z + j] += push * (x * x + y * y)
