"""Kernel: contact forces and torques of a race's points on barrel rollers.

Everything is in the rollers' slot frames: x along the slot (outwards), y along the race, z along the roller's axis,
origin at the roller's centre. See `columns` for the layout.
"""

from __future__ import annotations

import math

import numpy as np

from srbval.models.full.columns import (
    A_X,
    A_Y,
    A_Z,
    B_X,
    B_Y,
    B_Z,
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
    DAMPED,
    F_X,
    F_Y,
    F_Z,
    O_X,
    O_Y,
    O_Z,
    RUBBED,
    STORED,
    T_X,
    T_Y,
    T_Z,
    V_X,
    V_Y,
    V_Z,
    W_X,
    W_Y,
    W_Z,
    Z_X,
    Z_Y,
    Z_Z,
)  # fmt: skip
from srbval.models.full.contact_law import ContactLaw
from srbval.models.jit import kernel

# A patch in three parts of equal load: mean of its (x / half length)^2 weighed with the load, and half the range of it.
MEAN_A, MEAN_B, MEAN_C = 0.016800224798641905, 0.12751682743387346, 0.45568294776748464
HALF_A, HALF_B, HALF_C = 0.025554662033143466, 0.09046373216412812, 0.38398160580272844


@kernel
def part_friction(law, q_x, q_y, q_z, e_x, e_y, e_z, reach, pivot, mean, half, normal):
    """Friction of a part of a patch over its mean slip.

    Its slip is q + e `mean`, plus and minus e `half` (`reach`: square of e), and besides, across it, what pivoting
    about the normal makes of it, to either side alike: `pivot` is the square of that at the patch's edge. The mean of
    eq. (19) over such slips: its critical velocity becomes their range, and what static friction has over dynamic
    counts for the share of the range where it acts.
    """
    s_x, s_y, s_z = q_x + e_x * mean, q_y + e_y * mean, q_z + e_z * mean
    across = pivot * mean
    square = s_x * s_x + s_y * s_y + s_z * s_z + across
    slip = math.sqrt(square) + 1e-300
    own, range_ = law.critical_velocity * law.critical_velocity, reach * half * half
    critical = math.sqrt((own if own > range_ else range_) + across)
    dynamic = law.dynamic_friction
    static = dynamic + (law.static_friction - dynamic) * law.critical_velocity / critical
    mu = static - 2.0 * (static - dynamic) / critical * (slip - critical)
    mu = mu if mu > dynamic else dynamic
    mu = mu / slip
    most = static / critical
    mu = mu if mu < most else most
    return mu * normal


# Over a longer way a point's speed is not constant: with 5e-6, 1e-5 and 2e-5 m the rollers carry 2, 3 and 11 % too much
# at 3000 rpm; the noise floor at 710 rpm is 9.6e-4, 8.0e-4 and 5.7e-4 (2.5 s, interference, outer-race defect).
LONGEST_ONSET_M = 1e-5


