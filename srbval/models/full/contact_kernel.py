"""Kernel: contact force and torque of one raceway's points on one barrel roller.

Everything is in the roller's slot frame: x along the slot (outwards), y along the race, z along the roller's
axis, origin at the roller's centre. Floats and arrays only; see `contact.py` for the documented physics.
"""

from __future__ import annotations

import math

from srbval.models.full.contact_law import ContactLaw
from srbval.models.jit import kernel


@kernel
def race_on_roller(
    # model
    law, points, race, window, first, last,
    # state: meridian frame of the nearest point in slot axes (a: radial, b: along the race, z: shaft), ring
    # centre, relative velocity (ring less roller) at the roller's centre, relative angular velocity
    a_x, a_y, a_z, b_x, b_y, b_z, z_x, z_y, z_z, o_x, o_y, o_z, v_x, v_y, v_z, w_x, w_y, w_z,
):  # fmt: skip
    """Force and torque about the roller's centre, power lost to friction and to damping, elastic energy.

    ``points[race, window, :, first:last]`` holds the candidates, see `point_cloud.Windows`.
    """
    profile_radius = law.profile_radius
    inner_radius = profile_radius - law.roller_radius
    stiffness, damping, sharpness = law.stiffness, law.damping, 1.0 / law.smoothing
    static_friction, dynamic_friction, critical_velocity = (
        law.static_friction,
        law.dynamic_friction,
        law.critical_velocity,
    )
    slope = static_friction / critical_velocity
    fall = (static_friction - dynamic_friction) / (0.5 * critical_velocity)
    f_x = f_y = f_z = t_x = t_y = t_z = 0.0
    rubbed = damped = stored = 0.0
    for i in range(first, last):
        along = points[race, window, 0, i]
        across = points[race, window, 1, i]
        axial = points[race, window, 2, i]
        p_x = o_x + along * a_x + across * b_x + axial * z_x
        p_y = o_y + along * a_y + across * b_y + axial * z_y
        p_z = o_z + along * a_z + across * b_z + axial * z_z
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
        u_x = v_x + w_y * p_z - w_z * p_y
        u_y = v_y + w_z * p_x - w_x * p_z
        u_z = v_z + w_x * p_y - w_y * p_x
        u_n = u_x * n_x + u_y * n_y + u_z * n_z
        # normal force, eq. (18), with depth rate -u_n
        x = depth * sharpness
        x = x if x > 0.0 else 0.0
        x = x if x < 1.0 else 1.0
        smooth = points[race, window, 3, i] * x * x * (3.0 - 2.0 * x)
        spring = smooth * stiffness * depth
        normal = spring - smooth * damping * u_n
        normal = normal if normal > 0.0 else 0.0
        # friction, eq. (19): coefficient over slip speed, never above its slope at rest
        q_x = u_x - u_n * n_x
        q_y = u_y - u_n * n_y
        q_z = u_z - u_n * n_z
        square = q_x * q_x + q_y * q_y + q_z * q_z
        slip = math.sqrt(square) + 1e-300
        mu = static_friction - fall * (slip - critical_velocity)
        mu = mu if mu > dynamic_friction else dynamic_friction
        mu = mu / slip
        mu = mu if mu < slope else slope
        drag = mu * normal
        g_x = drag * q_x - normal * n_x
        g_y = drag * q_y - normal * n_y
        g_z = drag * q_z - normal * n_z
        f_x += g_x
        f_y += g_y
        f_z += g_z
        t_x += p_y * g_z - p_z * g_y
        t_y += p_z * g_x - p_x * g_z
        t_z += p_x * g_y - p_y * g_x
        rubbed += drag * square
        damped += (spring - normal) * u_n
        stored += spring * depth
    return f_x, f_y, f_z, t_x, t_y, t_z, rubbed, damped, 0.5 * stored


@kernel
def without_friction(law):
    """The same law with normal forces only."""
    return ContactLaw(
        law.profile_radius,
        law.roller_radius,
        law.stiffness,
        law.damping,
        law.smoothing,
        0.0,
        0.0,
        law.critical_velocity,
    )


@kernel
def damaged_roller_points(
    roller_radius, circle_half_gap, defects, roller, turned, points, race, window, lanes,
    a_x, a_y, a_z, b_x, b_y, b_z, z_x, z_y, z_z, o_x, o_y, o_z,
):  # fmt: skip
    """Fill the last, spare window of a race with a window's candidates as a damaged roller meets them.

    A height h of the roller's surface is met as if the race's point stood h higher, along its own normal. `defects`,
    shape [D, 6]: see `Parameters.roller_defects`; `turned` is the roller's angle about its axis relative to its slot;
    the rest is the meridian frame as in `race_on_roller`.
    """
    spare = points.shape[1] - 1
    for i in range(lanes):
        along, across, axial = points[race, window, 0, i], points[race, window, 1, i], points[race, window, 2, i]
        x = o_x + along * a_x + across * b_x + axial * z_x
        y = o_y + along * a_y + across * b_y + axial * z_y
        z = o_z + along * a_z + across * b_z + axial * z_z
        lift = 0.0
        for d in range(defects.shape[0]):
            if defects[d, 0] != roller or abs(z - defects[d, 2]) > circle_half_gap:
                continue
            away = math.atan2(y, x) - turned - defects[d, 1]
            away -= 2.0 * math.pi * math.floor(away / (2.0 * math.pi) + 0.5)
            away *= roller_radius / defects[d, 4]
            if abs(away) <= 0.5:
                cosine = 0.5 + 0.5 * math.cos(2.0 * math.pi * away)
                lift += defects[d, 3] * (cosine if defects[d, 5] > 0.0 else 1.0)
        points[race, spare, 0, i] = along + lift * points[race, window, 4, i]
        points[race, spare, 1, i] = across + lift * points[race, window, 5, i]
        points[race, spare, 2, i] = axial + lift * points[race, window, 6, i]
        points[race, spare, 3, i] = points[race, window, 3, i]
