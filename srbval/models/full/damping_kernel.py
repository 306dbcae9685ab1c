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
from srbval.models.full.second_cage_kernel import relative_load
from srbval.models.jit import inlined, kernel_part

BORDER = 6  # cage angular velocity, ring velocity, world axes


@kernel_part
def factor(weight, model, totals, factors):
    """Factor the matrix M / `weight` + D of an implicit step for `solve`; M: masses, D: friction and contact damping.

    The inverses of the rollers' 2 x 2 blocks are stored in the workspace, the factor of the remaining 6 x 6 matrix of
    cage and ring in `factors`. `weight` [s], above 0: step times the method's implicit coefficient. `totals`: from
    `right_hand_side` at the same state.
    """
    space = model.space
    slots = np.uint64(model.slots)
    per = 1.0 / weight
    mass, axial, distance = per * model.roller_mass, per * model.roller_axial, model.centre_distance
    c00 = c11 = c22 = c01 = c02 = c12 = 0.0
    r00 = r11 = r22 = r01 = r02 = r12 = 0.0
    k00 = k01 = k02 = k10 = k11 = k12 = k20 = k21 = k22 = 0.0
    for p in range(slots):
        q = p + col.INNER
        reach = distance + space[col.SLIDE + p]
        o_xx, o_xy, o_xz = space[col.D_XX + p], space[col.D_XY + p], space[col.D_XZ + p]
        o_yy, o_yz, o_zz = space[col.D_YY + p], space[col.D_YZ + p], space[col.D_ZZ + p]
        o_xp, o_yp, o_zp = space[col.D_XP + p], space[col.D_YP + p], space[col.D_ZP + p]
        o_xs, o_ys = space[col.D_XS + p], space[col.D_YS + p]
        b_xx, b_xy, b_xz = o_xx + space[col.D_XX + q], o_xy + space[col.D_XY + q], o_xz + space[col.D_XZ + q]
        b_yy, b_yz, b_zz = o_yy + space[col.D_YY + q], o_yz + space[col.D_YZ + q], o_zz + space[col.D_ZZ + q]
        b_xp, b_yp, b_zp = o_xp + space[col.D_XP + q], o_yp + space[col.D_YP + q], o_zp + space[col.D_ZP + q]
        b_xs, b_ys = o_xs + space[col.D_XS + q], o_ys + space[col.D_YS + q]
        b_pp = space[col.D_PP + p] + space[col.D_PP + q]
        b_ps = space[col.D_PS + p] + space[col.D_PS + q]
        b_ss = space[col.D_SS + p] + space[col.D_SS + q]
        # inverse of the roller's block
        u_u, u_s, s_s = mass + b_xx, b_xs, axial + b_ss
        inverse = 1.0 / (u_u * s_s - u_s * u_s)
        own_uu, own_us, own_ss = s_s * inverse, -u_s * inverse, u_u * inverse
        space[col.OWN_UU + p], space[col.OWN_US + p], space[col.OWN_SS + p] = own_uu, own_us, own_ss
        # coupling of slide and spin with cage and ring
        u_wy, u_wz, u_rx, u_ry, u_rz = b_xp - reach * b_xz, reach * b_xy, -o_xx, -o_xy, -o_xz
        s_wy, s_wz, s_rx, s_ry, s_rz = b_ps, reach * b_ys, -o_xs, -o_ys, 0.0 * o_zz
        g_wy, g_wz = own_uu * u_wy + own_us * s_wy, own_uu * u_wz + own_us * s_wz
        g_rx, g_ry, g_rz = own_uu * u_rx + own_us * s_rx, own_uu * u_ry + own_us * s_ry, own_uu * u_rz + own_us * s_rz
        h_wy, h_wz = own_us * u_wy + own_ss * s_wy, own_us * u_wz + own_ss * s_wz
        h_rx, h_ry, h_rz = own_us * u_rx + own_ss * s_rx, own_us * u_ry + own_ss * s_ry, own_us * u_rz + own_ss * s_rz
        space[col.U_WY + p], space[col.U_WZ + p] = g_wy, g_wz
        space[col.U_RX + p], space[col.U_RY + p], space[col.U_RZ + p] = g_rx, g_ry, g_rz
        space[col.S_WY + p], space[col.S_WZ + p] = h_wy, h_wz
        space[col.S_RX + p], space[col.S_RY + p], space[col.S_RZ + p] = h_rx, h_ry, h_rz
        # cage and ring after elimination of slide and spin, slot axes
        a_yy = reach * reach * b_zz - 2.0 * reach * b_zp + b_pp - u_wy * g_wy - s_wy * h_wy
        a_yz = reach * (b_yp - reach * b_yz) - u_wy * g_wz - s_wy * h_wz
        a_zz = reach * reach * b_yy - u_wz * g_wz - s_wz * h_wz
        y_x = reach * o_xz - o_xp - u_wy * g_rx - s_wy * h_rx
        y_y = reach * o_yz - o_yp - u_wy * g_ry - s_wy * h_ry
        y_z = reach * o_zz - o_zp - u_wy * g_rz - s_wy * h_rz
        z_x = -reach * o_xy - u_wz * g_rx - s_wz * h_rx
        z_y = -reach * o_yy - u_wz * g_ry - s_wz * h_ry
        z_z = -reach * o_yz - u_wz * g_rz - s_wz * h_rz
        d_xx, d_xy, d_xz = o_xx - u_rx * g_rx - s_rx * h_rx, o_xy - u_rx * g_ry - s_rx * h_ry, o_xz - u_rx * g_rz
        d_yy, d_yz, d_zz = o_yy - u_ry * g_ry - s_ry * h_ry, o_yz - u_ry * g_rz, o_zz - u_rz * g_rz
        d_xz -= s_rx * h_rz
        d_yz -= s_ry * h_rz
        # to world axes
        x0, x1, x2 = space[col.X_WX + p], space[col.X_WY + p], space[col.X_WZ + p]
        y0, y1, y2 = space[col.Y_WX + p], space[col.Y_WY + p], space[col.Y_WZ + p]
        z0, z1, z2 = space[col.Z_WX + p], space[col.Z_WY + p], space[col.Z_WZ + p]
        c00 += a_yy * y0 * y0 + 2.0 * a_yz * y0 * z0 + a_zz * z0 * z0
        c11 += a_yy * y1 * y1 + 2.0 * a_yz * y1 * z1 + a_zz * z1 * z1
        c22 += a_yy * y2 * y2 + 2.0 * a_yz * y2 * z2 + a_zz * z2 * z2
        c01 += a_yy * y0 * y1 + a_yz * (y0 * z1 + z0 * y1) + a_zz * z0 * z1
        c02 += a_yy * y0 * y2 + a_yz * (y0 * z2 + z0 * y2) + a_zz * z0 * z2
        c12 += a_yy * y1 * y2 + a_yz * (y1 * z2 + z1 * y2) + a_zz * z1 * z2
        e0, e1, e2 = y_x * x0 + y_y * y0 + y_z * z0, y_x * x1 + y_y * y1 + y_z * z1, y_x * x2 + y_y * y2 + y_z * z2
        f0, f1, f2 = z_x * x0 + z_y * y0 + z_z * z0, z_x * x1 + z_y * y1 + z_z * z1, z_x * x2 + z_y * y2 + z_z * z2
        k00 += y0 * e0 + z0 * f0
        k01 += y0 * e1 + z0 * f1
        k02 += y0 * e2 + z0 * f2
        k10 += y1 * e0 + z1 * f0
        k11 += y1 * e1 + z1 * f1
        k12 += y1 * e2 + z1 * f2
        k20 += y2 * e0 + z2 * f0
        k21 += y2 * e1 + z2 * f1
        k22 += y2 * e2 + z2 * f2
        a0, a1, a2 = d_xx * x0 + d_xy * y0 + d_xz * z0, d_xx * x1 + d_xy * y1 + d_xz * z1, d_xx * x2 + d_xy * y2
        a2 += d_xz * z2
        b0, b1, b2 = d_xy * x0 + d_yy * y0 + d_yz * z0, d_xy * x1 + d_yy * y1 + d_yz * z1, d_xy * x2 + d_yy * y2
        b2 += d_yz * z2
        g0, g1, g2 = d_xz * x0 + d_yz * y0 + d_zz * z0, d_xz * x1 + d_yz * y1 + d_zz * z1, d_xz * x2 + d_yz * y2
        g2 += d_zz * z2
        r00 += x0 * a0 + y0 * b0 + z0 * g0
        r01 += x0 * a1 + y0 * b1 + z0 * g1
        r02 += x0 * a2 + y0 * b2 + z0 * g2
        r11 += x1 * a1 + y1 * b1 + z1 * g1
        r12 += x1 * a2 + y1 * b2 + z1 * g2
        r22 += x2 * a2 + y2 * b2 + z2 * g2
    ring = per * model.ring_mass + model.housing_damping
    factors[0, 0] = per * totals[col.INERTIA_XX] + c00
    factors[1, 0], factors[1, 1] = per * totals[col.INERTIA_XY] + c01, per * totals[col.INERTIA_YY] + c11
    factors[2, 0], factors[2, 1] = per * totals[col.INERTIA_XZ] + c02, per * totals[col.INERTIA_YZ] + c12
    factors[2, 2] = per * totals[col.INERTIA_ZZ] + c22
    factors[3, 0], factors[3, 1], factors[3, 2] = k00, k10, k20
    factors[4, 0], factors[4, 1], factors[4, 2] = k01, k11, k21
    factors[5, 0], factors[5, 1], factors[5, 2] = k02, k12, k22
    factors[3, 3] = ring + r00
    factors[4, 3], factors[4, 4] = r01, ring + r11
    factors[5, 3], factors[5, 4], factors[5, 5] = r02, r12, ring + r22
    factor_border(factors)
    factor_relative(model.second_cage, weight, model, totals, factors)


