"""Kernel: the right-hand side of the full model's equations of motion.

Newton-Euler equations in the generalised speeds (slides, spins, cage angular velocity, ring velocity), projected as in
Kane's method; for the equations and the state see `srbval.models.full`.
"""

import numpy as np

from srbval.models.full import columns as col
from srbval.models.full.columns import state_indices
from srbval.models.full.damping_kernel import write_accelerations
from srbval.models.full.forces_kernel import CIRCLES_PER_RACE, FIRST_TIME, evaluate_contacts, normal_loads
from srbval.models.full.frames_kernel import (
    add_heights,
    cage_axes,
    cage_tilt,
    face_defects,
    read_rollers,
    roller_frames,
    tilted_about_x,
)
from srbval.models.full.oil_kernel import add_oil_forces
from srbval.models.full.search_kernel import (
    gather_columns,
    plan_contacts,
    prepare_columns,
    scatter_sums,
    spacing_of_windows,
)
from srbval.models.full.second_cage_kernel import eliminate_relative_rate, fill_relative_rates, second_cage_torque
from srbval.models.full.slices_kernel import law_at_speed
from srbval.models.full.tilt_kernel import sums_in_slots, tilt_rollers
from srbval.models.jit import inlined, kernel, kernel_part

WITH_DAMPING = 1  # for `right_hand_side`; None: without


@kernel
def rates_and_loads(t, y, model, rate, totals, loads):
    """Call `right_hand_side` with `damping` None, compiled for calls from Python; see `steps.rates`."""
    right_hand_side(t, y, model, rate, totals, loads, None)


