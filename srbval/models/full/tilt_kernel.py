"""Kernels: rollers that tilt about the tangent of the race and slide along their axes, in balance at every moment.

Equations of tilt and shift: page "Equations of motion" of the theory. The points o and i are the centres of the outer
and of the inner race's arc in the roller's meridian: x outwards along the slot, the roller's place in the cage, and z
along the roller without tilt. The roller's x axis turns to the line through both. Neither contact then has a force
along the roller's axis or a moment about the tangent (moment equilibrium, which ISO/TS 16281 requires); slices keep
their place along the roller, and forces and motion of a contact are in axes of the tilted roller. The cage guides a
roller about the x axis, so the skew moment, the moment about this axis, acts on the cage. Nothing happens if `free` is
None: no roller tilts.
"""

import math

from srbval.models.full import columns as col
from srbval.models.jit import inlined, kernel_part

FREE = 1  # for `Parameters.free`


@kernel_part
def tilt_rollers(free, model, slots):
    """Compute tilt and axial shift of all rollers; turn geometry and motion of their contacts to the tilted axes."""
    if free is None:
        return
    space = model.space
    arc_radial, arc_height = model.inner_centre_radial, model.inner_centre_axial
    for p in range(slots):
        q, side = p + col.INNER, space[col.SIDE + p]
        there = side * side  # 0 of an empty slot
        o_x, o_z = space[col.O_X + p], space[col.O_Z + p]
        i_x = arc_radial * space[col.M_X + p] + arc_height * space[col.Z_X + p] + space[col.O_X + q]
        i_z = arc_radial * space[col.M_Z + p] + arc_height * space[col.Z_Z + p]
        span, rise = there * (i_x - o_x) + 1.0 - there, there * (i_z - o_z)
        per = 1.0 / math.sqrt(span * span + rise * rise)
        c, s = per * span, per * rise
        shift = there * (c * o_z - s * o_x)
        space[col.TILT_COSINE + p], space[col.TILT_SINE + p], space[col.SHIFT_ALONG + p] = c, s, shift
        # the races' arcs turn about their centres with the roller: the same arcs, their middles before the roller's
        space[col.O_X + p] += c * o_x + s * o_z - o_x
        space[col.O_Z + p] -= there * o_z
        space[col.O_X + q] += c * i_x + s * i_z - i_x
        space[col.O_Z + q] -= there * i_z
        w_x, w_z, spin = space[col.CAGE_X + p], space[col.CAGE_Z + p], space[col.SPIN + p]
        move_with_roller(space, p, c, s, shift, w_x, w_z, spin)
        move_with_roller(space, q, c, s, shift, w_x, w_z, spin)


@inlined
def move_with_roller(space, j, c, s, shift, w_x, w_z, spin):
    """Transform velocities of contact `j` to the axes of a tilted roller that is shifted by `shift` [m] along its axis.

    `c`, `s`: cosine and sine of the tilt; `w_x`, `w_z`: the cage's angular velocity about the roller's radial direction
    and about its axis, both before the tilt [rad/s]; `spin`: angular velocity of the roller about its axis [rad/s].
    """
    v_x, v_z = space[col.V_X + j], space[col.V_Z + j]
    race_x, race_z = space[col.W_X + j] + w_x, space[col.W_Z + j] + spin  # of the race itself, as in the slot
    turned = c * (race_x - w_x) + s * (race_z - w_z)
    space[col.V_X + j] = c * v_x + s * v_z
    space[col.V_Y + j] -= turned * shift
    space[col.V_Z + j] = c * v_z - s * v_x
    space[col.W_X + j], space[col.W_Z + j] = turned, c * race_z - s * race_x - spin


@kernel_part
def sums_in_slots(free, model, slots):
    """Transform forces on rollers, and the inner race's torques, from tilted rollers' axes to axes before the tilt.

    The torques of the outer race are chosen such that the sum of both races' torques is right: x and y components of
    this sum act on the cage, the z component changes the roller's spin. The skew moment, about the tilted roller's x
    axis, also has a part about the z axis before the tilt, which acts on the cage only; this part is stored in row
    `SKEW_ON_CAGE`. If rollers cannot tilt (`free` is None), nothing is done.
    """
    if free is None:
        return
    space = model.space
    for p in range(slots):
        q = p + col.INNER
        c, s, shift = space[col.TILT_COSINE + p], space[col.TILT_SINE + p], space[col.SHIFT_ALONG + p]
        outer_skew, inner_skew = force_in_slot(space, p, c, s, shift), force_in_slot(space, q, c, s, shift)
        spin, skew = space[col.T_Z + p] + space[col.T_Z + q], outer_skew + inner_skew
        inner_z = space[col.T_Z + q]
        space[col.T_X + q], space[col.T_Z + q] = c * inner_skew - s * inner_z, s * inner_skew + c * inner_z
        space[col.T_X + p], space[col.T_Z + p] = c * skew - space[col.T_X + q], spin - space[col.T_Z + q]
        space[col.SKEW_MOMENT + p], space[col.SKEW_ON_CAGE + p] = skew, s * skew


@inlined
def force_in_slot(space, j, c, s, shift):
    """Turn contact `j`'s force from tilted to untilted axes; return the contact's torque about the tilted x axis."""
    f_x, f_y, f_z = space[col.F_X + j], space[col.F_Y + j], space[col.F_Z + j]
    space[col.F_X + j], space[col.F_Z + j] = c * f_x - s * f_z, s * f_x + c * f_z
    return space[col.T_X + j] - shift * f_y
