"""Kernels: solve the linear equations of a step that treats friction and contact damping implicitly.

The secant damping matrix of a contact, force on its roller divided by the race's velocity u relative to it, is::

    C = drag (1 - n n) + c n n,   drag = mu(|u_t|) N / |u_t|

with normal n, normal force N, slip u_t, coefficient of friction mu (Giraudo's eq. 19) and damper c (eq. 18). Changes of
N by the damper, and of mu with the slip, are left out. At a point p of the roller u = V + W x p, with the race's
velocity V at the roller's centre and its angular velocity W, both relative to the roller. The sums over a contact's
points are a symmetric matrix, which gives the force and the torque about y and z from V, W_y and W_z. Its entries are
the rows `D_XX` to `D_SS` of the workspace: X, Y, Z stand for the components of force and V, P for torque and W about y,
S for torque and W about z. W_x is left out: lever arms about x are as short as the contact. Axes: x outwards along the
slot of the cage in which the roller slides, y along the race, z along the roller. Outer race: V = (v_x - r, v_y - L
w_z, v_z + L w_y), W_y = -w_y, W_z = -s; sliding speed r along x, spin s about z, angular velocity w of the cage,
velocity v of the ring, distance L of the roller from the bearing's centre. Inner race: v = 0; the shaft turns as given.

With the mass matrix M, the step h and the damping matrix D of all bodies, M / h + D is an arrow matrix: a 2 x 2 block
for each roller, bordered by the 6 x 6 block of cage and ring. The rollers' blocks are eliminated; the rest is factored
by Cholesky's method (Golub & Van Loan 2013, sect. 4.2).

Torque of the drive and powers are those of the forces that the step applies. An implicit step evaluates all forces F at
known speeds v. It then replaces friction and contact damping by their values at speeds v + x; the accelerations k
follow from M k = F - D x. If a are the accelerations at the speeds v, M a = F, then D x = M (a - k). The shaft's speed
W is given. With W's row d of D:

    (torque on the shaft at v + x) = (torque on the shaft at v) - d x
    (losses at v + x) = (losses at v) + (2 v + x) D x + 2 W d x

since the losses are the product u D u, in which u contains v and W. Without these terms in x, the drive's power is 26 %
too large in Giraudo's scene.
"""

import math

import numpy as np

from srbval.models.full import columns as col
from srbval.models.full.columns import state_indices
from srbval.models.full.frames_kernel import roller_in
from srbval.models.full.second_cage_kernel import relative_load
from srbval.models.full.vectors_kernel import (
    along_axes,
    axes_at,
    dot,
    entries_from,
    inertia_in,
    plus,
    plus_outer,
    store_vector,
    tensor_times,
    times,
    to_world,
    vector_at,
)
from srbval.models.jit import inlined, kernel_part

BORDER = 6  # cage angular velocity, ring velocity, world axes


