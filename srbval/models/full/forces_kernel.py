"""Kernels: forces of all contacts between rollers and races, damaged rollers included.

A piece of roller surface raised by h acts as if the race's point were higher by h along the race's normal.
"""

import math

import numpy as np

from srbval.models.full import columns as col
from srbval.models.full.contact_kernel import contact_columns, place_of_point, with_friction
from srbval.models.full.frames_kernel import roller_in
from srbval.models.full.search_kernel import scatter_sums
from srbval.models.full.slices_kernel import evaluate_slices
from srbval.models.full.vectors_kernel import plus, point_at
from srbval.models.jit import kernel_part

CIRCLES_PER_RACE = 3
FIRST_TIME = 1  # for `evaluate_contacts`; None: the plan's single columns are set up already


@kernel_part
def evaluate_contacts(law, rotation, model, groups, single, first_circle, end_circle, damping, first_time):
    """Add the forces of the races on the rollers to the workspace (`model.space`), for a part of each contact's length.

    A raceway is modelled by three circles of points for each row of rollers, numbered 0 to 2: circles `first_circle` to
    `end_circle` - 1 are evaluated (in the slices model, thirds of a contact's length along the roller). `first_time`:
    `FIRST_TIME` in the first call after `plan_contacts`, otherwise None. Only the first call looks up rollers' defects.
    """
    points, patch, slices = model.races.points, model.patch, model.slices
    evaluate_points(points, law, rotation, model, groups, single, first_circle, end_circle, damping, patch, first_time)
    evaluate_slices(slices, law, rotation, model, groups, single, first_circle, end_circle, damping, first_time)


@kernel_part
def evaluate_points(points, law, rotation, model, groups, single, first_circle, end_circle, damping, patch, first_time):
    """Add the forces of contacts with races that are modelled by points; no effect if `points` is None.

    `patch`: constants of the line model, in which a circle of a race touches a roller in one patch, or an empty array.
    The `single` contacts near defects always use points. Other arguments as in `evaluate_contacts`.
    """
    if points is None:
        return
    space, plan, starts = model.space, model.plan, model.races.starts
    for group in range(groups):
        race, window = plan[group, col.GROUP_RACE], plan[group, col.GROUP_WINDOW]
        first, end = starts[race, window, first_circle], starts[race, window, end_circle]
        start, stop = plan[group, col.GROUP_FIRST], plan[group, col.GROUP_END]
        if patch.shape[1] > 0:
            contact_columns(law, points, race, window, first, end, space, start, stop, damping, patch)
        else:
            contact_columns(law, points, race, window, first, end, space, start, stop, damping, None)
    for i in range(single):
        row, start = col.FIRST_SINGLE + i, col.SINGLE + i * col.LANES
        race, base = plan[row, col.SINGLE_RACE], plan[row, col.SINGLE_BASE]
        at = plan[row, col.SINGLE_FROM]
        damaged, roller = space[col.DAMAGE + np.uint64(at)] > 0.0, roller_in(at % col.RACE, rotation.shape[0])
        if first_time is not None and damaged:
            plan[row, col.SINGLE_WINDOW] = points.shape[1] - 1 - model.spare_of[roller]
            raised_points(model, roller, rotation[roller], race, base, plan[row, col.SINGLE_WINDOW], space, start)
        window, stop = plan[row, col.SINGLE_WINDOW], start + col.LANES
        first, end = starts[race, base, first_circle], starts[race, base, end_circle]
        contact_columns(law, points, race, window, first, end, space, start, stop, damping, None)


@kernel_part
def normal_loads(model, rotation, groups, compacted, single, loads):
    """Store the normal forces of races on rollers [N] in `loads`, [2 races, rollers, 3 circles of race points].

    In the slices model, thirds of a contact's length replace the circles. Overwrites the forces in the workspace.
    """
    space, plan = model.space, model.plan
    law = with_friction(model.law, model.law.damping, 0.0, 0.0, model.law.critical_velocity)
    for circle in range(CIRCLES_PER_RACE):
        for start in (col.F_X, col.F_Y, col.F_Z):
            for j in range(np.uint64(col.SINGLE + single * col.LANES)):
                space[start + j] = 0.0
        evaluate_contacts(law, rotation, model, groups, single, circle, circle + 1, None, None)
        scatter_sums(compacted, single, space, plan, None)
        for race in range(2):
            for slot in range(rotation.shape[0]):
                j = np.uint64(race * col.RACE + slot)
                square = space[col.F_X + j] ** 2 + space[col.F_Y + j] ** 2 + space[col.F_Z + j] ** 2
                loads[race, roller_in(slot, rotation.shape[0]), circle] = math.sqrt(square)


@kernel_part
def raised_points(model, roller, rotation, race, window, spare, space, column):
    """Copy a race's list `window` of points to the list `spare`, raised by the height of the roller's defects there."""
    table, raised = model.races.points[race, window], model.races.points[race, spare]
    for i in range(model.races.starts[race, window, CIRCLES_PER_RACE]):
        point, normal = point_at(table, col.POINT_RADIAL, i), point_at(table, col.NORMAL_RADIAL, i)
        lift = lift_at(model, roller, rotation, place_of_point(point, space, np.uint64(column)))
        point = plus(point, lift, normal)
        raised[col.POINT_RADIAL, i], raised[col.POINT_TANGENTIAL, i], raised[col.POINT_AXIAL, i] = point
        raised[col.POINT_SHARE, i] = table[col.POINT_SHARE, i]


@kernel_part
def lift_at(model, roller, rotation, place):
    """Compute the height [m] of a roller's defects at a point of its surface.

    `place` from the roller's centre [m]: outwards, along race, along axis; `rotation` about the axis [rad].
    """
    x, y, z = place
    radius, defects = model.law.roller_radius, model.roller_defects
    lift = 0.0
    for d in range(defects.shape[0]):
        if defects[d, col.DEFECT_ROLLER] != roller or abs(z - defects[d, col.DEFECT_AXIAL]) > model.circle_half_gap:
            continue
        away = math.atan2(y, x) - rotation - defects[d, col.DEFECT_ANGLE]
        away -= 2.0 * math.pi * math.floor(away / (2.0 * math.pi) + 0.5)
        if abs(away * radius / defects[d, col.DEFECT_EXTENT]) <= 0.5:
            lift += defects[d, col.DEFECT_HEIGHT]
    return lift
