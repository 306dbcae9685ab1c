"""Kernels: a second cage for row 2, which turns about the axis of row 1's cage and tilts with it.

The cages of both rows ride on one guide ring. The relative angle a, by which row 2's cage is ahead, is a fourth
coordinate beside the cage's three. With the cage's axis t, the cage and the rollers of row 2 turn at omega_2 = omega +
a' t, so that their angular acceleration is omega' + a'' t + a' omega x t. Kane's equation for a has the partial angular
velocity t. `second` is the moment of inertia of row 2's cage about its axis [kg m2], None with one cage for both rows;
functions then leave their arguments unchanged. The model's other inertia values include both cages.
"""

import math
from typing import NamedTuple

import numpy as np

from srbval.models.full import columns as col
from srbval.models.jit import kernel_part


class CageTurns(NamedTuple):
    """Cosine and sine of row 1's and of row 2's cage angle; `ahead`, `rate`: row 2's angle and speed minus row 1's."""

    cosine: float
    sine: float
    second_cosine: float
    second_sine: float
    ahead: float
    rate: float


@kernel_part
def cage_turns(y, at, second):
    """Compute angles and relative speed of the cages of row 1 and row 2 in the state `y`; `second` None: one cage."""
    turn = y[at.cage + 2]
    c, s = math.cos(turn), math.sin(turn)
    if second is None:
        return CageTurns(c, s, c, s, 0.0, 0.0)
    ahead = y[at.relative_angle]
    return CageTurns(c, s, math.cos(turn + ahead), math.sin(turn + ahead), ahead, y[at.relative_rate])


@kernel_part
def cage_of_row(turns, side):
    """Select angle (cosine, sine) and speed relative to row 1's cage for the cage of row 1 (`side` 1) or row 2 (-1)."""
    if side < 0.0:
        return turns.second_cosine, turns.second_sine, turns.rate
    return turns.cosine, turns.sine, 0.0


@kernel_part
def second_cage_torque(second, model, y, at, slots, totals, torque_on_cages, axis):
    """Compute the torque on row 2's cage about its axis, and correct the torque on both cages together [N m].

    Row 1's cage turns at omega, row 2's at omega + a' t, with the unit vector t along the common `axis`. The term a'
    omega x t of row 2's angular acceleration causes inertia torques, which the correction subtracts. Stores the inertia
    of the relative motion in `totals`. `torque_on_cages`, `axis`: components in world axes.
    """
    if second is None:
        return 0.0, torque_on_cages
    g_x, g_y, g_z = torque_on_cages
    t_x, t_y, t_z = axis
    space = model.space
    s, c = -model.tilt_sine, model.tilt_cosine  # parts of the axis along a slot and along its roller, row 2
    omega_x, omega_y, omega_z = y[at.cage_rate], y[at.cage_rate + 1], y[at.cage_rate + 2]
    rate = y[at.relative_rate]
    # a' omega x t
    b_x = rate * (omega_y * t_z - omega_z * t_y)
    b_y = rate * (omega_z * t_x - omega_x * t_z)
    b_z = rate * (omega_x * t_y - omega_y * t_x)
    axial = second
    a_x, a_y, a_z = axial * t_x, axial * t_y, axial * t_z
    g_x, g_y, g_z = g_x - axial * b_x, g_y - axial * b_y, g_z - axial * b_z
    torque = 0.0
    for p in range(slots):
        if not space[col.SIDE + p] < 0.0:
            continue
        q = p + col.INNER
        x_x, x_y, x_z = space[col.X_WX + p], space[col.X_WY + p], space[col.X_WZ + p]
        z_x, z_y, z_z = space[col.Z_WX + p], space[col.Z_WY + p], space[col.Z_WZ + p]
        w_x, w_y, w_z = space[col.CAGE_X + p], space[col.CAGE_Y + p], space[col.CAGE_Z + p]
        reach = model.centre_distance + space[col.SLIDE + p]
        arm, cross = model.roller_mass * reach * reach, model.roller_transverse
        # as in `right_hand_side`: the torques about the slot and about the roller's axis that its cage must bear
        gyro = model.roller_axial * space[col.SPIN + p] - cross * w_z
        f_y = space[col.F_Y + p] + space[col.F_Y + q] + model.roller_mass * model.gravity * space[col.Y_WY + p]
        q_x = space[col.T_X + p] + space[col.T_X + q] - gyro * w_y
        q_z = reach * f_y - arm * w_x * w_y - 2.0 * model.roller_mass * reach * space[col.SLIDE_RATE + p] * w_z
        torque += s * q_x + c * q_z
        a_x += arm * (t_x - s * x_x) + cross * (t_x - c * z_x)
        a_y += arm * (t_y - s * x_y) + cross * (t_y - c * z_y)
        a_z += arm * (t_z - s * x_z) + cross * (t_z - c * z_z)
        axial += arm * (1.0 - s * s) + cross * (1.0 - c * c)
        along, about = arm * (b_x * x_x + b_y * x_y + b_z * x_z), cross * (b_x * z_x + b_y * z_y + b_z * z_z)
        h_x = (arm + cross) * b_x - along * x_x - about * z_x
        h_y = (arm + cross) * b_y - along * x_y - about * z_y
        h_z = (arm + cross) * b_z - along * x_z - about * z_z
        g_x, g_y, g_z = g_x - h_x, g_y - h_y, g_z - h_z
        torque -= h_x * t_x + h_y * t_y + h_z * t_z
    totals[col.RELATIVE_X], totals[col.RELATIVE_Y], totals[col.RELATIVE_Z] = a_x, a_y, a_z
    totals[col.RELATIVE_AXIAL] = axial
    return torque, (g_x, g_y, g_z)


