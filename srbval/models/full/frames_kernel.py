"""Kernel: every roller's slot axes, and how both races stand and move against it.

The slot axes of a roller: x along the slot, outwards, y along the race, z along the roller; see `srbval.models.full`.
"""

from __future__ import annotations

import math

import numpy as np

from srbval.models.full.columns import (
    BOUND,
    CAGE_X,
    CAGE_Y,
    CAGE_Z,
    DAMAGE,
    DEPTH,
    M_X,
    M_Y,
    M_Z,
    N_X,
    N_Y,
    N_Z,
    NEED,
    O_X,
    O_Y,
    O_Z,
    PLACE,
    RACE,
    SIDE,
    SLIDE,
    SLIDE_RATE,
    SLOT_ANGLE,
    SLOT_COSINE,
    SLOT_SINE,
    SPIN,
    TOUCHED,
    V_X,
    V_Y,
    V_Z,
    W_X,
    W_Y,
    W_Z,
    X_WX,
    X_WY,
    X_WZ,
    Y_WX,
    Y_WY,
    Y_WZ,
    Z_WX,
    Z_WY,
    Z_WZ,
    Z_X,
    Z_Y,
    Z_Z,
)  # fmt: skip
from srbval.models.full.contact_kernel import LONGEST_ONSET_M
from srbval.models.jit import kernel

INNER = np.uint64(RACE)
SKIP_MARGIN_M = 2e-6  # a roller further than this (and the highest bump) from a race is not looked at
NOBODY_M = -1.0  # depth where no roller is
# codes to be added up: how many of eight columns touch a point, a second one, a third one; may have points of their own
TOUCHES, TWO, THREE, OWN = 1.0, 64.0, 4096.0, 1048576.0
PROFILE_SLOPE = 0.1  # above the sine of half the tilt: where the outer circles' normals lean


@kernel
def read_rollers(y, n, space):
    """Bring slides, their rates and the spins from state `y` of `n` rollers to their places: both rows in turn."""
    half = n // 2
    d = 2 * n + 6
    for i in range(half):
        place = np.uint64(2 * i)
        for row in range(2):
            j = i + row * half
            space[SLIDE + place] = y[j]
            space[SLIDE_RATE + place] = y[d + j]
            space[SPIN + place] = y[d + n + j]
            place += np.uint64(1)


