"""Kernel: the right-hand side of the full model's equations of motion.

Newton-Euler in the generalised speeds (slides, spins, cage angular velocity, ring velocity), projected as in
Kane's method; the equations and the layout of the state stand at `srbval.models.full`.
"""

from __future__ import annotations

import math

import numpy as np

from srbval.models.full.columns import (
    ALONE,
    AT_ONCE,
    CAGE_X,
    CAGE_Y,
    CAGE_Z,
    DAMAGE,
    DAMPED,
    F_X,
    F_Y,
    F_Z,
    RACE,
    RUBBED,
    SIDE,
    SLIDE,
    SLIDE_RATE,
    SLIDE_RISE,
    SPIN,
    SPIN_RISE,
    STORED,
    T_X,
    T_Y,
    T_Z,
    X_WX,
    X_WY,
    X_WZ,
    Y_WX,
    Y_WY,
    Y_WZ,
    Z_WX,
    Z_WY,
    Z_WZ,
)  # fmt: skip
from srbval.models.full.contact_kernel import contact_columns, elastic
from srbval.models.full.drive_kernel import external_load, shaft_motion
from srbval.models.full.frames_kernel import read_rollers, roller_frames
from srbval.models.full.roller_defect_kernel import flank_forces, raised_points
from srbval.models.full.search_kernel import (
    LONE,
    bring_back,
    face_points,
    look_up,
    set_apart,
    spacing_of,
)
from srbval.models.jit import kernel

CONTACT_VALUES = 17
CIRCLES = 3
INNER = np.uint64(RACE)