@kernel_part
def eliminate_relative_rate(second, totals, torque, on_cages, inertia):
    """Eliminate the acceleration of row 2's cage relative to row 1's from the equations of motion of both cages.

    `torque`: on row 2's cage about its axis; `on_cages`: torque on both cages; `inertia`: their tensor, xx, yy, zz, xy,
    xz, yz. Returns torque and tensor of the reduced equation: tensor times acceleration of row 1's cage is torque.
    """
    if second is None:
        return on_cages, inertia
    g_x, g_y, g_z = on_cages
    m00, m11, m22, m01, m02, m12 = inertia
    a_x, a_y, a_z = totals[col.RELATIVE_X], totals[col.RELATIVE_Y], totals[col.RELATIVE_Z]
    per = 1.0 / totals[col.RELATIVE_AXIAL]
    f = per * torque
    return (g_x - f * a_x, g_y - f * a_y, g_z - f * a_z), (
        m00 - per * a_x * a_x,
        m11 - per * a_y * a_y,
        m22 - per * a_z * a_z,
        m01 - per * a_x * a_y,
        m02 - per * a_x * a_z,
        m12 - per * a_y * a_z,
    )


@kernel_part
def fill_relative_rates(second, y, at, totals, torque, rate):
    """Store in `rate` the time derivatives of the angle and of the speed of row 2's cage relative to row 1's."""
    if second is None:
        return
    taken = totals[col.RELATIVE_X] * rate[at.cage_rate] + totals[col.RELATIVE_Y] * rate[at.cage_rate + 1]
    taken += totals[col.RELATIVE_Z] * rate[at.cage_rate + 2]
    rate[at.relative_angle] = y[at.relative_rate]
    rate[at.relative_rate] = (torque - taken) / totals[col.RELATIVE_AXIAL]


@kernel_part
def relative_load(second, weight, model, totals, rate, at, g0, g1, g2):
    """Compute the right-hand sides of the equations of `damping_kernel.solve` for a bearing with a cage for each row.

    `g0` to `g2`: right-hand sides for row 1's cage, if row 2's did not accelerate relative to it. Returns them
    corrected, and the right-hand side for the speed of row 2's cage relative to row 1's.
    """
    if second is None:
        return g0, g1, g2, 0.0
    space, per = model.space, 1.0 / weight
    a_x, a_y, a_z = per * totals[col.RELATIVE_X], per * totals[col.RELATIVE_Y], per * totals[col.RELATIVE_Z]
    ahead = rate[at.relative_rate]
    g = a_x * rate[at.cage_rate] + a_y * rate[at.cage_rate + 1] + a_z * rate[at.cage_rate + 2]
    g += per * totals[col.RELATIVE_AXIAL] * ahead
    for p in range(np.uint64(model.slots)):
        if space[col.SIDE + p] < 0.0:
            u, s = space[col.SLIDE_ACCELERATION + p], space[col.SPIN_ACCELERATION + p]
            g -= model.tilt_cosine * (space[col.U_WZ + p] * u + space[col.S_WZ + p] * s)
    return g0 + a_x * ahead, g1 + a_y * ahead, g2 + a_z * ahead, g


@kernel_part
def relative_energy(second, rate, along):
    """Compute twice the kinetic energy [J] that row 2's cage has beyond that at the speed of row 1's cage.

    `along`: angular velocity of row 1's cage about its axis; `rate`: that of row 2's cage relative to it [rad/s].
    """
    if second is None:
        return 0.0
    return second * rate * (2.0 * along + rate)