@kernel
def roller_frames(y, n, many, tilt, shaft, shaft_angle, count, model, space):
    """Fill the frames of `many` places and of their columns for state `y`.

    `tilt`: cosine and sine of the cage's two tilts; `count` points make a circle.
    """
    d = 2 * n + 6
    turn = y[2 * n + 2]
    ring_x, ring_y, ring_z = y[2 * n + 3], y[2 * n + 4], y[2 * n + 5]
    omega_x, omega_y, omega_z = y[d + 2 * n], y[d + 2 * n + 1], y[d + 2 * n + 2]
    ring_vx, ring_vy, ring_vz = y[d + 2 * n + 3], y[d + 2 * n + 4], y[d + 2 * n + 5]
    ca, sa, cb, sb = tilt
    ct, st = math.cos(turn), math.sin(turn)
    # cage tilt Rx(a) Ry(b), by columns
    t00, t10, t20 = cb, sa * sb, -ca * sb
    t01, t11, t21 = 0.0, ca, sa
    t02, t12, t22 = sb, -sa * cb, ca * cb
    tilt_cosine, tilt_sine, centre_distance = model.tilt_cosine, model.tilt_sine, model.centre_distance
    clearance = model.law.roller_radius - model.law.profile_radius
    arc_radial, arc_height = model.inner_centre_radial, model.inner_centre_axial
    per_radian, per_count, points = count / (2.0 * math.pi), 1.0 / count, float(count)
    races, patch = model.races, model.patch
    height = races.height
    soon = 0.5 * model.law.onset_s
    most_soon = 0.5 * LONGEST_ONSET_M if soon > 0.0 else 0.0
    per_spacing, per_spacing_inner = 1.0 / races.outer_spacing, 1.0 / races.inner_spacing
    per_aside, per_aside_inner = 1.0 / races.outer_aside, 1.0 / races.inner_aside
    own_middle, own_middle_inner = races.outer_own_middle, races.inner_own_middle
    own_half, own_half_inner = races.outer_own_half, races.inner_own_half
    plain = float(races.plain)
    onwards = 1.0 if omega_z > 0.0 else -1.0
    onwards_inner = 1.0 if omega_z > shaft else -1.0
    for p in range(many):
        side = space[SIDE + p]
        c = ct * space[SLOT_COSINE + p] - st * space[SLOT_SINE + p]
        s = st * space[SLOT_COSINE + p] + ct * space[SLOT_SINE + p]
        # slot axes in world coordinates: x along the slot, y along the race, z along the roller
        ex = tilt_cosine * c
        ey = tilt_cosine * s
        ez = side * tilt_sine
        x_x = t00 * ex + t01 * ey + t02 * ez
        x_y = t10 * ex + t11 * ey + t12 * ez
        x_z = t20 * ex + t21 * ey + t22 * ez
        y_x = -t00 * s + t01 * c
        y_y = -t10 * s + t11 * c
        y_z = -t20 * s + t21 * c
        z_x = x_y * y_z - x_z * y_y
        z_y = x_z * y_x - x_x * y_z
        z_z = x_x * y_y - x_y * y_x
        reach = centre_distance + space[SLIDE + p]
        slide_rate, roller_spin = space[SLIDE_RATE + p], space[SPIN + p]
        w_x = omega_x * x_x + omega_y * x_y + omega_z * x_z
        w_y = omega_x * y_x + omega_y * y_y + omega_z * y_z
        w_z = omega_x * z_x + omega_y * z_y + omega_z * z_z
        space[X_WX + p], space[X_WY + p], space[X_WZ + p] = x_x, x_y, x_z
        space[Y_WX + p], space[Y_WY + p], space[Y_WZ + p] = y_x, y_y, y_z
        space[Z_WX + p], space[Z_WY + p], space[Z_WZ + p] = z_x, z_y, z_z
        space[CAGE_X + p], space[CAGE_Y + p], space[CAGE_Z + p] = w_x, w_y, w_z
        m_x = c * x_x + s * x_y
        m_z = c * z_x + s * z_y
        space[M_X + p], space[M_Y + p], space[M_Z + p] = m_x, c * y_x + s * y_y, m_z
        space[N_X + p], space[N_Y + p], space[N_Z + p] = c * x_y - s * x_x, c * y_y - s * y_x, c * z_y - s * z_x
        angle = turn + space[SLOT_ANGLE + p]

        o_x = ring_x * x_x + ring_y * x_y + ring_z * x_z - reach
        o_y = ring_x * y_x + ring_y * y_y + ring_z * y_z
        o_z = ring_x * z_x + ring_y * z_y + ring_z * z_z
        space[Z_X + p], space[Z_Y + p], space[Z_Z + p] = side * x_z, side * y_z, side * z_z
        space[O_X + p], space[O_Y + p], space[O_Z + p] = o_x, o_y, o_z
        space[V_X + p] = ring_vx * x_x + ring_vy * x_y + ring_vz * x_z - slide_rate
        space[V_Y + p] = ring_vx * y_x + ring_vy * y_y + ring_vz * y_z - reach * w_z
        space[V_Z + p] = ring_vx * z_x + ring_vy * z_y + ring_vz * z_z + reach * w_y
        space[W_X + p], space[W_Y + p], space[W_Z + p] = -w_x, -w_y, -roller_spin
        leaning = abs(space[Z_Y + p]) * height
        depth, here, damaged = clearance - o_x, side != 0.0, space[DAMAGE + p] > 0.0
        place = angle * per_radian
        place -= points * math.floor(place * per_count)
        bound = depth + PROFILE_SLOPE * abs(o_z) if here else NOBODY_M
        space[DEPTH + p], space[BOUND + p], space[PLACE + p] = depth if here else NOBODY_M, bound, place
        nearing = -soon * space[V_X + p]
        nearing = bound + SKIP_MARGIN_M + (nearing if nearing > 0.0 else 0.0)
        touched = touched_points(
            nearing * per_aside, (nearing + most_soon) * per_aside, (abs(o_y) + leaning) * per_spacing,
            onwards * place, plain, patch,
        )  # fmt: skip
        away = (place - own_middle) * per_count
        own = damaged or points * abs(away - math.floor(away + 0.5)) < own_half
        space[TOUCHED + p], space[NEED + p] = touched, OWN if own else need_of(touched)

        q = p + INNER
        offset = arc_radial * m_z + side * arc_height * z_z
        space[Z_X + q], space[Z_Y + q], space[Z_Z + q] = side * x_z, side * y_z, side * z_z
        space[O_X + q], space[O_Y + q], space[O_Z + q] = -reach, 0.0, 0.0
        space[V_X + q], space[V_Y + q] = -slide_rate, reach * (shaft * z_z - w_z)
        space[V_Z + q] = reach * (w_y - shaft * y_z)
        space[W_X + q], space[W_Y + q] = shaft * x_z - w_x, shaft * y_z - w_y
        space[W_Z + q] = shaft * z_z - roller_spin
        depth = clearance + arc_radial * m_x + side * arc_height * x_z - reach
        bound = depth + PROFILE_SLOPE * abs(offset) if here else NOBODY_M
        place = (angle - shaft_angle) * per_radian
        place -= points * math.floor(place * per_count)
        space[DEPTH + q], space[BOUND + q], space[PLACE + q] = depth if here else NOBODY_M, bound, place
        nearing = -soon * slide_rate
        nearing = bound + SKIP_MARGIN_M + (nearing if nearing > 0.0 else 0.0)
        touched = touched_points(
            nearing * per_aside_inner, (nearing + most_soon) * per_aside_inner, leaning * per_spacing_inner,
            onwards_inner * place, plain, patch,
        )  # fmt: skip
        away = (place - own_middle_inner) * per_count
        own = damaged or points * abs(away - math.floor(away + 0.5)) < own_half_inner
        space[TOUCHED + q], space[NEED + q] = touched, OWN if own else need_of(touched)