@kernel_part
def factor(weight, model, totals, factors):
    """Factor the matrix M / `weight` + D of an implicit step for `solve`; M: masses, D: friction and contact damping.

    The inverses of the rollers' 2 x 2 blocks are stored in the workspace, the factor of the remaining 6 x 6 matrix of
    cage and ring in `factors`. `weight` [s], above 0: step times the method's implicit coefficient. `totals`: from
    `right_hand_side` at the same state.
    """
    space, second = model.space, model.second_cage
    per, tilt_cosine = 1.0 / weight, model.tilt_cosine
    mass, axial, distance = per * model.roller_mass, per * model.roller_axial, model.centre_distance
    zero = 0.0, 0.0, 0.0
    cage, coupling, ring = (zero, zero, zero), (zero, zero, zero), (zero, zero, zero)  # coupling: ring by cage
    own, on_cage, on_ring = 0.0, zero, zero  # of a second cage's rotation relative to the first
    for p in range(np.uint64(model.slots)):
        q = p + col.INNER
        reach = distance + space[col.SLIDE + p]
        o_x, from_yy, o_p = vector_at(space, col.D_XX, p), vector_at(space, col.D_YY, p), vector_at(space, col.D_XP, p)
        o_xs, o_ys = space[col.D_XS + p], space[col.D_YS + p]
        b_xx, b_xy, b_xz = plus(o_x, 1.0, vector_at(space, col.D_XX, q))
        b_yy, b_yz, b_zz = plus(from_yy, 1.0, vector_at(space, col.D_YY, q))
        b_xp, b_yp, b_zp = plus(o_p, 1.0, vector_at(space, col.D_XP, q))
        b_xs, b_ys = o_xs + space[col.D_XS + q], o_ys + space[col.D_YS + q]
        b_pp = space[col.D_PP + p] + space[col.D_PP + q]
        b_ps = space[col.D_PS + p] + space[col.D_PS + q]
        b_ss = space[col.D_SS + p] + space[col.D_SS + q]
        o_y, o_z = (o_x[1], from_yy[0], from_yy[1]), (o_x[2], from_yy[1], from_yy[2])
        # inverse of the roller's block
        u_u, u_s, s_s = mass + b_xx, b_xs, axial + b_ss
        inverse = 1.0 / (u_u * s_s - u_s * u_s)
        own_uu, own_us, own_ss = s_s * inverse, -u_s * inverse, u_u * inverse
        store_vector(space, col.OWN_UU, p, (own_uu, own_us, own_ss))
        # coupling of slide and spin with cage and ring
        u_wy, u_wz, s_wy, s_wz = b_xp - reach * b_xz, reach * b_xy, b_ps, reach * b_ys
        u_r, s_r = times(-1.0, o_x), (-o_xs, -o_ys, 0.0)
        g_wy, g_wz = own_uu * u_wy + own_us * s_wy, own_uu * u_wz + own_us * s_wz
        h_wy, h_wz = own_us * u_wy + own_ss * s_wy, own_us * u_wz + own_ss * s_wz
        g_r, h_r = plus(times(own_uu, u_r), own_us, s_r), plus(times(own_us, u_r), own_ss, s_r)
        space[col.U_WY + p], space[col.U_WZ + p] = g_wy, g_wz
        store_vector(space, col.U_RX, p, g_r)
        space[col.S_WY + p], space[col.S_WZ + p] = h_wy, h_wz
        store_vector(space, col.S_RX, p, h_r)
        # cage and ring after elimination of slide and spin, slot axes
        a_yy = reach * reach * b_zz - 2.0 * reach * b_zp + b_pp - u_wy * g_wy - s_wy * h_wy
        a_yz = reach * (b_yp - reach * b_yz) - u_wy * g_wz - s_wy * h_wz
        a_zz = reach * reach * b_yy - u_wz * g_wz - s_wz * h_wz
        y_ring = plus(plus(plus(times(reach, o_z), -1.0, o_p), -u_wy, g_r), -s_wy, h_r)
        z_ring = plus(plus(times(-reach, o_y), -u_wz, g_r), -s_wz, h_r)
        d_x = plus(plus(o_x, -u_r[0], g_r), -s_r[0], h_r)
        d_y = plus(plus(o_y, -u_r[1], g_r), -s_r[1], h_r)
        d_z = plus(o_z, -u_r[2], g_r)
        # to world axes
        axes = axes_at(space, col.X_WX, p)
        x, y, z = axes
        z_cage, z_ring = plus(times(a_yz, y), a_zz, z), to_world(z_ring, axes)
        cage = plus_outer(plus_outer(cage, y, plus(times(a_yy, y), a_yz, z)), z, z_cage)
        coupling = plus_outer(plus_outer(coupling, to_world(y_ring, axes), y), z_ring, z)
        ring = plus_outer(plus_outer(ring, x, to_world(d_x, axes)), y, to_world(d_y, axes))
        ring = plus_outer(ring, z, to_world(d_z, axes))
        if second is not None:
            share = tilt_cosine if space[col.SIDE + p] < 0.0 else 0.0
            own += share * share * a_zz
            on_cage, on_ring = plus(on_cage, share, z_cage), plus(on_ring, share, z_ring)
    per_ring = per * model.ring_mass + model.housing_damping
    xx, yy, zz, xy, xz, yz = inertia_in(totals)
    factors[0, 0] = per * xx + cage[0][0]
    factors[1, 0], factors[1, 1] = per * xy + cage[1][0], per * yy + cage[1][1]
    factors[2, 0], factors[2, 1], factors[2, 2] = plus(cage[2], per, (xz, yz, zz))
    factors[3, 0], factors[3, 1], factors[3, 2] = coupling[0]
    factors[4, 0], factors[4, 1], factors[4, 2] = coupling[1]
    factors[5, 0], factors[5, 1], factors[5, 2] = coupling[2]
    factors[3, 3] = per_ring + ring[0][0]
    factors[4, 3], factors[4, 4] = ring[1][0], per_ring + ring[1][1]
    factors[5, 3], factors[5, 4], factors[5, 5] = plus(ring[2], per_ring, (0.0, 0.0, 1.0))
    factor_border(factors)
    factor_relative(second, per, totals, factors, own, on_cage, on_ring)