@kernel_part
def factor_relative(second, weight, model, totals, factors):
    """Extend the factored equations of cage and ring, `factors`, by a second cage's rotation relative to the first.

    `own` and the entries of `RELATIVE_BORDER` are the row of M / `weight` + D for this rotation's speed.
    """
    if second is None:
        return
    space, c = model.space, model.tilt_cosine
    per = 1.0 / weight
    w0, w1, w2 = per * totals[col.RELATIVE_X], per * totals[col.RELATIVE_Y], per * totals[col.RELATIVE_Z]
    r0 = r1 = r2 = 0.0
    own = per * totals[col.RELATIVE_AXIAL]
    for p in range(np.uint64(model.slots)):
        if not space[col.SIDE + p] < 0.0:
            continue
        # as in `factor`: a cage's rate about the roller after elimination of slide and spin
        q = p + col.INNER
        reach = model.centre_distance + space[col.SLIDE + p]
        o_xy, o_yy, o_yz = space[col.D_XY + p], space[col.D_YY + p], space[col.D_YZ + p]
        b_yy, b_yz = o_yy + space[col.D_YY + q], o_yz + space[col.D_YZ + q]
        u_wy = space[col.D_XP + p] + space[col.D_XP + q] - reach * (space[col.D_XZ + p] + space[col.D_XZ + q])
        u_wz, s_wy = reach * (o_xy + space[col.D_XY + q]), space[col.D_PS + p] + space[col.D_PS + q]
        s_wz, g_wz, h_wz = reach * (space[col.D_YS + p] + space[col.D_YS + q]), space[col.U_WZ + p], space[col.S_WZ + p]
        yz = reach * (space[col.D_YP + p] + space[col.D_YP + q] - reach * b_yz) - u_wy * g_wz - s_wy * h_wz
        zz = reach * reach * b_yy - u_wz * g_wz - s_wz * h_wz
        x = -reach * o_xy - u_wz * space[col.U_RX + p] - s_wz * space[col.S_RX + p]
        y = -reach * o_yy - u_wz * space[col.U_RY + p] - s_wz * space[col.S_RY + p]
        z = -reach * o_yz - u_wz * space[col.U_RZ + p] - s_wz * space[col.S_RZ + p]
        yz, zz, x, y, z = c * yz, c * zz, c * x, c * y, c * z
        own += c * zz
        w0 += yz * space[col.Y_WX + p] + zz * space[col.Z_WX + p]
        w1 += yz * space[col.Y_WY + p] + zz * space[col.Z_WY + p]
        w2 += yz * space[col.Y_WZ + p] + zz * space[col.Z_WZ + p]
        r0 += x * space[col.X_WX + p] + y * space[col.Y_WX + p] + z * space[col.Z_WX + p]
        r1 += x * space[col.X_WY + p] + y * space[col.Y_WY + p] + z * space[col.Z_WY + p]
        r2 += x * space[col.X_WZ + p] + y * space[col.Y_WZ + p] + z * space[col.Z_WZ + p]
    b, f = col.RELATIVE_BORDER, col.RELATIVE_FOLLOWED
    factors[b, 0], factors[b, 1], factors[b, 2], factors[b, 3], factors[b, 4], factors[b, 5] = w0, w1, w2, r0, r1, r2
    w0, w1, w2, r0, r1, r2 = solve_border(factors, w0, w1, w2, r0, r1, r2)
    factors[f, 0], factors[f, 1], factors[f, 2], factors[f, 3], factors[f, 4], factors[f, 5] = w0, w1, w2, r0, r1, r2
    for m in range(BORDER):
        own -= factors[b, m] * factors[f, m]
    factors[col.RELATIVE_OWN, 0] = 1.0 / own