@kernel
def touched_points(depth, depth_ahead, aside, place, most, patch):
    """How many points of each circle a roller's window must hold, no less than it may touch and `most` at most.

    `depth`: in units of what a point one spacing aside stands clear, with all margins; `depth_ahead`: the same for
    points that the roller moves on to, which begin to act before they touch; `aside`: how far the roller may stand from
    its meridian, and `place` where it stands, growing as it moves on, both in spacings. A `patch` counts as one.
    """
    if patch is not None:
        return 1.0 if depth > 0.0 else 0.0
    before = math.floor(place)
    past = place - before
    # the last point ahead and the first one behind, counted from the point before
    ahead = math.floor(past + aside + math.sqrt(depth_ahead if depth_ahead > 0.0 else 0.0))
    behind = math.floor(aside + math.sqrt(depth if depth > 0.0 else 0.0) - past)
    even = ahead if ahead > behind + 1.0 else behind + 1.0
    later = 1.0 if past >= 0.5 else 0.0
    odd = ahead - later if ahead - later > behind + later else behind + later
    count = 2.0 * even if even <= odd else 2.0 * odd + 1.0
    count = count if count < most else most
    return count if depth_ahead > 0.0 and ahead + behind >= 0.0 else 0.0


@kernel
def need_of(touched):
    """Code of how many points a column may touch: a sum over eight tells how many columns touch one, two, three."""
    return (TOUCHES if touched > 0.0 else 0.0) + (TWO if touched > 1.0 else 0.0) + (THREE if touched > 2.0 else 0.0)
