"""Kernel: the right-hand side of the full model's equations of motion.

Newton-Euler in the generalised speeds (slides, spins, cage angular velocity, ring velocity), projected as in
Kane's method; the equations and the layout of the state stand at `srbval.models.full`.
"""

from __future__ import annotations

import math

import numpy as np

from srbval.models.full.columns import (
    AT_ONCE,
    CAGE_X,
    CAGE_Y,
    CAGE_Z,
    FORCE_X,
    FORCE_Y,
    FORCE_Z,
    GROUPS,
    INNER_DEPTH,
    INNER_OFFSET,
    INNER_VX,
    INNER_VY,
    INNER_VZ,
    INNER_WX,
    INNER_WY,
    INNER_WZ,
    OUTER_DEPTH,
    OUTER_OFFSET,
    OUTER_VX,
    OUTER_VY,
    OUTER_VZ,
    OUTER_X,
    OUTER_Y,
    OUTER_Z,
    TORQUE_X,
    TORQUE_Y,
    TORQUE_Z,
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
from srbval.models.full.contact_kernel import (
    clear_sums,
    contact_columns,
    damaged_roller_points,
    push_away,
    put_column,
    sums,
    without_friction,
)
from srbval.models.full.point_cloud import FAR_M
from srbval.models.jit import kernel

CONTACT_VALUES = 11
OUTER = 0  # first index of the races' arrays; 1 is the inner race
PROFILE_SLOPE = 0.1  # above the sine of half the tilt: where the outer circles' normals lean
SKIP_MARGIN_M = 2e-6  # a roller further than this (and the highest bump) from a race is not looked at


@kernel
def shaft_motion(t, drive):
    """Speed and angle of the shaft at time `t`: linear between the table's entries, constant outside."""
    last = drive.speed.shape[0] - 1
    if t <= drive.speed_time[0]:
        return drive.speed[0], drive.speed_angle[0] + drive.speed[0] * (t - drive.speed_time[0])
    if t >= drive.speed_time[last]:
        return drive.speed[last], drive.speed_angle[last] + drive.speed[last] * (t - drive.speed_time[last])
    i = np.searchsorted(drive.speed_time, t) - 1
    since = t - drive.speed_time[i]
    slope = (drive.speed[i + 1] - drive.speed[i]) / (drive.speed_time[i + 1] - drive.speed_time[i])
    return drive.speed[i] + slope * since, drive.speed_angle[i] + (drive.speed[i] + 0.5 * slope * since) * since


@kernel
def external_load(t, drive):
    """Radial and axial load at time `t`: linear between the table's entries, constant outside."""
    last = drive.radial.shape[0] - 1
    if t <= drive.load_time[0]:
        return drive.radial[0], drive.axial[0]
    if t >= drive.load_time[last]:
        return drive.radial[last], drive.axial[last]
    i = np.searchsorted(drive.load_time, t) - 1
    share = (t - drive.load_time[i]) / (drive.load_time[i + 1] - drive.load_time[i])
    radial = drive.radial[i] + share * (drive.radial[i + 1] - drive.radial[i])
    return radial, drive.axial[i] + share * (drive.axial[i + 1] - drive.axial[i])


@kernel
def group_of(group, region, groups, alone):
    """Race, window, window it was made from, first column and number of columns of a group or of a lone column."""
    if group < GROUPS:
        race, window = group // 4, group % 4
        return race, window, window, group * region, groups[group]
    lone = group - GROUPS
    return alone[lone, 0], alone[lone, 1], alone[lone, 2], GROUPS * region + lone * AT_ONCE, 1


@kernel
def normal_loads(law, points, race, window, of_window, starts, columns, owner, begin, used, loads):
    """Fill `loads` with the normal force of each circle on the rollers of a group; spoils the columns' sums."""
    filled = begin + (used + AT_ONCE - 1) // AT_ONCE * AT_ONCE
    for circle in range(3):
        for at in range(begin, begin + used):
            clear_sums(columns, at)
        first, last = starts[race, of_window, circle], starts[race, of_window, circle + 1]
        contact_columns(law, points, race, window, first, last, columns, begin, filled)
        for at in range(begin, begin + used):
            f_x, f_y, f_z, _, _, _, _, _, _ = sums(columns, at)
            loads[race, owner[at], circle] = math.sqrt(f_x * f_x + f_y * f_y + f_z * f_z)


@kernel
def right_hand_side(t, y, model, rate, contact, loads):
    """Fill `rate` (shape of `y`) and `contact` (see below) for state `y` at time `t`.

    `contact`, shape [CONTACT_VALUES]: 0-2 force of the rollers on the outer ring [N]; 3 deepest penetration [m] into
    an undamaged race; 4 torque of the rollers on the shaft about its axis [N m]; 5 power lost to friction [W]; 6 power
    lost to contact damping [W]; 7 elastic energy in the contacts, K_c delta^2 / 2 [J]; 8 power of the drive [W];
    9 power of the external load [W]; 10 power lost in the housing's damper [W].
    `loads`, shape [2 races, 2 M, 3 circles] or empty: normal forces [N], filled where there is room.
    """
    n = model.roller_angle.shape[0]
    d = 2 * n + 6
    pi2 = 2.0 * math.pi
    count = model.races.cosine.shape[0]
    per_radian, per_count = count / pi2, 1.0 / count

    tilt_x, tilt_y, turn = y[2 * n], y[2 * n + 1], y[2 * n + 2]
    ring_x, ring_y, ring_z = y[2 * n + 3], y[2 * n + 4], y[2 * n + 5]
    omega_x, omega_y, omega_z = y[d + 2 * n], y[d + 2 * n + 1], y[d + 2 * n + 2]
    ring_vx, ring_vy, ring_vz = y[d + 2 * n + 3], y[d + 2 * n + 4], y[d + 2 * n + 5]
    shaft, shaft_angle = shaft_motion(t, model.drive)
    radial, axial = external_load(t, model.drive)

    ca, sa = math.cos(tilt_x), math.sin(tilt_x)
    cb, sb = math.cos(tilt_y), math.sin(tilt_y)
    ct, st = math.cos(turn), math.sin(turn)
    cs, ss = math.cos(shaft_angle), math.sin(shaft_angle)
    # cage tilt Rx(a) Ry(b), by columns
    t00, t10, t20 = cb, sa * sb, -ca * sb
    t01, t11, t21 = 0.0, ca, sa
    t02, t12, t22 = sb, -sa * cb, ca * cb

    # cage angular inertia about the bearing centre, and its torques, world axes
    i_t, i_d = model.cage_transverse, model.cage_axial - model.cage_transverse
    m00 = i_t + i_d * t02 * t02
    m11 = i_t + i_d * t12 * t12
    m22 = i_t + i_d * t22 * t22
    m01 = i_d * t02 * t12
    m02 = i_d * t02 * t22
    m12 = i_d * t12 * t22
    spin = omega_x * t02 + omega_y * t12 + omega_z * t22
    # - omega x (I omega): the part along omega drops out
    g_x = -i_d * spin * (omega_y * t22 - omega_z * t12)
    g_y = -i_d * spin * (omega_z * t02 - omega_x * t22)
    g_z = -i_d * spin * (omega_x * t12 - omega_y * t02)

    mass, law = model.roller_mass, model.law
    # arrays are taken out of their tuples once: inside a loop each would be counted in and out
    roller_defects, damaged, spare_of = model.roller_defects, model.damaged, model.spare_of
    points, starts, window_of, highest, shallow, cosine, sine = model.races
    columns, owner, groups, alone, rollers, region = model.scratch
    row_of, slot_angle, slot_cosine, slot_sine = (
        model.roller_row, model.roller_angle, model.roller_cosine, model.roller_sine,
    )  # fmt: skip
    tilt_cosine, tilt_sine, centre_distance = model.tilt_cosine, model.tilt_sine, model.centre_distance
    roller_radius, profile_radius = law.roller_radius, law.profile_radius
    arc_radial, arc_height = model.inner_centre_radial, model.inner_centre_axial

    # 1. every roller: slot axes, and how both races stand and move against it
    many, first_rate = np.uint64(n), np.uint64(d)
    for j in range(many):
        side = row_of[j]
        c = ct * slot_cosine[j] - st * slot_sine[j]
        s = st * slot_cosine[j] + ct * slot_sine[j]
        # slot axes in world coordinates: x along the slot, y along the race, z along the roller
        ex = tilt_cosine * c
        ey = tilt_cosine * s
        ez = side * tilt_sine
        x_x = t00 * ex + t01 * ey + t02 * ez
        x_y = t10 * ex + t11 * ey + t12 * ez
        x_z = t20 * ex + t21 * ey + t22 * ez
        y_x = -t00 * s + t01 * c
        y_y = -t10 * s + t11 * c
        y_z = -t20 * s + t21 * c
        z_x = x_y * y_z - x_z * y_y
        z_y = x_z * y_x - x_x * y_z
        z_z = x_x * y_y - x_y * y_x
        reach = centre_distance + y[j]
        slide_rate = y[first_rate + j]
        roller_spin = y[first_rate + many + j]
        w_x = omega_x * x_x + omega_y * x_y + omega_z * x_z
        w_y = omega_x * y_x + omega_y * y_y + omega_z * y_z
        w_z = omega_x * z_x + omega_y * z_y + omega_z * z_z
        o_x = ring_x * x_x + ring_y * x_y + ring_z * x_z - reach
        o_z = ring_x * z_x + ring_y * z_y + ring_z * z_z
        arc_axial = side * arc_height
        rollers[X_WX + j], rollers[X_WY + j], rollers[X_WZ + j] = x_x, x_y, x_z
        rollers[Y_WX + j], rollers[Y_WY + j], rollers[Y_WZ + j] = y_x, y_y, y_z
        rollers[Z_WX + j], rollers[Z_WY + j], rollers[Z_WZ + j] = z_x, z_y, z_z
        rollers[CAGE_X + j], rollers[CAGE_Y + j], rollers[CAGE_Z + j] = w_x, w_y, w_z
        rollers[OUTER_X + j], rollers[OUTER_Z + j] = o_x, o_z
        rollers[OUTER_Y + j] = ring_x * y_x + ring_y * y_y + ring_z * y_z
        rollers[OUTER_VX + j] = ring_vx * x_x + ring_vy * x_y + ring_vz * x_z - slide_rate
        rollers[OUTER_VY + j] = ring_vx * y_x + ring_vy * y_y + ring_vz * y_z - reach * w_z
        rollers[OUTER_VZ + j] = ring_vx * z_x + ring_vy * z_y + ring_vz * z_z + reach * w_y
        rollers[INNER_VX + j] = -slide_rate
        rollers[INNER_VY + j] = reach * (shaft * z_z - w_z)
        rollers[INNER_VZ + j] = reach * (w_y - shaft * y_z)
        rollers[INNER_WX + j] = shaft * x_z - w_x
        rollers[INNER_WY + j] = shaft * y_z - w_y
        rollers[INNER_WZ + j] = shaft * z_z - roller_spin
        rollers[OUTER_DEPTH + j] = roller_radius - profile_radius - o_x
        rollers[INNER_DEPTH + j] = (
            arc_radial * (c * x_x + s * x_y) + arc_axial * x_z - reach + roller_radius - profile_radius
        )
        rollers[OUTER_OFFSET + j] = o_z
        rollers[INNER_OFFSET + j] = arc_radial * (c * z_x + s * z_y) + arc_axial * z_z
        rollers[FORCE_X + j], rollers[FORCE_Y + j], rollers[FORCE_Z + j] = 0.0, 0.0, 0.0
        rollers[TORQUE_X + j], rollers[TORQUE_Y + j], rollers[TORQUE_Z + j] = 0.0, 0.0, 0.0

    # 2. every roller and race within reach: candidate points and a column among its like
    groups[:] = 0
    lone = 0
    deepest = -1.0
    for i in range(n):
        j = np.uint64(i)
        row = 0 if row_of[i] > 0.0 else 1
        angle = turn + slot_angle[i]
        for race in range(2):
            if race == OUTER:
                depth, offset = rollers[OUTER_DEPTH + j], rollers[OUTER_OFFSET + j]
                place, ring_cosine, ring_sine = angle * per_radian, 1.0, 0.0
            else:
                depth, offset = rollers[INNER_DEPTH + j], rollers[INNER_OFFSET + j]
                place, ring_cosine, ring_sine = (angle - shaft_angle) * per_radian, cs, ss
            deepest = depth if depth > deepest else deepest
            bound = depth + PROFILE_SLOPE * abs(offset)  # no point of an undamaged race lies deeper
            place -= count * math.floor(place * per_count)
            below = int(place)
            k = int(place + 0.5)
            k = k if k < count else 0
            window = window_of[race, row, k]
            if bound <= -(highest[race, window] + damaged[i] + SKIP_MARGIN_M):
                continue
            plain = window < 2 and damaged[i] == 0.0
            if plain and bound < shallow[race]:
                k = below if below < count else 0
                window = row + 2
            pc = ring_cosine * cosine[k] - ring_sine * sine[k]
            ps = ring_sine * cosine[k] + ring_cosine * sine[k]
            x_x, x_y, x_z = rollers[X_WX + j], rollers[X_WY + j], rollers[X_WZ + j]
            y_x, y_y, y_z = rollers[Y_WX + j], rollers[Y_WY + j], rollers[Y_WZ + j]
            z_x, z_y, z_z = rollers[Z_WX + j], rollers[Z_WY + j], rollers[Z_WZ + j]
            a_x, a_y, a_z = pc * x_x + ps * x_y, pc * y_x + ps * y_y, pc * z_x + ps * z_y
            b_x, b_y, b_z = pc * x_y - ps * x_x, pc * y_y - ps * y_x, pc * z_y - ps * z_x
            if race == OUTER:
                o_x, o_y, o_z = rollers[OUTER_X + j], rollers[OUTER_Y + j], rollers[OUTER_Z + j]
                v_x, v_y, v_z = rollers[OUTER_VX + j], rollers[OUTER_VY + j], rollers[OUTER_VZ + j]
                w_x, w_y, w_z = -rollers[CAGE_X + j], -rollers[CAGE_Y + j], -y[d + n + i]
            else:
                o_x, o_y, o_z = -(centre_distance + y[i]), 0.0, 0.0
                v_x, v_y, v_z = rollers[INNER_VX + j], rollers[INNER_VY + j], rollers[INNER_VZ + j]
                w_x, w_y, w_z = rollers[INNER_WX + j], rollers[INNER_WY + j], rollers[INNER_WZ + j]
            if plain:
                group = 4 * race + window
                at = group * region + groups[group]
                groups[group] += 1
            else:
                at = GROUPS * region + lone * AT_ONCE
                alone[lone, 0], alone[lone, 1], alone[lone, 2] = race, window, window
                if damaged[i] > 0.0:
                    alone[lone, 1] = points.shape[1] - 1 - spare_of[i]
                    damaged_roller_points(
                        roller_radius, model.circle_half_gap, roller_defects, i, y[n + i], points, race, window,
                        alone[lone, 1], starts[race, window, 3],
                        a_x, a_y, a_z, b_x, b_y, b_z, x_z, y_z, z_z, o_x, o_y, o_z,
                    )  # fmt: skip
                lone += 1
            owner[at] = i
            put_column(
                columns, at, a_x, a_y, a_z, b_x, b_y, b_z, x_z, y_z, z_z, o_x, o_y, o_z, v_x, v_y, v_z, w_x, w_y, w_z
            )  # fmt: skip

    # 3. contacts, group by group, and what they do to rollers, ring and shaft
    on_ring_x = on_ring_y = on_ring_z = on_shaft = 0.0
    rubbed = damped = stored = 0.0
    for group in range(GROUPS + lone):
        race, window, of_window, begin, used = group_of(group, region, groups, alone)
        if used == 0:
            continue
        filled = begin + (used + AT_ONCE - 1) // AT_ONCE * AT_ONCE
        push_away(columns, begin + used, filled, FAR_M)
        contact_columns(law, points, race, window, 0, starts[race, of_window, 3], columns, begin, filled)
        for at in range(begin, begin + used):
            j = np.uint64(owner[at])
            h_x, h_y, h_z, m_x, m_y, m_z, rub, damp, store = sums(columns, at)
            rubbed += rub
            damped += damp
            stored += store
            rollers[FORCE_X + j] += h_x
            rollers[FORCE_Y + j] += h_y
            rollers[FORCE_Z + j] += h_z
            rollers[TORQUE_X + j] += m_x
            rollers[TORQUE_Y + j] += m_y
            rollers[TORQUE_Z + j] += m_z
            if race == OUTER:
                on_ring_x -= h_x * rollers[X_WX + j] + h_y * rollers[Y_WX + j] + h_z * rollers[Z_WX + j]
                on_ring_y -= h_x * rollers[X_WY + j] + h_y * rollers[Y_WY + j] + h_z * rollers[Z_WY + j]
                on_ring_z -= h_x * rollers[X_WZ + j] + h_y * rollers[Y_WZ + j] + h_z * rollers[Z_WZ + j]
            else:  # torque on the shaft: minus the shaft-axis part of (r x F + T) of the forces on the roller
                reach = centre_distance + y[j]
                on_shaft -= m_x * rollers[X_WZ + j] + (m_y - reach * h_z) * rollers[Y_WZ + j]
                on_shaft -= (m_z + reach * h_y) * rollers[Z_WZ + j]
        if loads.shape[0] > 0:
            normal_loads(
                without_friction(law), points, race, window, of_window, starts, columns, owner, begin, used, loads
            )  # fmt: skip

    # 4. every roller's own motion, and what it asks of the cage
    weight = mass * model.gravity
    roller_axial, roller_transverse = model.roller_axial, model.roller_transverse
    for j in range(many):
        x_x, x_y, x_z = rollers[X_WX + j], rollers[X_WY + j], rollers[X_WZ + j]
        y_x, y_y, y_z = rollers[Y_WX + j], rollers[Y_WY + j], rollers[Y_WZ + j]
        z_x, z_y, z_z = rollers[Z_WX + j], rollers[Z_WY + j], rollers[Z_WZ + j]
        w_x, w_y, w_z = rollers[CAGE_X + j], rollers[CAGE_Y + j], rollers[CAGE_Z + j]
        f_x = rollers[FORCE_X + j] + weight * x_y
        f_y = rollers[FORCE_Y + j] + weight * y_y
        f_z = rollers[FORCE_Z + j] + weight * z_y
        t_x, t_y, t_z = rollers[TORQUE_X + j], rollers[TORQUE_Y + j], rollers[TORQUE_Z + j]
        reach = centre_distance + y[j]
        slide_rate = y[first_rate + j]
        roller_spin = y[first_rate + many + j]

        # roller: slide and spin
        rate[j] = slide_rate
        rate[many + j] = roller_spin - w_z
        rate[first_rate + j] = reach * (w_y * w_y + w_z * w_z) + f_x / mass
        rate[first_rate + many + j] = t_z / roller_axial

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
        both = arm + roller_transverse
        m00 += both - arm * x_x * x_x - roller_transverse * z_x * z_x
        m11 += both - arm * x_y * x_y - roller_transverse * z_y * z_y
        m22 += both - arm * x_z * x_z - roller_transverse * z_z * z_z
        m01 -= arm * x_x * x_y + roller_transverse * z_x * z_y
        m02 -= arm * x_x * x_z + roller_transverse * z_x * z_z
        m12 -= arm * x_y * x_z + roller_transverse * z_y * z_z

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
    rate[2 * n + 3] = ring_vx
    rate[2 * n + 4] = ring_vy
    rate[2 * n + 5] = ring_vz
    kh, ch = model.housing_stiffness, model.housing_damping
    push_x, push_y = radial * model.drive.direction_cosine, radial * model.drive.direction_sine
    push_y += model.ring_mass * model.gravity
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
    contact[7] = stored
    contact[8] = -on_shaft * shaft
    contact[9] = (
        radial * (model.drive.direction_cosine * ring_vx + model.drive.direction_sine * ring_vy) + axial * ring_vz
    )
    contact[10] = ch * (ring_vx * ring_vx + ring_vy * ring_vy + ring_vz * ring_vz)
