"""Kernels: the linear equations of a step that takes friction and contact damping implicitly.

What a contact's force on its roller grows with the velocity u of the race's point past the roller is

    C = drag (1 - n n) + c n n,   drag = mu(|u_t|) N / |u_t|,   c = C_c where the contact damps,

the secant of eq. (19), never negative, and the damper of eq. (18). Left out: that friction grows with the damper's
share of the normal force, and the fall of mu with the slip. With u = V + W x p at a point p of the roller the sums over
a column's points are the matrix of force and torque against V, W_y (here P) and W_z (here S); W_x, turning about the
slot, has an arm of the contact's length only and is left out. In the generalised speeds (slide u', spin s, cage w_y and
w_z, ring v; slot axes): outer race V = (v_x - u', v_y - L w_z, v_z + L w_y), W = (., -w_y, -s); inner race the
same without v.

M / h + D is an arrow: a 2 x 2 block for each roller, bordered by cage and ring, 6 x 6. The blocks are eliminated, the
border is factored by Cholesky's method (Golub & Van Loan, Matrix Computations, 2013, sect. 4.2).
"""

from __future__ import annotations

import math

import numpy as np

from srbval.models.full.columns import (
    D_PP,
    D_PS,
    D_SS,
    D_XP,
    D_XS,
    D_XX,
    D_XY,
    D_XZ,
    D_YP,
    D_YS,
    D_YY,
    D_YZ,
    D_ZP,
    D_ZZ,
    OWN_SS,
    OWN_US,
    OWN_UU,
    RACE,
    S_RX,
    S_RY,
    S_RZ,
    S_WY,
    S_WZ,
    SLIDE,
    SLIDE_RISE,
    SPIN_RISE,
    U_RX,
    U_RY,
    U_RZ,
    U_WY,
    U_WZ,
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
from srbval.models.jit import kernel

INNER = np.uint64(RACE)
BORDER = 6  # cage angular velocity, ring velocity, world axes


@kernel
def factor(weight, model, contact, border):
    """Factor M / `weight` + D, D from the columns' damping sums: blocks into the rollers' places, `border` [6, 6].

    `weight` [s], above 0, is the step times the method's coefficient. `contact`: see `right_hand_side`, of the same
    state.
    """
    space = model.scratch.space
    many = np.uint64(model.scratch.places)
    per = 1.0 / weight
    mass, axial, distance = per * model.roller_mass, per * model.roller_axial, model.centre_distance
    c00 = c11 = c22 = c01 = c02 = c12 = 0.0
    r00 = r11 = r22 = r01 = r02 = r12 = 0.0
    k00 = k01 = k02 = k10 = k11 = k12 = k20 = k21 = k22 = 0.0
    for p in range(many):
        q = p + INNER
        reach = distance + space[SLIDE + p]
        o_xx, o_xy, o_xz = space[D_XX + p], space[D_XY + p], space[D_XZ + p]
        o_yy, o_yz, o_zz = space[D_YY + p], space[D_YZ + p], space[D_ZZ + p]
        o_xp, o_yp, o_zp = space[D_XP + p], space[D_YP + p], space[D_ZP + p]
        o_xs, o_ys = space[D_XS + p], space[D_YS + p]
        b_xx, b_xy, b_xz = o_xx + space[D_XX + q], o_xy + space[D_XY + q], o_xz + space[D_XZ + q]
        b_yy, b_yz, b_zz = o_yy + space[D_YY + q], o_yz + space[D_YZ + q], o_zz + space[D_ZZ + q]
        b_xp, b_yp, b_zp = o_xp + space[D_XP + q], o_yp + space[D_YP + q], o_zp + space[D_ZP + q]
        b_xs, b_ys = o_xs + space[D_XS + q], o_ys + space[D_YS + q]
        b_pp = space[D_PP + p] + space[D_PP + q]
        b_ps = space[D_PS + p] + space[D_PS + q]
        b_ss = space[D_SS + p] + space[D_SS + q]
        # the roller's own block, solved for
        u_u, u_s, s_s = mass + b_xx, b_xs, axial + b_ss
        inverse = 1.0 / (u_u * s_s - u_s * u_s)
        own_uu, own_us, own_ss = s_s * inverse, -u_s * inverse, u_u * inverse
        space[OWN_UU + p], space[OWN_US + p], space[OWN_SS + p] = own_uu, own_us, own_ss
        # what it has in common with cage and ring: rows slide and spin
        u_wy, u_wz, u_rx, u_ry, u_rz = b_xp - reach * b_xz, reach * b_xy, -o_xx, -o_xy, -o_xz
        s_wy, s_wz, s_rx, s_ry, s_rz = b_ps, reach * b_ys, -o_xs, -o_ys, 0.0 * o_zz
        g_wy, g_wz = own_uu * u_wy + own_us * s_wy, own_uu * u_wz + own_us * s_wz
        g_rx, g_ry, g_rz = own_uu * u_rx + own_us * s_rx, own_uu * u_ry + own_us * s_ry, own_uu * u_rz + own_us * s_rz
        h_wy, h_wz = own_us * u_wy + own_ss * s_wy, own_us * u_wz + own_ss * s_wz
        h_rx, h_ry, h_rz = own_us * u_rx + own_ss * s_rx, own_us * u_ry + own_ss * s_ry, own_us * u_rz + own_ss * s_rz
        space[U_WY + p], space[U_WZ + p] = g_wy, g_wz
        space[U_RX + p], space[U_RY + p], space[U_RZ + p] = g_rx, g_ry, g_rz
        space[S_WY + p], space[S_WZ + p] = h_wy, h_wz
        space[S_RX + p], space[S_RY + p], space[S_RZ + p] = h_rx, h_ry, h_rz
        # what is left for cage and ring once slide and spin follow, slot axes
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
        x0, x1, x2 = space[X_WX + p], space[X_WY + p], space[X_WZ + p]
        y0, y1, y2 = space[Y_WX + p], space[Y_WY + p], space[Y_WZ + p]
        z0, z1, z2 = space[Z_WX + p], space[Z_WY + p], space[Z_WZ + p]
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
    border[0, 0] = per * contact[11] + c00
    border[1, 0], border[1, 1] = per * contact[14] + c01, per * contact[12] + c11
    border[2, 0], border[2, 1], border[2, 2] = per * contact[15] + c02, per * contact[16] + c12, per * contact[13] + c22
    border[3, 0], border[3, 1], border[3, 2] = k00, k10, k20
    border[4, 0], border[4, 1], border[4, 2] = k01, k11, k21
    border[5, 0], border[5, 1], border[5, 2] = k02, k12, k22
    border[3, 3] = ring + r00
    border[4, 3], border[4, 4] = r01, ring + r11
    border[5, 3], border[5, 4], border[5, 5] = r02, r12, ring + r22
    for j in range(BORDER):
        for i in range(j, BORDER):
            left = border[i, j]
            for k in range(j):
                left -= border[i, k] * border[j, k]
            border[i, j] = left * border[j, j] if i > j else 1.0 / math.sqrt(left)


@kernel
def solve(weight, model, contact, border, rate):
    """Replace the accelerations a in `rate` by those of M a = (M + h D) x: x; the rest of `rate` is left alone.

    h is the `weight`. `border` and the rollers' places as `factor` left them, `weight` and `contact` as it had them.
    """
    n = model.slot_angle.shape[0]
    d = 2 * n + 6
    space = model.scratch.space
    many = np.uint64(model.scratch.places)
    per = 1.0 / weight
    mass, axial = per * model.roller_mass, per * model.roller_axial
    half = n // 2
    for i in range(half):
        place = np.uint64(2 * i)
        for row in range(2):
            j = i + row * half
            space[SLIDE_RISE + place] = mass * rate[d + j]
            space[SPIN_RISE + place] = axial * rate[d + n + j]
            place += np.uint64(1)
    w0, w1, w2 = per * rate[d + 2 * n], per * rate[d + 2 * n + 1], per * rate[d + 2 * n + 2]
    g0 = contact[11] * w0 + contact[14] * w1 + contact[15] * w2
    g1 = contact[14] * w0 + contact[12] * w1 + contact[16] * w2
    g2 = contact[15] * w0 + contact[16] * w1 + contact[13] * w2
    ring = per * model.ring_mass
    g3, g4, g5 = ring * rate[d + 2 * n + 3], ring * rate[d + 2 * n + 4], ring * rate[d + 2 * n + 5]
    for p in range(many):
        u, s = space[SLIDE_RISE + p], space[SPIN_RISE + p]
        w_y, w_z = space[U_WY + p] * u + space[S_WY + p] * s, space[U_WZ + p] * u + space[S_WZ + p] * s
        r_x, r_y = space[U_RX + p] * u + space[S_RX + p] * s, space[U_RY + p] * u + space[S_RY + p] * s
        r_z = space[U_RZ + p] * u + space[S_RZ + p] * s
        g0 -= space[Y_WX + p] * w_y + space[Z_WX + p] * w_z
        g1 -= space[Y_WY + p] * w_y + space[Z_WY + p] * w_z
        g2 -= space[Y_WZ + p] * w_y + space[Z_WZ + p] * w_z
        g3 -= space[X_WX + p] * r_x + space[Y_WX + p] * r_y + space[Z_WX + p] * r_z
        g4 -= space[X_WY + p] * r_x + space[Y_WY + p] * r_y + space[Z_WY + p] * r_z
        g5 -= space[X_WZ + p] * r_x + space[Y_WZ + p] * r_y + space[Z_WZ + p] * r_z
    # forwards, then backwards; the factor holds its diagonal inverted
    g0 *= border[0, 0]
    g1 = (g1 - border[1, 0] * g0) * border[1, 1]
    g2 = (g2 - border[2, 0] * g0 - border[2, 1] * g1) * border[2, 2]
    g3 = (g3 - border[3, 0] * g0 - border[3, 1] * g1 - border[3, 2] * g2) * border[3, 3]
    g4 = (g4 - border[4, 0] * g0 - border[4, 1] * g1 - border[4, 2] * g2 - border[4, 3] * g3) * border[4, 4]
    g5 -= border[5, 0] * g0 + border[5, 1] * g1 + border[5, 2] * g2 + border[5, 3] * g3 + border[5, 4] * g4
    g5 *= border[5, 5] * border[5, 5]
    g4 = (g4 - border[5, 4] * g5) * border[4, 4]
    g3 = (g3 - border[4, 3] * g4 - border[5, 3] * g5) * border[3, 3]
    g2 = (g2 - border[3, 2] * g3 - border[4, 2] * g4 - border[5, 2] * g5) * border[2, 2]
    g1 = (g1 - border[2, 1] * g2 - border[3, 1] * g3 - border[4, 1] * g4 - border[5, 1] * g5) * border[1, 1]
    g0 -= border[1, 0] * g1 + border[2, 0] * g2 + border[3, 0] * g3 + border[4, 0] * g4 + border[5, 0] * g5
    g0 *= border[0, 0]
    for p in range(many):
        u, s = space[SLIDE_RISE + p], space[SPIN_RISE + p]
        w_y = space[Y_WX + p] * g0 + space[Y_WY + p] * g1 + space[Y_WZ + p] * g2
        w_z = space[Z_WX + p] * g0 + space[Z_WY + p] * g1 + space[Z_WZ + p] * g2
        r_x = space[X_WX + p] * g3 + space[X_WY + p] * g4 + space[X_WZ + p] * g5
        r_y = space[Y_WX + p] * g3 + space[Y_WY + p] * g4 + space[Y_WZ + p] * g5
        r_z = space[Z_WX + p] * g3 + space[Z_WY + p] * g4 + space[Z_WZ + p] * g5
        space[SLIDE_RISE + p] = (
            space[OWN_UU + p] * u + space[OWN_US + p] * s
            - space[U_WY + p] * w_y - space[U_WZ + p] * w_z
            - space[U_RX + p] * r_x - space[U_RY + p] * r_y - space[U_RZ + p] * r_z
        )  # fmt: skip
        space[SPIN_RISE + p] = (
            space[OWN_US + p] * u + space[OWN_SS + p] * s
            - space[S_WY + p] * w_y - space[S_WZ + p] * w_z
            - space[S_RX + p] * r_x - space[S_RY + p] * r_y - space[S_RZ + p] * r_z
        )  # fmt: skip
    for i in range(half):
        place = np.uint64(2 * i)
        for row in range(2):
            j = i + row * half
            rate[d + j] = space[SLIDE_RISE + place]
            rate[d + n + j] = space[SPIN_RISE + place]
            place += np.uint64(1)
    rate[d + 2 * n], rate[d + 2 * n + 1], rate[d + 2 * n + 2] = g0, g1, g2
    rate[d + 2 * n + 3], rate[d + 2 * n + 4], rate[d + 2 * n + 5] = g3, g4, g5