@kernel
def right_hand_side(t, y, model, rate, contact, loads, damping):
    """Fill `rate` (shape of `y`) and `contact` (see below) for state `y` at time `t`.

    `contact`, shape [CONTACT_VALUES]: 0-2 force of the rollers on the outer ring [N]; 3 deepest penetration [m] into
    an undamaged race; 4 torque of the rollers on the shaft about its axis [N m]; 5 power lost to friction [W]; 6 power
    lost to contact damping [W]; 7 elastic energy in the contacts, K_c delta^2 / 2 [J]; 8 power of the drive [W];
    9 power of the external load [W]; 10 power lost in the housing's damper [W]; 11-16 inertia of the cage with its
    rollers about the bearing centre, xx, yy, zz, xy, xz, yz [kg m2].
    `loads`, shape [2 races, 2 M, 3 circles] or empty: normal forces [N], filled where there is room. `damping`: None,
    or anything else to have the columns' damping sums filled, see `damping_kernel`.
    """
    n = model.slot_angle.shape[0]
    d = 2 * n + 6
    law, races, scratch = model.law, model.races, model.scratch
    # arrays are taken out of their tuples once: inside a loop each would be counted in and out
    space, plan, places = scratch.space, scratch.plan, scratch.places
    count = races.window_of.shape[2]
    many = np.uint64(places)
    shaft, shaft_angle = shaft_motion(t, model.drive)

    # 1. every roller: its frame, and the points of both races within its reach
    ca, sa = math.cos(y[2 * n]), math.sin(y[2 * n])
    cb, sb = math.cos(y[2 * n + 1]), math.sin(y[2 * n + 1])
    read_rollers(y, n, space)
    roller_frames(y, n, many, (ca, sa, cb, sb), shaft, shaft_angle, count, model, space)
    eights, moved, lone, deepest = look_up(places, races, space, plan, count)
    spacing = spacing_of(count, model.patch)
    face_points(eights, places, space, plan, spacing, damping)

    # 2. what the contacts do
    set_apart(moved, lone, space, plan, spacing, count, damping)
    if lone > 0:
        shape_points(lone, y, model)
    meet(law, races.points, races.starts, eights, lone, space, plan, 0, CIRCLES, damping, model.patch)
    if lone > 0:
        push_flanks(lone, y, model, damping)
    bring_back(moved, lone, space, plan, damping)

    # 3. every roller's own motion, and what it asks of ring, shaft and cage
    omega_x, omega_y, omega_z = y[d + 2 * n], y[d + 2 * n + 1], y[d + 2 * n + 2]
    t02, t12, t22 = sb, -sa * cb, ca * cb  # the cage's axis
    # cage angular inertia about the bearing centre, and its torques, world axes
    i_t, i_d = model.cage_transverse, model.cage_axial - model.cage_transverse
    roller_axial, roller_transverse = model.roller_axial, model.roller_transverse
    rollers_transverse = n * roller_transverse
    m00 = i_t + i_d * t02 * t02 + rollers_transverse
    m11 = i_t + i_d * t12 * t12 + rollers_transverse
    m22 = i_t + i_d * t22 * t22 + rollers_transverse
    m01 = i_d * t02 * t12
    m02 = i_d * t02 * t22
    m12 = i_d * t12 * t22
    spin = omega_x * t02 + omega_y * t12 + omega_z * t22
    # - omega x (I omega): the part along omega drops out
    g_x = -i_d * spin * (omega_y * t22 - omega_z * t12)
    g_y = -i_d * spin * (omega_z * t02 - omega_x * t22)
    g_z = -i_d * spin * (omega_x * t12 - omega_y * t02)
    on_ring_x = on_ring_y = on_ring_z = on_shaft = 0.0
    rubbed = damped = stored = 0.0
    gravity, centre_distance = model.gravity, model.centre_distance
    roller_mass = model.roller_mass
    per_mass, per_axial = 1.0 / roller_mass, 1.0 / roller_axial
    for p in range(many):
        q = p + INNER
        mass = roller_mass * space[SIDE + p] * space[SIDE + p]
        x_x, x_y, x_z = space[X_WX + p], space[X_WY + p], space[X_WZ + p]
        y_x, y_y, y_z = space[Y_WX + p], space[Y_WY + p], space[Y_WZ + p]
        z_x, z_y, z_z = space[Z_WX + p], space[Z_WY + p], space[Z_WZ + p]
        w_x, w_y, w_z = space[CAGE_X + p], space[CAGE_Y + p], space[CAGE_Z + p]
        h_x, h_y, h_z = space[F_X + p], space[F_Y + p], space[F_Z + p]
        on_ring_x -= h_x * x_x + h_y * y_x + h_z * z_x
        on_ring_y -= h_x * x_y + h_y * y_y + h_z * z_y
        on_ring_z -= h_x * x_z + h_y * y_z + h_z * z_z
        reach = centre_distance + space[SLIDE + p]
        slide_rate, roller_spin = space[SLIDE_RATE + p], space[SPIN + p]
        # torque on the shaft: minus the shaft-axis part of (r x F + T) of the inner race's forces on the roller
        i_x, i_y, i_z = space[F_X + q], space[F_Y + q], space[F_Z + q]
        b_x, b_y, b_z = space[T_X + q], space[T_Y + q], space[T_Z + q]
        on_shaft -= b_x * x_z + (b_y - reach * i_z) * y_z
        on_shaft -= (b_z + reach * i_y) * z_z
        rubbed += space[RUBBED + p] + space[RUBBED + q]
        damped += space[DAMPED + p] + space[DAMPED + q]
        stored += space[STORED + p] + space[STORED + q]
        weight = mass * gravity
        f_x = h_x + i_x + weight * x_y
        f_y = h_y + i_y + weight * y_y
        f_z = h_z + i_z + weight * z_y
        t_x, t_y, t_z = space[T_X + p] + b_x, space[T_Y + p] + b_y, space[T_Z + p] + b_z

        # roller: slide and spin
        space[SLIDE_RISE + p] = reach * (w_y * w_y + w_z * w_z) + f_x * per_mass
        space[SPIN_RISE + p] = t_z * per_axial

        # cage: torque and inertia of the roller it carries, slot axes
        arm = mass * reach * reach
        coriolis = 2.0 * mass * reach * slide_rate
        gyro = roller_axial * roller_spin - roller_transverse * w_z
        q_x = t_x - gyro * w_y
        q_y = t_y + gyro * w_x - reach * f_z + arm * w_x * w_z - coriolis * w_y
        q_z = reach * f_y - arm * w_x * w_y - coriolis * w_z
        g_x += q_x * x_x + q_y * y_x + q_z * z_x
        g_y += q_x * x_y + q_y * y_y + q_z * z_y
        g_z += q_x * x_z + q_y * y_z + q_z * z_z
        m00 += arm - arm * x_x * x_x - roller_transverse * z_x * z_x
        m11 += arm - arm * x_y * x_y - roller_transverse * z_y * z_y
        m22 += arm - arm * x_z * x_z - roller_transverse * z_z * z_z
        m01 -= arm * x_x * x_y + roller_transverse * z_x * z_y
        m02 -= arm * x_x * x_z + roller_transverse * z_x * z_z
        m12 -= arm * x_y * x_z + roller_transverse * z_y * z_z
    half = n // 2
    for i in range(half):
        place = np.uint64(2 * i)
        for row in range(2):
            j = i + row * half
            rate[j] = y[d + j]
            rate[n + j] = y[d + n + j] - space[CAGE_Z + place]
            rate[d + j] = space[SLIDE_RISE + place]
            rate[d + n + j] = space[SPIN_RISE + place]
            place += np.uint64(1)

    # cage: symmetric 3 x 3 solve by cofactors
    k00 = m11 * m22 - m12 * m12
    k01 = m02 * m12 - m01 * m22
    k02 = m01 * m12 - m02 * m11
    k11 = m00 * m22 - m02 * m02
    k12 = m01 * m02 - m00 * m12
    k22 = m00 * m11 - m01 * m01
    determinant = m00 * k00 + m01 * k01 + m02 * k02
    rate[d + 2 * n] = (k00 * g_x + k01 * g_y + k02 * g_z) / determinant
    rate[d + 2 * n + 1] = (k01 * g_x + k11 * g_y + k12 * g_z) / determinant
    rate[d + 2 * n + 2] = (k02 * g_x + k12 * g_y + k22 * g_z) / determinant
    # gimbal angles from the angular velocity: w = Rx(-a) omega = (a' + c' sin b, b', c' cos b)
    w_y = ca * omega_y + sa * omega_z
    w_z = ca * omega_z - sa * omega_y
    rate[2 * n] = omega_x - w_z * sb / cb
    rate[2 * n + 1] = w_y
    rate[2 * n + 2] = w_z / cb

    # outer ring on the housing's spring and damper
    ring_x, ring_y, ring_z = y[2 * n + 3], y[2 * n + 4], y[2 * n + 5]
    ring_vx, ring_vy, ring_vz = y[d + 2 * n + 3], y[d + 2 * n + 4], y[d + 2 * n + 5]
    rate[2 * n + 3] = ring_vx
    rate[2 * n + 4] = ring_vy
    rate[2 * n + 5] = ring_vz
    kh, ch = model.housing_stiffness, model.housing_damping
    radial, axial = external_load(t, model.drive)
    push_x, push_y = radial * model.drive.direction_cosine, radial * model.drive.direction_sine
    push_y += model.ring_mass * gravity
    rate[d + 2 * n + 3] = (push_x + on_ring_x - kh * ring_x - ch * ring_vx) / model.ring_mass
    rate[d + 2 * n + 4] = (push_y + on_ring_y - kh * ring_y - ch * ring_vy) / model.ring_mass
    rate[d + 2 * n + 5] = (axial + on_ring_z - kh * ring_z - ch * ring_vz) / model.ring_mass

    contact[0] = on_ring_x
    contact[1] = on_ring_y
    contact[2] = on_ring_z
    contact[3] = deepest
    contact[4] = on_shaft
    contact[5] = rubbed
    contact[6] = damped
    contact[7] = 0.5 * stored
    contact[8] = -on_shaft * shaft
    contact[9] = (
        radial * (model.drive.direction_cosine * ring_vx + model.drive.direction_sine * ring_vy) + axial * ring_vz
    )
    contact[10] = ch * (ring_vx * ring_vx + ring_vy * ring_vy + ring_vz * ring_vz)
    contact[11], contact[12], contact[13] = m00, m11, m22
    contact[14], contact[15], contact[16] = m01, m02, m12

    if loads.shape[0] > 0:
        normal_loads(model, eights, moved, lone, loads)