@kernel_part
def factor_relative(second, per, totals, factors, own, on_cage, on_ring):
    """Extend the factored equations of cage and ring, `factors`, by a second cage's rotation relative to the first.

    `own`, `on_cage` and `on_ring` are this rotation's row of D; the row of M, times `per` [1/s], is added.
    """
    if second is None:
        return
    own += per * totals[col.RELATIVE_AXIAL]
    on_cage = plus(on_cage, per, entries_from(totals, col.RELATIVE_X))
    b, f = col.RELATIVE_BORDER, col.RELATIVE_FOLLOWED
    factors[b, 0], factors[b, 1], factors[b, 2] = on_cage
    factors[b, 3], factors[b, 4], factors[b, 5] = on_ring
    on_cage, on_ring = solve_border(factors, on_cage, on_ring)
    factors[f, 0], factors[f, 1], factors[f, 2] = on_cage
    factors[f, 3], factors[f, 4], factors[f, 5] = on_ring
    for m in range(BORDER):
        own -= factors[b, m] * factors[f, m]
    factors[col.RELATIVE_OWN, 0] = 1.0 / own


@kernel_part
def solve_relative(second, factors, load, cage, ring):
    """Compute the acceleration of a second cage relative to the first, and correct `cage` and `ring` for it.

    `cage`, `ring`: accelerations of the first cage and the ring if the relative acceleration were zero; `load`:
    right-hand side of the relative acceleration's equation, from `relative_load`.
    """
    if second is None:
        return 0.0, cage, ring
    border, followed = factors[col.RELATIVE_BORDER], factors[col.RELATIVE_FOLLOWED]
    load -= dot(entries_from(border, 0), cage) + dot(entries_from(border, 3), ring)
    relative = load * factors[col.RELATIVE_OWN, 0]
    cage, ring = plus(cage, -relative, entries_from(followed, 0)), plus(ring, -relative, entries_from(followed, 3))
    return relative, cage, ring


@inlined
def factor_border(factors):
    """Replace the symmetric 6 x 6 matrix in `factors` by its Cholesky factor, with inverted diagonal entries."""
    for j in range(BORDER):
        for i in range(j, BORDER):
            left = factors[i, j]
            for k in range(j):
                left -= factors[i, k] * factors[j, k]
            factors[i, j] = left * factors[j, j] if i > j else 1.0 / math.sqrt(left)