@kernel_part
def solve_relative(second, factors, load, g0, g1, g2, g3, g4, g5):
    """Compute the acceleration of a second cage relative to the first, and correct `g0` to `g5` for it.

    `g0` to `g5`: accelerations of the first cage and the ring if the relative acceleration were zero; `load`:
    right-hand side of the relative acceleration's equation, from `relative_load`.
    """
    if second is None:
        return 0.0, g0, g1, g2, g3, g4, g5
    b, f = col.RELATIVE_BORDER, col.RELATIVE_FOLLOWED
    load -= factors[b, 0] * g0 + factors[b, 1] * g1 + factors[b, 2] * g2
    load -= factors[b, 3] * g3 + factors[b, 4] * g4 + factors[b, 5] * g5
    relative = load * factors[col.RELATIVE_OWN, 0]
    g0, g1, g2 = g0 - relative * factors[f, 0], g1 - relative * factors[f, 1], g2 - relative * factors[f, 2]
    g3, g4, g5 = g3 - relative * factors[f, 3], g4 - relative * factors[f, 4], g5 - relative * factors[f, 5]
    return relative, g0, g1, g2, g3, g4, g5


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
    half = n // 2
    for i in range(half):
        slot = np.uint64(2 * i)
        for row in range(2):
            j = i + row * half
            space[col.SLIDE_ACCELERATION + slot] = mass * rate[at.slide_rate + j]
            space[col.SPIN_ACCELERATION + slot] = axial * rate[at.spin + j]
            slot += np.uint64(1)
    w0, w1, w2 = per * rate[at.cage_rate], per * rate[at.cage_rate + 1], per * rate[at.cage_rate + 2]
    g0 = totals[col.INERTIA_XX] * w0 + totals[col.INERTIA_XY] * w1 + totals[col.INERTIA_XZ] * w2
    g1 = totals[col.INERTIA_XY] * w0 + totals[col.INERTIA_YY] * w1 + totals[col.INERTIA_YZ] * w2
    g2 = totals[col.INERTIA_XZ] * w0 + totals[col.INERTIA_YZ] * w1 + totals[col.INERTIA_ZZ] * w2
    ring = per * model.ring_mass
    g3, g4, g5 = ring * rate[at.ring_rate], ring * rate[at.ring_rate + 1], ring * rate[at.ring_rate + 2]
    for p in range(slots):
        u, s = space[col.SLIDE_ACCELERATION + p], space[col.SPIN_ACCELERATION + p]
        w_y, w_z = space[col.U_WY + p] * u + space[col.S_WY + p] * s, space[col.U_WZ + p] * u + space[col.S_WZ + p] * s
        r_x, r_y = space[col.U_RX + p] * u + space[col.S_RX + p] * s, space[col.U_RY + p] * u + space[col.S_RY + p] * s
        r_z = space[col.U_RZ + p] * u + space[col.S_RZ + p] * s
        g0 -= space[col.Y_WX + p] * w_y + space[col.Z_WX + p] * w_z
        g1 -= space[col.Y_WY + p] * w_y + space[col.Z_WY + p] * w_z
        g2 -= space[col.Y_WZ + p] * w_y + space[col.Z_WZ + p] * w_z
        g3 -= space[col.X_WX + p] * r_x + space[col.Y_WX + p] * r_y + space[col.Z_WX + p] * r_z
        g4 -= space[col.X_WY + p] * r_x + space[col.Y_WY + p] * r_y + space[col.Z_WY + p] * r_z
        g5 -= space[col.X_WZ + p] * r_x + space[col.Y_WZ + p] * r_y + space[col.Z_WZ + p] * r_z
    g0, g1, g2, load = relative_load(second, weight, model, totals, rate, at, g0, g1, g2)
    g0, g1, g2, g3, g4, g5 = solve_border(factors, g0, g1, g2, g3, g4, g5)
    relative, g0, g1, g2, g3, g4, g5 = solve_relative(second, factors, load, g0, g1, g2, g3, g4, g5)
    for p in range(slots):
        u, s = space[col.SLIDE_ACCELERATION + p], space[col.SPIN_ACCELERATION + p]
        w_y = space[col.Y_WX + p] * g0 + space[col.Y_WY + p] * g1 + space[col.Y_WZ + p] * g2
        w_z = space[col.Z_WX + p] * g0 + space[col.Z_WY + p] * g1 + space[col.Z_WZ + p] * g2
        w_z = w_z + model.tilt_cosine * relative if space[col.SIDE + p] < 0.0 else w_z
        r_x = space[col.X_WX + p] * g3 + space[col.X_WY + p] * g4 + space[col.X_WZ + p] * g5
        r_y = space[col.Y_WX + p] * g3 + space[col.Y_WY + p] * g4 + space[col.Y_WZ + p] * g5
        r_z = space[col.Z_WX + p] * g3 + space[col.Z_WY + p] * g4 + space[col.Z_WZ + p] * g5
        slide = space[col.OWN_UU + p] * u + space[col.OWN_US + p] * s
        slide = slide - space[col.U_WY + p] * w_y - space[col.U_WZ + p] * w_z
        slide = slide - space[col.U_RX + p] * r_x - space[col.U_RY + p] * r_y - space[col.U_RZ + p] * r_z
        spin = space[col.OWN_US + p] * u + space[col.OWN_SS + p] * s
        spin = spin - space[col.S_WY + p] * w_y - space[col.S_WZ + p] * w_z
        spin = spin - space[col.S_RX + p] * r_x - space[col.S_RY + p] * r_y - space[col.S_RZ + p] * r_z
        space[col.SLIDE_ACCELERATION + p], space[col.SPIN_ACCELERATION + p] = slide, spin
    write_accelerations(space, half, at, rate)
    rate[at.cage_rate], rate[at.cage_rate + 1], rate[at.cage_rate + 2] = g0, g1, g2
    rate[at.ring_rate], rate[at.ring_rate + 1], rate[at.ring_rate + 2] = g3, g4, g5
    for m in range(at.relative_angle, at.slide_rate):  # only with a second cage
        rate[at.slide_rate + m] = relative