@kernel
def meet(law, points, starts, eights, lone, space, plan, first_circle, end_circle, damping, patch):
    """Let all columns that may touch meet the points of the circles from `first_circle` to `end_circle`.

    With a `patch`, those that do not stand alone meet one point a circle that stands for all.
    """
    for run in range(eights):
        race, window = plan[run, 0], plan[run, 1]
        contact_columns(
            law, points, race, window, starts[race, window, first_circle], starts[race, window, end_circle],
            space, plan[run, 2], plan[run, 3], damping, patch,
        )  # fmt: skip
    for i in range(lone):
        race, window, made_from = plan[LONE + i, 0], plan[LONE + i, 1], plan[LONE + i, 3]
        start = ALONE + i * AT_ONCE
        contact_columns(
            law, points, race, window, starts[race, made_from, first_circle], starts[race, made_from, end_circle],
            space, start, start + AT_ONCE, damping, None,
        )  # fmt: skip


@kernel
def shape_points(lone, y, model):
    """Give the lone columns of damaged rollers points of their own: the race's, as their surface meets them."""
    points, starts, space, plan = model.races.points, model.races.starts, model.scratch.space, model.scratch.plan
    for i in range(lone):
        at = LONE + i
        roller = damaged_roller(at, model)
        if roller >= 0:
            race, made_from = plan[at, 0], plan[at, 3]
            plan[at, 1] = points.shape[1] - 1 - model.spare_of[roller]
            raised_points(
                shape_of(roller, y, model), points, race, made_from, plan[at, 1], starts[race, made_from, CIRCLES],
                space, ALONE + i * AT_ONCE,
            )  # fmt: skip