@kernel_part
def right_hand_side(t, y, model, rate, totals, loads, damping):
    """Compute the time derivative `rate` of the state `y` at time `t` [s], and the `totals` listed in `columns`.

    `loads`: array for the normal forces [N], shape [2 races, rollers, 3 circles], or None.
    """
    n = model.slot_angle.shape[0]
    at = state_indices(y.shape[0])
    second = model.second_cage
    races = model.races
    # arrays are taken out of their tuples once: a loop would count their references
    space, plan = model.space, model.plan
    count = races.window_of.shape[2]
    slots = np.uint64(model.slots)
    shaft, shaft_angle = shaft_motion(t, model.drive)
    tilt = cage_tilt(y[at.cage], y[at.cage + 1])

    # 1. every roller: its frame, and the points of both races within its reach
    read_rollers(y, at, n // 2, space)
    rotation = y[at.rotation : at.rotation + n]
    face_defects(model.roller_defects, model.law.roller_radius, rotation, space)
    roller_frames(y, at, slots, tilt, shaft, shaft_angle, model)
    tilt_rollers(model.free, model, slots)
    add_heights(model.surface, rotation, count, space)
    groups, compacted, single, deepest = plan_contacts(model.slots, races, space, plan, count)
    spacing = spacing_of_windows(count, model.patch)
    prepare_columns(groups, model.slots, space, plan, spacing, damping)

    # 2. contact forces
    gather_columns(compacted, single, space, plan, spacing, count, damping, model.slices)
    law = law_at_speed(model.law, model.slices, y[at.cage_rate + 2], shaft)
    evaluate_contacts(law, rotation, model, groups, single, 0, CIRCLES_PER_RACE, damping, FIRST_TIME)
    scatter_sums(compacted, single, space, plan, damping)
    add_oil_forces(model.oil, model, slots, y[at.cage_rate + 2], shaft, totals)
    sums_in_slots(model.free, model, slots)

    # 3. every roller's own motion, and its force on ring, shaft and cage
    omega_x, omega_y, omega_z = y[at.cage_rate], y[at.cage_rate + 1], y[at.cage_rate + 2]
    _, _, _, _, _, _, t02, t12, t22 = cage_axes(tilt)
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
    friction_loss = damping_loss = twice_energy = 0.0
    gravity, centre_distance = model.gravity, model.centre_distance
    roller_mass = model.roller_mass
    per_mass, per_axial = 1.0 / roller_mass, 1.0 / roller_axial
    for p in range(slots):
        q = p + col.INNER
        mass = roller_mass * space[col.SIDE + p] * space[col.SIDE + p]
        x_x, x_y, x_z = space[col.X_WX + p], space[col.X_WY + p], space[col.X_WZ + p]
        y_x, y_y, y_z = space[col.Y_WX + p], space[col.Y_WY + p], space[col.Y_WZ + p]
        z_x, z_y, z_z = space[col.Z_WX + p], space[col.Z_WY + p], space[col.Z_WZ + p]
        w_x, w_y, w_z = space[col.CAGE_X + p], space[col.CAGE_Y + p], space[col.CAGE_Z + p]
        h_x, h_y, h_z = space[col.F_X + p], space[col.F_Y + p], space[col.F_Z + p]
        on_ring_x -= h_x * x_x + h_y * y_x + h_z * z_x
        on_ring_y -= h_x * x_y + h_y * y_y + h_z * z_y
        on_ring_z -= h_x * x_z + h_y * y_z + h_z * z_z
        reach = centre_distance + space[col.SLIDE + p]
        slide_rate, roller_spin = space[col.SLIDE_RATE + p], space[col.SPIN + p]
        # torque on the shaft: minus the shaft-axis part of (r x F + T) of the inner race's forces on the roller
        i_x, i_y, i_z = space[col.F_X + q], space[col.F_Y + q], space[col.F_Z + q]
        b_x, b_y, b_z = space[col.T_X + q], space[col.T_Y + q], space[col.T_Z + q]
        on_shaft -= b_x * x_z + (b_y - reach * i_z) * y_z
        on_shaft -= (b_z + reach * i_y) * z_z
        friction_loss += space[col.FRICTION_LOSS + p] + space[col.FRICTION_LOSS + q]
        damping_loss += space[col.DAMPING_LOSS + p] + space[col.DAMPING_LOSS + q]
        twice_energy += space[col.TWICE_ENERGY + p] + space[col.TWICE_ENERGY + q]
        weight = mass * gravity
        f_x = h_x + i_x + weight * x_y
        f_y = h_y + i_y + weight * y_y
        f_z = h_z + i_z + weight * z_y
        t_x, t_y, t_z = space[col.T_X + p] + b_x, space[col.T_Y + p] + b_y, space[col.T_Z + p] + b_z

        # roller: slide and spin
        space[col.SLIDE_ACCELERATION + p] = reach * (w_y * w_y + w_z * w_z) + f_x * per_mass
        space[col.SPIN_ACCELERATION + p] = t_z * per_axial

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
        slot = np.uint64(2 * i)
        for row in range(2):
            j = i + row * half
            rate[at.slide + j] = y[at.slide_rate + j]
            rate[at.rotation + j] = y[at.spin + j] - space[col.CAGE_Z + slot]
            slot += np.uint64(1)
    write_accelerations(space, half, at, rate)

    # cage: symmetric 3 x 3 solve by cofactors
    totals[col.INERTIA_XX], totals[col.INERTIA_YY], totals[col.INERTIA_ZZ] = m00, m11, m22
    totals[col.INERTIA_XY], totals[col.INERTIA_XZ], totals[col.INERTIA_YZ] = m01, m02, m12
    relative, on_cages = second_cage_torque(second, model, y, at, slots, totals, (g_x, g_y, g_z), (t02, t12, t22))
    relative, on_cages = couples_on_cages(model.oil, col.ON_CAGE, model, slots, relative, on_cages)
    relative, on_cages = couples_on_cages(model.free, col.SKEW_ON_CAGE, model, slots, relative, on_cages)
    on_cages, inertia = eliminate_relative_rate(second, totals, relative, on_cages, (m00, m11, m22, m01, m02, m12))
    g_x, g_y, g_z = on_cages
    m00, m11, m22, m01, m02, m12 = inertia
    k00 = m11 * m22 - m12 * m12
    k01 = m02 * m12 - m01 * m22
    k02 = m01 * m12 - m02 * m11
    k11 = m00 * m22 - m02 * m02
    k12 = m01 * m02 - m00 * m12
    k22 = m00 * m11 - m01 * m01
    determinant = m00 * k00 + m01 * k01 + m02 * k02
    rate[at.cage_rate] = (k00 * g_x + k01 * g_y + k02 * g_z) / determinant
    rate[at.cage_rate + 1] = (k01 * g_x + k11 * g_y + k12 * g_z) / determinant
    rate[at.cage_rate + 2] = (k02 * g_x + k12 * g_y + k22 * g_z) / determinant
    fill_relative_rates(second, y, at, totals, relative, rate)
    # gimbal angles from the angular velocity: w = Rx(-a) omega = (a' + c' sin b, b', c' cos b)
    w_z, w_y = tilted_about_x(tilt, omega_y, omega_z)
    rate[at.cage] = omega_x - w_z * tilt.sin_y / tilt.cos_y
    rate[at.cage + 1] = w_y
    rate[at.cage + 2] = w_z / tilt.cos_y

    totals[col.RING_FORCE_X], totals[col.RING_FORCE_Y], totals[col.RING_FORCE_Z] = on_ring_x, on_ring_y, on_ring_z
    totals[col.DEEPEST] = deepest
    totals[col.SHAFT_TORQUE] = on_shaft
    totals[col.FRICTION_POWER] = friction_loss
    totals[col.DAMPING_POWER] = damping_loss
    totals[col.CONTACT_ENERGY] = 0.5 * twice_energy
    totals[col.DRIVE_POWER] = -on_shaft * shaft
    ring_motion(t, y, at, model, (on_ring_x, on_ring_y, on_ring_z), rate, totals)

    if loads is not None:
        normal_loads(model, rotation, groups, compacted, single, loads)


@kernel_part
def couples_on_cages(cause, row, model, slots, relative, on_cages):
    """Add the couples [N m] that rollers exert on the cages, about the rollers' axes, to the torques on the cages.

    The couples are in the workspace from index `row` on. `relative`: torque on row 2's cage about its axis, for
    bearings with a cage per row; `on_cages`: total torque. Returns both. No effect if `cause` (their law in `model`) is
    None.
    """
    if cause is None:
        return relative, on_cages
    space = model.space
    g_x, g_y, g_z = on_cages
    for p in range(slots):
        couple = space[row + p]
        g_x += couple * space[col.Z_WX + p]
        g_y += couple * space[col.Z_WY + p]
        g_z += couple * space[col.Z_WZ + p]
        relative += couple * model.tilt_cosine if space[col.SIDE + p] < 0.0 else 0.0
    return relative, (g_x, g_y, g_z)


@inlined
def ring_motion(t, y, at, model, on_ring, rate, totals):
    """Compute the outer ring's rates under the rollers' force `on_ring` [N], and the powers of load and housing [W]."""
    ring_x, ring_y, ring_z = y[at.ring], y[at.ring + 1], y[at.ring + 2]
    ring_vx, ring_vy, ring_vz = y[at.ring_rate], y[at.ring_rate + 1], y[at.ring_rate + 2]
    rate[at.ring], rate[at.ring + 1], rate[at.ring + 2] = ring_vx, ring_vy, ring_vz
    on_ring_x, on_ring_y, on_ring_z = on_ring
    kh, ch = model.housing_stiffness, model.housing_damping
    cosine, sine = model.drive.direction_cosine, model.drive.direction_sine
    radial, axial = external_load(t, model.drive)
    push_x, push_y = radial * cosine, radial * sine
    push_y += model.ring_mass * model.gravity
    rate[at.ring_rate] = (push_x + on_ring_x - kh * ring_x - ch * ring_vx) / model.ring_mass
    rate[at.ring_rate + 1] = (push_y + on_ring_y - kh * ring_y - ch * ring_vy) / model.ring_mass
    rate[at.ring_rate + 2] = (axial + on_ring_z - kh * ring_z - ch * ring_vz) / model.ring_mass
    totals[col.LOAD_POWER] = radial * (cosine * ring_vx + sine * ring_vy) + axial * ring_vz
    totals[col.HOUSING_POWER] = ch * (ring_vx * ring_vx + ring_vy * ring_vy + ring_vz * ring_vz)


@kernel_part
def shaft_motion(t, drive):
    """Compute the shaft's speed [rad/s] and angle [rad] at time `t` [s]; speed: linear between entries of `drive`."""
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


@kernel_part
def external_load(t, drive):
    """Compute radial and axial load [N] at time `t` [s]: linear between entries of `drive`, constant outside them."""
    table = drive.load
    last = table.shape[1] - 1
    if t <= table[0, 0]:
        return table[1, 0], table[2, 0]
    if t >= table[0, last]:
        return table[1, last], table[2, last]
    i = np.searchsorted(table[0], t) - 1
    share = (t - table[0, i]) / (table[0, i + 1] - table[0, i])
    return table[1, i] + share * (table[1, i + 1] - table[1, i]), table[2, i] + share * (table[2, i + 1] - table[2, i])