@kernel_part
def write_accelerations(space, half, at, rate):
    """Copy the rollers' accelerations from `space` to `rate`."""
    for i in range(half):
        slot = np.uint64(2 * i)
        for row in range(2):
            j = i + row * half
            rate[at.slide_rate + j] = space[col.SLIDE_ACCELERATION + slot]
            rate[at.spin + j] = space[col.SPIN_ACCELERATION + slot]
            slot += np.uint64(1)


@inlined
def solve_border(factors, g0, g1, g2, g3, g4, g5):
    """Solve the 6 x 6 equations of cage and ring, factored by `factor_border`, for the right-hand side `g0` to `g5`."""
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
    return g0, g1, g2, g3, g4, g5


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
def add_implicit_powers(speeds, change, deficit, shaft, model, factors, totals):
    """Correct the shaft's torque and the powers in `totals` for the change of speeds in an implicit step.

    `totals` were computed at the speeds in the state `speeds`; the step adds `change` to these speeds, which lowers the
    accelerations by `deficit`. All three have the shape of a state, of which only the velocities are used. `shaft`: the
    shaft's speed [rad/s]. The power of friction is not changed: the change of its losses is counted as contact damping.
    For the equations see the top of this module.
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
    t0 = totals[col.INERTIA_XX] * b0 + totals[col.INERTIA_XY] * b1 + totals[col.INERTIA_XZ] * b2
    t1 = totals[col.INERTIA_XY] * b0 + totals[col.INERTIA_YY] * b1 + totals[col.INERTIA_YZ] * b2
    t2 = totals[col.INERTIA_XZ] * b0 + totals[col.INERTIA_YZ] * b1 + totals[col.INERTIA_ZZ] * b2
    for m in range(at.relative_rate, speeds.shape[0]):  # only with a second cage
        torque += factors[col.SHAFT_ROW, 3] * change[m]
        a_x, a_y, a_z, ahead = totals[col.RELATIVE_X], totals[col.RELATIVE_Y], totals[col.RELATIVE_Z], deficit[m]
        own = a_x * b0 + a_y * b1 + a_z * b2 + totals[col.RELATIVE_AXIAL] * ahead
        lost += (2.0 * speeds[m] + change[m]) * own
        t0, t1, t2 = t0 + a_x * ahead, t1 + a_y * ahead, t2 + a_z * ahead
    lost += (2.0 * speeds[c] + change[c]) * t0 + (2.0 * speeds[c + 1] + change[c + 1]) * t1
    lost += (2.0 * speeds[c + 2] + change[c + 2]) * t2
    totals[col.SHAFT_TORQUE] += torque
    totals[col.DRIVE_POWER] -= torque * shaft
    totals[col.HOUSING_POWER] += housing
    totals[col.DAMPING_POWER] += lost - 2.0 * torque * shaft - housing