@kernel_part
def solve(weight, model, totals, factors, rate):
    """Replace the accelerations a in `rate` by x with (M + h D) x = M a (mass matrix M, damping matrix D).

    h is the `weight`; the rest of `rate` is unchanged. Call `factor` before, with the same `weight` and `totals`; it
    fills `factors` and the workspace.
    """
    n = model.slot_angle.shape[0]
    at = state_indices(rate.shape[0])
    space, second = model.space, model.second_cage
    slots = np.uint64(model.slots)
    per = 1.0 / weight
    mass, axial = per * model.roller_mass, per * model.roller_axial
    for slot in range(n):
        j = roller_in(slot, n)
        space[col.SLIDE_ACCELERATION + np.uint64(slot)] = mass * rate[at.slide_rate + j]
        space[col.SPIN_ACCELERATION + np.uint64(slot)] = axial * rate[at.spin + j]
    cage = tensor_times(inertia_in(totals), times(per, entries_from(rate, at.cage_rate)))
    ring = times(per * model.ring_mass, entries_from(rate, at.ring_rate))
    for p in range(slots):
        axes = axes_at(space, col.X_WX, p)
        u, s = space[col.SLIDE_ACCELERATION + p], space[col.SPIN_ACCELERATION + p]
        w_y, w_z = space[col.U_WY + p] * u + space[col.S_WY + p] * s, space[col.U_WZ + p] * u + space[col.S_WZ + p] * s
        cage = plus(plus(cage, -w_y, axes[1]), -w_z, axes[2])
        r = plus(times(u, vector_at(space, col.U_RX, p)), s, vector_at(space, col.S_RX, p))
        ring = plus(ring, -1.0, to_world(r, axes))
    cage, load = relative_load(second, weight, model, totals, rate, at, cage)
    cage, ring = solve_border(factors, cage, ring)
    relative, cage, ring = solve_relative(second, factors, load, cage, ring)
    for p in range(slots):
        axes = axes_at(space, col.X_WX, p)
        u, s = space[col.SLIDE_ACCELERATION + p], space[col.SPIN_ACCELERATION + p]
        w_y, w_z, r = dot(cage, axes[1]), dot(cage, axes[2]), along_axes(ring, axes)
        w_z = w_z + model.tilt_cosine * relative if space[col.SIDE + p] < 0.0 else w_z
        slide = space[col.OWN_UU + p] * u + space[col.OWN_US + p] * s - dot(vector_at(space, col.U_RX, p), r)
        spin = space[col.OWN_US + p] * u + space[col.OWN_SS + p] * s - dot(vector_at(space, col.S_RX, p), r)
        slide = slide - space[col.U_WY + p] * w_y - space[col.U_WZ + p] * w_z
        spin = spin - space[col.S_WY + p] * w_y - space[col.S_WZ + p] * w_z
        space[col.SLIDE_ACCELERATION + p], space[col.SPIN_ACCELERATION + p] = slide, spin
    write_accelerations(space, n, at, rate)
    rate[at.cage_rate], rate[at.cage_rate + 1], rate[at.cage_rate + 2] = cage
    rate[at.ring_rate], rate[at.ring_rate + 1], rate[at.ring_rate + 2] = ring
    for m in range(at.relative_angle, at.slide_rate):  # only with a second cage
        rate[at.slide_rate + m] = relative


@kernel_part
def write_accelerations(space, rollers, at, rate):
    """Copy the rollers' accelerations from `space` to `rate`."""
    for slot in range(rollers):
        j = roller_in(slot, rollers)
        rate[at.slide_rate + j] = space[col.SLIDE_ACCELERATION + np.uint64(slot)]
        rate[at.spin + j] = space[col.SPIN_ACCELERATION + np.uint64(slot)]


@inlined
def solve_border(factors, cage, ring):
    """Solve the 6 x 6 equations of `cage` and `ring`, factored by `factor_border`, for these right-hand sides."""
    (g0, g1, g2), (g3, g4, g5) = cage, ring
    g0 *= factors[0, 0]
    g1 = (g1 - factors[1, 0] * g0) * factors[1, 1]
    g2 = (g2 - factors[2, 0] * g0 - factors[2, 1] * g1) * factors[2, 2]
    g3 = (g3 - factors[3, 0] * g0 - factors[3, 1] * g1 - factors[3, 2] * g2) * factors[3, 3]
    g4 = (g4 - factors[4, 0] * g0 - factors[4, 1] * g1 - factors[4, 2] * g2 - factors[4, 3] * g3) * factors[4, 4]
    g5 -= factors[5, 0] * g0 + factors[5, 1] * g1 + factors[5, 2] * g2 + factors[5, 3] * g3 + factors[5, 4] * g4
    g5 *= factors[5, 5] * factors[5, 5]
    g4 = (g4 - factors[5, 4] * g5) * factors[4, 4]
    g3 = (g3 - factors[4, 3] * g4 - factors[5, 3] * g5) * factors[3, 3]
    g2 = (g2 - factors[3, 2] * g3 - factors[4, 2] * g4 - factors[5, 2] * g5) * factors[2, 2]
    g1 = (g1 - factors[2, 1] * g2 - factors[3, 1] * g3 - factors[4, 1] * g4 - factors[5, 1] * g5) * factors[1, 1]
    g0 -= factors[1, 0] * g1 + factors[2, 0] * g2 + factors[3, 0] * g3 + factors[4, 0] * g4 + factors[5, 0] * g5
    g0 *= factors[0, 0]
    return (g0, g1, g2), (g3, g4, g5)