@kernel
def push_flanks(lone, y, model, damping):
    """Add what the flanks of defects on rollers push along the races, see `flank_forces`."""
    points, starts, space, plan = model.races.points, model.races.starts, model.scratch.space, model.scratch.plan
    for i in range(lone):
        at = LONE + i
        roller = damaged_roller(at, model)
        if roller >= 0:
            race, made_from = plan[at, 0], plan[at, 3]
            flank_forces(
                model.law, shape_of(roller, y, model), points, race, made_from, plan[at, 1],
                starts[race, made_from, CIRCLES], space, ALONE + i * AT_ONCE, damping,
            )  # fmt: skip


@kernel
def damaged_roller(at, model):
    """Which roller the lone column of row `at` of the plan belongs to; -1 if that roller is not damaged."""
    place = model.scratch.plan[at, 2] % RACE
    roller = place // 2 + (place % 2) * (model.slot_angle.shape[0] // 2)
    return roller if model.scratch.space[DAMAGE + np.uint64(place)] > 0.0 else -1


@kernel
def shape_of(roller, y, model):
    """Surface of a roller as `lift_at` reads it."""
    turned = y[model.slot_angle.shape[0] + roller]
    return model.law.roller_radius, model.circle_half_gap, model.roller_defects, roller, turned


@kernel
def normal_loads(model, eights, moved, lone, loads):
    """Fill `loads` with the normal force of each race's circles on each roller; spoils the columns' sums."""
    n = model.slot_angle.shape[0]
    races, space, plan = model.races, model.scratch.space, model.scratch.plan
    law = elastic(model.law, model.law.damping)
    for circle in range(CIRCLES):
        for start in (F_X, F_Y, F_Z):
            for j in range(np.uint64(ALONE + lone * AT_ONCE)):
                space[start + j] = 0.0
        meet(law, races.points, races.starts, eights, lone, space, plan, circle, circle + 1, None, model.patch)
        bring_back(moved, lone, space, plan, None)
        for race in range(2):
            for place in range(n):
                j = np.uint64(race * RACE + place)
                square = space[F_X + j] ** 2 + space[F_Y + j] ** 2 + space[F_Z + j] ** 2
                loads[race, place // 2 + (place % 2) * (n // 2), circle] = math.sqrt(square)