@kernel
def contact_columns(law, points, race, window, first, last, columns, start, stop, damping, patch):
    """Add the forces of candidates ``points[race, window, :, first:last]`` to the columns from `start` to `stop`.

    For each candidate: penetration of the barrel in closed form, normal force by eq. (18), never pulling, friction by
    eq. (19). The columns are the inner loop, so that eight are worked on at once. Unless `damping` is None, also adds
    up what the forces grow with the velocities, see `damping_kernel`. With a `patch`, see `srbval.models.line`, a
    candidate stands for a whole circle's contact.

    A point comes into contact with C_c times its speed, some 600 N at once: a step that finds it a little earlier or
    later makes noise of first order. Unless `damping` is None, spring and damper of a point that approaches are
    averaged over ``law.onset_s`` about the moment, but `LONGEST_ONSET_M` at most, at constant speed, in place of the
    smoothing, whose width it crosses in nanoseconds. A point that retreats lets go where the damper's pull equals the
    spring's push: nothing jumps there.
    """
    profile_radius = law.profile_radius
    inner_radius = profile_radius - law.roller_radius
    stiffness, viscosity, sharpness = law.stiffness, law.damping, 1.0 / law.smoothing
    onset, smoothing = law.onset_s, law.smoothing
    static_friction, dynamic_friction = law.static_friction, law.dynamic_friction
    critical_velocity = law.critical_velocity
    slope = static_friction / critical_velocity
    fall = (static_friction - dynamic_friction) / (0.5 * critical_velocity)
    begin, end = np.uint64(start), np.uint64(stop)
    for i in range(first, last):
        along, across = points[race, window, 0, i], points[race, window, 1, i]
        axial, share = points[race, window, 2, i], points[race, window, 3, i]
        for j in range(begin, end):
            p_x = columns[O_X + j] + along * columns[A_X + j] + across * columns[B_X + j] + axial * columns[Z_X + j]
            p_y = columns[O_Y + j] + along * columns[A_Y + j] + across * columns[B_Y + j] + axial * columns[Z_Y + j]
            p_z = columns[O_Z + j] + along * columns[A_Z + j] + across * columns[B_Z + j] + axial * columns[Z_Z + j]
            # closed-form distance to the barrel: a circle of profile_radius swept about the roller's axis
            rho = math.sqrt(p_x * p_x + p_y * p_y)
            s = rho + inner_radius
            distance = math.sqrt(s * s + p_z * p_z)
            depth = profile_radius - distance
            inverse = 1.0 / (distance * rho)
            n_x = s * inverse * p_x
            n_y = s * inverse * p_y
            n_z = rho * inverse * p_z
            # velocity of the ring's point relative to the roller's material
            w_x, w_y, w_z = columns[W_X + j], columns[W_Y + j], columns[W_Z + j]
            u_x = columns[V_X + j] + w_y * p_z - w_z * p_y
            u_y = columns[V_Y + j] + w_z * p_x - w_x * p_z
            u_z = columns[V_Z + j] + w_x * p_y - w_y * p_x
            u_n = u_x * n_x + u_y * n_y + u_z * n_z
            # normal force, eq. (18), with depth rate -u_n
            if patch is None:
                if damping is not None:
                    travel = -onset * u_n if u_n < 0.0 else 0.0
                    travel = travel if travel < LONGEST_ONSET_M else LONGEST_ONSET_M
                    lead = depth + 0.5 * travel
                    x = lead / (travel + smoothing)
                    x = x if x > 0.0 else 0.0
                    x = x if x < 1.0 else 1.0
                    smooth = share * x
                    spring = smooth * stiffness * (lead - 0.5 * x * travel)
                else:
                    x = depth * sharpness
                    x = x if x > 0.0 else 0.0
                    x = x if x < 1.0 else 1.0
                    smooth = share * x * x * (3.0 - 2.0 * x)
                    spring = smooth * stiffness * depth
                viscous = smooth * viscosity
                twice_stored = spring * depth
            else:
                deep = depth if depth > 0.0 else 0.0
                root = math.sqrt(deep)
                spring = patch[race, i, 0] * deep * root
                viscous = patch[race, i, 1] * root
                twice_stored = 0.8 * spring * deep
            normal = spring - viscous * u_n
            normal = normal if normal > 0.0 else 0.0
            # friction, eq. (19): coefficient over slip speed, never above its slope at rest
            q_x = u_x - u_n * n_x
            q_y = u_y - u_n * n_y
            q_z = u_z - u_n * n_z
            if patch is None:
                square = q_x * q_x + q_y * q_y + q_z * q_z
                slip = math.sqrt(square) + 1e-300
                mu = static_friction - fall * (slip - critical_velocity)
                mu = mu if mu > dynamic_friction else dynamic_friction
                mu = mu / slip
                mu = mu if mu < slope else slope
                drag = mu * normal
                g_x = drag * q_x
                g_y = drag * q_y
                g_z = drag * q_z
                rubbed = drag * square
            else:
                spread = patch[race, i, 2] * deep
                e_x = spread * (w_y * n_z - w_z * n_y)
                e_y = spread * (w_z * n_x - w_x * n_z)
                e_z = spread * (w_x * n_y - w_y * n_x)
                reach = e_x * e_x + e_y * e_y + e_z * e_z
                pivot = w_x * n_x + w_y * n_y + w_z * n_z
                pivot *= pivot * patch[race, i, 3] * deep
                third = normal * (1.0 / 3.0)
                drag_a = part_friction(law, q_x, q_y, q_z, e_x, e_y, e_z, reach, pivot, MEAN_A, HALF_A, third)
                drag_b = part_friction(law, q_x, q_y, q_z, e_x, e_y, e_z, reach, pivot, MEAN_B, HALF_B, third)
                drag_c = part_friction(law, q_x, q_y, q_z, e_x, e_y, e_z, reach, pivot, MEAN_C, HALF_C, third)
                drag = drag_a + drag_b + drag_c
                mean = drag_a * MEAN_A + drag_b * MEAN_B + drag_c * MEAN_C
                g_x, g_y, g_z = mean * e_x + drag * q_x, mean * e_y + drag * q_y, mean * e_z + drag * q_z
                rubbed = g_x * q_x + g_y * q_y + g_z * q_z
            g_x -= normal * n_x
            g_y -= normal * n_y
            g_z -= normal * n_z
            columns[F_X + j] += g_x
            columns[F_Y + j] += g_y
            columns[F_Z + j] += g_z
            columns[T_X + j] += p_y * g_z - p_z * g_y
            columns[T_Y + j] += p_z * g_x - p_x * g_z
            columns[T_Z + j] += p_x * g_y - p_y * g_x
            columns[RUBBED + j] += rubbed
            columns[DAMPED + j] += (spring - normal) * u_n
            columns[STORED + j] += twice_stored
            if damping is not None:
                # a force grows by drag across the normal and by the damping along it; arms about y and z
                viscous = viscous if normal > 0.0 else 0.0
                along_normal = viscous - drag
                arm = n_x * p_z - n_z * p_x
                l_x, l_y, l_z = along_normal * n_x, along_normal * n_y, along_normal * n_z
                columns[D_XX + j] += drag + l_x * n_x
                columns[D_XY + j] += l_x * n_y
                columns[D_XZ + j] += l_x * n_z
                columns[D_YY + j] += drag + l_y * n_y
                columns[D_YZ + j] += l_y * n_z
                columns[D_ZZ + j] += drag + l_z * n_z
                columns[D_XP + j] += drag * p_z + l_x * arm
                columns[D_YP + j] += l_y * arm
                columns[D_ZP + j] += l_z * arm - drag * p_x
                columns[D_PP + j] += drag * (p_z * p_z + p_x * p_x) + along_normal * arm * arm
                columns[D_XS + j] -= drag * p_y
                columns[D_YS + j] += drag * p_x
                columns[D_PS + j] -= drag * p_y * p_z
                columns[D_SS + j] += drag * (p_x * p_x + p_y * p_y)


@kernel
def elastic(law, damping):
    """The same law without friction, and with another `damping`."""
    return ContactLaw(
        law.profile_radius,
        law.roller_radius,
        law.stiffness,
        damping,
        law.smoothing,
        0.0,
        0.0,
        law.critical_velocity,
        law.onset_s,
    )