@kernel_part
def shaft_row(model, factors):
    """Compute the torque of contact damping on the shaft per unit of each velocity of rollers and cages.

    A roller's velocities are its speed along its slot in the cage and its spin; their torques are stored in the
    workspace, the torques per angular velocity of a cage in row `SHAFT_ROW` of `factors`.
    """
    space, second = model.space, model.second_cage
    on_cages, relative = (0.0, 0.0, 0.0), 0.0
    for p in range(np.uint64(model.slots)):
        q = p + col.INNER
        _, along, axis = axes_at(space, col.X_WX, p)
        reach, y, z = model.centre_distance + space[col.SLIDE + p], along[2], axis[2]
        v_y, v_z = reach * z, -reach * y
        f_x = space[col.D_XY + q] * v_y + space[col.D_XZ + q] * v_z + space[col.D_XP + q] * y + space[col.D_XS + q] * z
        f_y = space[col.D_YY + q] * v_y + space[col.D_YZ + q] * v_z + space[col.D_YP + q] * y + space[col.D_YS + q] * z
        f_z = space[col.D_YZ + q] * v_y + space[col.D_ZZ + q] * v_z + space[col.D_ZP + q] * y
        t_y = space[col.D_YP + q] * v_y + space[col.D_ZP + q] * v_z + space[col.D_PP + q] * y + space[col.D_PS + q] * z
        t_z = space[col.D_YS + q] * v_y + space[col.D_PS + q] * y + space[col.D_SS + q] * z
        space[col.SHAFT_U + p], space[col.SHAFT_S + p] = f_x, t_z
        about_y, about_z = t_y - reach * f_z, reach * f_y
        on_cages = plus(plus(on_cages, about_y, along), about_z, axis)
        if second is not None:
            relative += about_z * model.tilt_cosine if space[col.SIDE + p] < 0.0 else 0.0
    r = col.SHAFT_ROW
    factors[r, 0], factors[r, 1], factors[r, 2] = on_cages
    factors[r, 3] = relative


@kernel_part
def add_implicit_powers(speeds, change, deficit, shaft, model, factors, totals):
    """Correct the shaft's torque and the powers in `totals` for the change of speeds in an implicit step.

    `totals` were computed at the speeds in the state `speeds`; the step adds `change` to these speeds, which lowers the
    accelerations by `deficit`. All three have the shape of a state, of which only the velocities are used. `shaft`: the
    shaft's speed [rad/s]. The power of friction is not changed: the change of its losses is counted as contact damping.
    For the equations see the top of this module.
    """
    n = model.slot_angle.shape[0]
    at = state_indices(speeds.shape[0])
    space = model.space
    torque = slide = spin = 0.0
    for number in range(n):
        slot, j = np.uint64(number), roller_in(number, n)
        u, w = at.slide_rate + j, at.spin + j
        torque += space[col.SHAFT_U + slot] * change[u] + space[col.SHAFT_S + slot] * change[w]
        slide += (2.0 * speeds[u] + change[u]) * deficit[u]
        spin += (2.0 * speeds[w] + change[w]) * deficit[w]
    lost = model.roller_mass * slide + model.roller_axial * spin
    c, r = at.cage_rate, at.ring_rate
    housing = 0.0
    for m in range(3):
        torque += factors[col.SHAFT_ROW, m] * change[c + m]
        twice = 2.0 * speeds[r + m] + change[r + m]
        lost += model.ring_mass * twice * deficit[r + m]
        housing += model.housing_damping * twice * change[r + m]
    lower, middle = entries_from(deficit, c), plus(times(2.0, entries_from(speeds, c)), 1.0, entries_from(change, c))
    on_cages = tensor_times(inertia_in(totals), lower)
    for m in range(at.relative_rate, speeds.shape[0]):  # only with a second cage
        torque += factors[col.SHAFT_ROW, 3] * change[m]
        coupling = entries_from(totals, col.RELATIVE_X)
        own = dot(coupling, lower) + totals[col.RELATIVE_AXIAL] * deficit[m]
        lost += (2.0 * speeds[m] + change[m]) * own
        on_cages = plus(on_cages, deficit[m], coupling)
    lost += dot(middle, on_cages)
    totals[col.SHAFT_TORQUE] += torque
    totals[col.DRIVE_POWER] -= torque * shaft
    totals[col.HOUSING_POWER] += housing
    totals[col.DAMPING_POWER] += lost - 2.0 * torque * shaft - housing
