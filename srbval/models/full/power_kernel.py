"""Kernels: torque of the drive and powers of the forces that an implicit time step applies.

An implicit step evaluates all forces F at known speeds v. It then replaces friction and contact damping by their values
at speeds v + x; the accelerations k follow from M k = F - D x, with mass matrix M and damping matrix D. If a are the
accelerations at the speeds v, M a = F, then D x = M (a - k). The shaft's speed W is given. With W's row d of D:

    (torque on the shaft at v + x) = (torque on the shaft at v) - d x
    (losses at v + x) = (losses at v) + (2 v + x) D x + 2 W d x

since the losses are the product u D u, in which u contains v and W. Without these terms in x, the drive's power is 26 %
too large in Giraudo's scene.
"""

import numpy as np

from srbval.models.full import columns as col
from srbval.models.full.columns import state_indices
from srbval.models.jit import kernel_part


@kernel_part
def shaft_row(model, factors):
    """Compute the torque of contact damping on the shaft per unit of each velocity of rollers and cages.

    A roller's velocities are its speed along its slot in the cage and its spin; their torques are stored in the
    workspace, the torques per angular velocity of a cage in row `SHAFT_ROW` of `factors`.
    """
    space, second = model.space, model.second_cage
    w0 = w1 = w2 = relative = 0.0
    for p in range(np.uint64(model.slots)):
        q = p + col.INNER
        reach, y, z = model.centre_distance + space[col.SLIDE + p], space[col.Y_WZ + p], space[col.Z_WZ + p]
        v_y, v_z = reach * z, -reach * y
        f_x = space[col.D_XY + q] * v_y + space[col.D_XZ + q] * v_z + space[col.D_XP + q] * y + space[col.D_XS + q] * z
        f_y = space[col.D_YY + q] * v_y + space[col.D_YZ + q] * v_z + space[col.D_YP + q] * y + space[col.D_YS + q] * z
        f_z = space[col.D_YZ + q] * v_y + space[col.D_ZZ + q] * v_z + space[col.D_ZP + q] * y
        t_y = space[col.D_YP + q] * v_y + space[col.D_ZP + q] * v_z + space[col.D_PP + q] * y + space[col.D_PS + q] * z
        t_z = space[col.D_YS + q] * v_y + space[col.D_PS + q] * y + space[col.D_SS + q] * z
        space[col.SHAFT_U + p], space[col.SHAFT_S + p] = f_x, t_z
        about_y, about_z = t_y - reach * f_z, reach * f_y
        w0 += about_y * space[col.Y_WX + p] + about_z * space[col.Z_WX + p]
        w1 += about_y * space[col.Y_WY + p] + about_z * space[col.Z_WY + p]
        w2 += about_y * y + about_z * z
        if second is not None:
            relative += about_z * model.tilt_cosine if space[col.SIDE + p] < 0.0 else 0.0
    r = col.SHAFT_ROW
    factors[r, 0], factors[r, 1], factors[r, 2], factors[r, 3] = w0, w1, w2, relative


@kernel_part
def add_implicit_powers(speeds, change, deficit, shaft, model, inertia, factors, totals):
    """Correct the shaft's torque and the powers in `totals` for the change of speeds in an implicit step.

    `totals` were computed at the speeds in the state `speeds`; the step adds `change` to these speeds, which lowers the
    accelerations by `deficit`. All three have the shape of a state, of which only the velocities are used. `shaft`: the
    shaft's speed [rad/s]; `inertia`: `totals` from which `factors` were computed. The power of friction is not changed:
    the change of its losses is counted as contact damping. For the equations see `power_kernel`.
    """
    n = model.slot_angle.shape[0]
    at = state_indices(speeds.shape[0])
    space, half = model.space, np.uint64(n // 2)
    torque = slide = spin = 0.0
    for i in range(half):
        j, slot = np.uint64(at.slide_rate) + i, np.uint64(2) * i
        k, other = j + half, slot + np.uint64(1)
        torque += space[col.SHAFT_U + slot] * change[j] + space[col.SHAFT_U + other] * change[k]
        slide += (2.0 * speeds[j] + change[j]) * deficit[j] + (2.0 * speeds[k] + change[k]) * deficit[k]
        j += np.uint64(n)
        k += np.uint64(n)
        torque += space[col.SHAFT_S + slot] * change[j] + space[col.SHAFT_S + other] * change[k]
        spin += (2.0 * speeds[j] + change[j]) * deficit[j] + (2.0 * speeds[k] + change[k]) * deficit[k]
    lost = model.roller_mass * slide + model.roller_axial * spin
    c, r = at.cage_rate, at.ring_rate
    housing = 0.0
    for m in range(3):
        torque += factors[col.SHAFT_ROW, m] * change[c + m]
        twice = 2.0 * speeds[r + m] + change[r + m]
        lost += model.ring_mass * twice * deficit[r + m]
        housing += model.housing_damping * twice * change[r + m]
    b0, b1, b2 = deficit[c], deficit[c + 1], deficit[c + 2]
    t0 = inertia[col.INERTIA_XX] * b0 + inertia[col.INERTIA_XY] * b1 + inertia[col.INERTIA_XZ] * b2
    t1 = inertia[col.INERTIA_XY] * b0 + inertia[col.INERTIA_YY] * b1 + inertia[col.INERTIA_YZ] * b2
    t2 = inertia[col.INERTIA_XZ] * b0 + inertia[col.INERTIA_YZ] * b1 + inertia[col.INERTIA_ZZ] * b2
    for m in range(at.relative_rate, speeds.shape[0]):  # only with a second cage
        torque += factors[col.SHAFT_ROW, 3] * change[m]
        a_x, a_y, a_z, ahead = inertia[col.RELATIVE_X], inertia[col.RELATIVE_Y], inertia[col.RELATIVE_Z], deficit[m]
        own = a_x * b0 + a_y * b1 + a_z * b2 + inertia[col.RELATIVE_AXIAL] * ahead
        lost += (2.0 * speeds[m] + change[m]) * own
        t0, t1, t2 = t0 + a_x * ahead, t1 + a_y * ahead, t2 + a_z * ahead
    lost += (2.0 * speeds[c] + change[c]) * t0 + (2.0 * speeds[c + 1] + change[c + 1]) * t1
    lost += (2.0 * speeds[c + 2] + change[c + 2]) * t2
    totals[col.SHAFT_TORQUE] += torque
    totals[col.DRIVE_POWER] -= torque * shaft
    totals[col.HOUSING_POWER] += housing
    totals[col.DAMPING_POWER] += lost - 2.0 * torque * shaft - housing
