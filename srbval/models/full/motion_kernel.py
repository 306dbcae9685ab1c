"""Kernel: the right-hand side of the full model's equations of motion.

Newton-Euler equations in the generalised speeds (slides, spins, cage angular velocity, ring velocity), projected as in
Kane's method (Kane & Levinson 1985, Dynamics, ch. 6); for state and equations see `srbval.models.full`.
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
    gimbal_rates,
    read_rollers,
    roller_frames,
    roller_in,
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
from srbval.models.full.vectors_kernel import (
    axes_at,
    cross,
    dot,
    entries_from,
    plus,
    plus_dyad,
    tensor_times,
    times,
    to_world,
    vector_at,
)
from srbval.models.jit import inlined, kernel, kernel_part

WITH_DAMPING = 1  # for `right_hand_side`; None: without


@kernel
def rates_and_loads(t, y, model, rate, totals, loads):
    """Call `right_hand_side` with `damping` None, compiled for calls from Python; see `rates.rates`."""
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
    read_rollers(y, at, n, space)
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
    omega = entries_from(y, at.cage_rate)
    _, _, axis = cage_axes(tilt)
    # cage angular inertia about the bearing centre, and its torques, world axes
    i_t, i_d = model.cage_transverse, model.cage_axial - model.cage_transverse
    roller_axial, roller_transverse = model.roller_axial, model.roller_transverse
    own = i_t + n * roller_transverse
    inertia = plus_dyad((own, own, own, 0.0, 0.0, 0.0), i_d, axis)
    # - omega x (I omega): the part along omega drops out
    on_cages = times(-i_d * dot(omega, axis), cross(omega, axis))
    on_ring, on_shaft = (0.0, 0.0, 0.0), 0.0
    friction_loss = damping_loss = twice_energy = 0.0
    gravity, centre_distance = model.gravity, model.centre_distance
    roller_mass = model.roller_mass
    per_mass, per_axial = 1.0 / roller_mass, 1.0 / roller_axial
    for p in range(slots):
        q = p + col.INNER
        mass = roller_mass * space[col.SIDE + p] * space[col.SIDE + p]
        axes = axes_at(space, col.X_WX, p)
        x, along, z = axes
        w_x, w_y, w_z = vector_at(space, col.CAGE_X, p)
        outer, inner = vector_at(space, col.F_X, p), vector_at(space, col.F_X, q)
        on_ring = plus(on_ring, -1.0, to_world(outer, axes))
        reach = centre_distance + space[col.SLIDE + p]
        slide_rate, roller_spin = space[col.SLIDE_RATE + p], space[col.SPIN + p]
        # torque on the shaft: minus the shaft-axis part of (r x F + T) of the inner race's forces on the roller
        torque = vector_at(space, col.T_X, q)
        on_shaft -= torque[0] * x[2] + (torque[1] - reach * inner[2]) * along[2]
        on_shaft -= (torque[2] + reach * inner[1]) * z[2]
        friction_loss += space[col.FRICTION_LOSS + p] + space[col.FRICTION_LOSS + q]
        damping_loss += space[col.DAMPING_LOSS + p] + space[col.DAMPING_LOSS + q]
        twice_energy += space[col.TWICE_ENERGY + p] + space[col.TWICE_ENERGY + q]
        weight = mass * gravity
        f_x, f_y, f_z = plus(plus(outer, 1.0, inner), weight, (x[1], along[1], z[1]))
        t_x, t_y, t_z = plus(vector_at(space, col.T_X, p), 1.0, torque)

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
        on_cages = plus(on_cages, 1.0, to_world((q_x, q_y, q_z), axes))
        # arm (1 - x x) - I_t z z, with 1 = x x + y y + z z
        inertia = plus_dyad(plus_dyad(inertia, arm, along), arm - roller_transverse, z)
    for slot in range(n):
        j = roller_in(slot, n)
        rate[at.slide + j] = y[at.slide_rate + j]
        rate[at.rotation + j] = y[at.spin + j] - space[col.CAGE_Z + np.uint64(slot)]
    write_accelerations(space, n, at, rate)

    # cage: symmetric 3 x 3 solve by cofactors
    for m in range(6):
        totals[col.INERTIA_XX + m] = inertia[m]
    relative, on_cages = second_cage_torque(second, model, y, at, slots, totals, on_cages, axis)
    relative, on_cages = couples_on_cages(model.oil, col.ON_CAGE, model, slots, relative, on_cages)
    relative, on_cages = couples_on_cages(model.free, col.SKEW_ON_CAGE, model, slots, relative, on_cages)
    on_cages, inertia = eliminate_relative_rate(second, totals, relative, on_cages, inertia)
    m00, m11, m22, m01, m02, m12 = inertia
    k00, k01, k02 = m11 * m22 - m12 * m12, m02 * m12 - m01 * m22, m01 * m12 - m02 * m11
    k11, k12, k22 = m00 * m22 - m02 * m02, m01 * m02 - m00 * m12, m00 * m11 - m01 * m01
    per = 1.0 / (m00 * k00 + m01 * k01 + m02 * k02)
    own = times(per, tensor_times((k00, k11, k22, k01, k02, k12), on_cages))
    rate[at.cage_rate], rate[at.cage_rate + 1], rate[at.cage_rate + 2] = own
    fill_relative_rates(second, y, at, totals, relative, rate)
    rate[at.cage], rate[at.cage + 1], rate[at.cage + 2] = gimbal_rates(tilt, omega)

    totals[col.RING_FORCE_X], totals[col.RING_FORCE_Y], totals[col.RING_FORCE_Z] = on_ring
    totals[col.DEEPEST] = deepest
    totals[col.SHAFT_TORQUE] = on_shaft
    totals[col.FRICTION_POWER] = friction_loss
    totals[col.DAMPING_POWER] = damping_loss
    totals[col.CONTACT_ENERGY] = 0.5 * twice_energy
    totals[col.DRIVE_POWER] = -on_shaft * shaft
    ring_motion(t, y, at, model, on_ring, rate, totals)

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
    for p in range(slots):
        couple = space[row + p]
        on_cages = plus(on_cages, couple, vector_at(space, col.Z_WX, p))
        relative += couple * model.tilt_cosine if space[col.SIDE + p] < 0.0 else 0.0
    return relative, on_cages


@inlined
def ring_motion(t, y, at, model, on_ring, rate, totals):
    """Compute the outer ring's rates under the rollers' force `on_ring` [N], and the powers of load and housing [W]."""
    place, velocity = entries_from(y, at.ring), entries_from(y, at.ring_rate)
    rate[at.ring], rate[at.ring + 1], rate[at.ring + 2] = velocity
    kh, ch = model.housing_stiffness, model.housing_damping
    cosine, sine = model.drive.direction_cosine, model.drive.direction_sine
    radial, axial = external_load(t, model.drive)
    push = radial * cosine, radial * sine + model.ring_mass * model.gravity, axial
    force = plus(plus(plus(push, 1.0, on_ring), -kh, place), -ch, velocity)
    for m in range(3):
        rate[at.ring_rate + m] = force[m] / model.ring_mass
    totals[col.LOAD_POWER] = radial * (cosine * velocity[0] + sine * velocity[1]) + axial * velocity[2]
    totals[col.HOUSING_POWER] = ch * dot(velocity, velocity)


@kernel_part
def shaft_motion(t, drive):
    """Compute the shaft's speed [rad/s] and angle [rad] at time `t` [s]; speed: linear between entries of `drive`."""
    table = drive.speed
    i, j, share = place_in_time(t, table[0])
    speed = table[1, i] + share * (table[1, j] - table[1, i])
    return speed, table[2, i] + 0.5 * (table[1, i] + speed) * (t - table[0, i])


@kernel_part
def external_load(t, drive):
    """Compute radial and axial load [N] at time `t` [s]: linear between entries of `drive`, constant outside them."""
    table = drive.load
    i, j, share = place_in_time(t, table[0])
    return table[1, i] + share * (table[1, j] - table[1, i]), table[2, i] + share * (table[2, j] - table[2, i])


@kernel_part
def place_in_time(t, time_s):
    """Find the entries of `time_s` before and after `t`, the same outside the table, and the weight of the second."""
    last = time_s.shape[0] - 1
    if t <= time_s[0]:
        return 0, 0, 0.0
    if t >= time_s[last]:
        return last, last, 0.0
    i = np.searchsorted(time_s, t) - 1
    return i, i + 1, (t - time_s[i]) / (time_s[i + 1] - time_s[i])
