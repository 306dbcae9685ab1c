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
from srbval.models.full.vectors_kernel import cross, dot, entries_from, plus, plus_dyad, times, vector_at
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
    space = model.space
    s, c = -model.tilt_sine, model.tilt_cosine  # parts of the axis along a slot and along its roller, row 2
    carried = times(y[at.relative_rate], cross(entries_from(y, at.cage_rate), axis))  # a' omega x t
    relative, taken, torque = times(second, axis), times(second, carried), 0.0
    for p in range(slots):
        if not space[col.SIDE + p] < 0.0:
            continue
        q = p + col.INNER
        x, z = vector_at(space, col.X_WX, p), vector_at(space, col.Z_WX, p)
        w_x, w_y, w_z = vector_at(space, col.CAGE_X, p)
        reach = model.centre_distance + space[col.SLIDE + p]
        arm, transverse = model.roller_mass * reach * reach, model.roller_transverse
        # as in `right_hand_side`: the torques about the slot and about the roller's axis that its cage must bear
        gyro = model.roller_axial * space[col.SPIN + p] - transverse * w_z
        f_y = space[col.F_Y + p] + space[col.F_Y + q] + model.roller_mass * model.gravity * space[col.Y_WY + p]
        q_x = space[col.T_X + p] + space[col.T_X + q] - gyro * w_y
        q_z = reach * f_y - arm * w_x * w_y - 2.0 * model.roller_mass * reach * space[col.SLIDE_RATE + p] * w_z
        relative = plus(relative, 1.0, carried_inertia(axis, arm, x, transverse, z))
        taken = plus(taken, 1.0, carried_inertia(carried, arm, x, transverse, z))
        torque += s * q_x + c * q_z
    totals[col.RELATIVE_X], totals[col.RELATIVE_Y], totals[col.RELATIVE_Z] = relative
    totals[col.RELATIVE_AXIAL] = dot(relative, axis)
    return torque - dot(relative, carried), plus(torque_on_cages, -1.0, taken)


@kernel_part
def carried_inertia(rate, arm, x, transverse, z):
    """Multiply the inertia of a roller on its cage, `arm` (1 - x x) + `transverse` (1 - z z), by the vector `rate`."""
    return plus(plus(times(arm + transverse, rate), -arm * dot(rate, x), x), -transverse * dot(rate, z), z)


@kernel_part
def eliminate_relative_rate(second, totals, torque, on_cages, inertia):
    """Eliminate the acceleration of row 2's cage relative to row 1's from the equations of motion of both cages.

    `torque`: on row 2's cage about its axis; `on_cages`: torque on both cages; `inertia`: their tensor, xx, yy, zz, xy,
    xz, yz. Returns torque and tensor of the reduced equation: tensor times acceleration of row 1's cage is torque.
    """
    if second is None:
        return on_cages, inertia
    coupling, per = entries_from(totals, col.RELATIVE_X), 1.0 / totals[col.RELATIVE_AXIAL]
    return plus(on_cages, -per * torque, coupling), plus_dyad(inertia, -per, coupling)


@kernel_part
def fill_relative_rates(second, y, at, totals, torque, rate):
    """Store in `rate` the time derivatives of the angle and of the speed of row 2's cage relative to row 1's."""
    if second is None:
        return
    taken = dot(entries_from(totals, col.RELATIVE_X), entries_from(rate, at.cage_rate))
    rate[at.relative_angle] = y[at.relative_rate]
    rate[at.relative_rate] = (torque - taken) / totals[col.RELATIVE_AXIAL]


@kernel_part
def relative_load(second, weight, model, totals, rate, at, on_cage):
    """Compute the right-hand sides of the equations of `damping_kernel.solve` for a bearing with a cage for each row.

    `on_cage`: right-hand sides for row 1's cage, if row 2's did not accelerate relative to it. Returns them corrected,
    and the right-hand side for the speed of row 2's cage relative to row 1's.
    """
    if second is None:
        return on_cage, 0.0
    space, per = model.space, 1.0 / weight
    coupling, ahead = times(per, entries_from(totals, col.RELATIVE_X)), rate[at.relative_rate]
    g = dot(coupling, entries_from(rate, at.cage_rate)) + per * totals[col.RELATIVE_AXIAL] * ahead
    for p in range(np.uint64(model.slots)):
        if space[col.SIDE + p] < 0.0:
            u, s = space[col.SLIDE_ACCELERATION + p], space[col.SPIN_ACCELERATION + p]
            g -= model.tilt_cosine * (space[col.U_WZ + p] * u + space[col.S_WZ + p] * s)
    return plus(on_cage, ahead, coupling), g


@kernel_part
def relative_energy(second, rate, along):
    """Compute twice the kinetic energy [J] that row 2's cage has beyond that at the speed of row 1's cage.

    `along`: angular velocity of row 1's cage about its axis; `rate`: that of row 2's cage relative to it [rad/s].
    """
    if second is None:
        return 0.0
    return second * rate * (2.0 * along + rate)
