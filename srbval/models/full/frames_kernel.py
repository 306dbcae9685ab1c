"""Kernel: axes that follow each roller in the cage, motion of both races in these axes, number of points it may touch.

Races are modelled by points. A slot is a roller's place in the cage, in which the roller slides in and out. Slot axes:
x outwards along the slot, y along the race, z along the roller; see `srbval.models.full`.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from srbval.models.full import columns as col
from srbval.models.full.contact_kernel import LONGEST_ONSET_M
from srbval.models.full.second_cage_kernel import cage_of_row, cage_turns
from srbval.models.full.vectors_kernel import along_axes, cross, entries_from, plus, store_vector, times
from srbval.models.jit import inlined, kernel_part

SKIP_MARGIN_M = 2e-6  # a roller further than this (and the highest bump) from a race has no candidates
EMPTY_SLOT_M = -1.0  # depth in a slot without a roller
# Codes of columns that need one, two, three points, or may have a list of points of their own, see `candidate_code`.
NEEDS_ONE, NEEDS_TWO, NEEDS_THREE, OWN_POINTS = 1.0, 64.0, 4096.0, 1048576.0
FACING_RAD = 0.6  # half angle within which a roller may meet a race, up to a depth of a sixth of its radius
PROFILE_SLOPE = 0.1  # above the sine of half the tilt, by which the outer circles' normals lean


@kernel_part
def roller_in(slot: Any, rollers: Any) -> Any:
    """Convert a roller's number `slot`, with both rows alternating, to its number in the state: row 1, then row 2."""
    return slot // 2 + (slot % 2) * (rollers // 2)


class CageTilt(NamedTuple):
    """Cosine and sine of the cage's tilts about x and y, the first two of its gimbal angles."""

    cos_x: float
    sin_x: float
    cos_y: float
    sin_y: float


@inlined
def cage_tilt(angle_x, angle_y):
    """Compute the `CageTilt` of the gimbal angles about x and y [rad]."""
    return CageTilt(math.cos(angle_x), math.sin(angle_x), math.cos(angle_y), math.sin(angle_y))


@inlined
def cage_axes(tilt):
    """Compute the axes x, y, z of the tilted cage in world coordinates: tilted about x, then about the new y."""
    ca, sa, cb, sb = tilt
    return (cb, sa * sb, -ca * sb), (0.0, ca, sa), (sb, -sa * cb, ca * cb)


@inlined
def tilted_about_x(tilt, w_y, w_z):
    """Convert components y and z of a vector from world axes to axes tilted about x only; returns first z, then y."""
    return tilt.cos_x * w_z - tilt.sin_x * w_y, tilt.cos_x * w_y + tilt.sin_x * w_z


@kernel_part
def gimbal_rates(tilt, omega):
    """Compute the rates of the cage's gimbal angles [rad/s] from its angular velocity in world axes.

    With the gimbal angles a, b, c, the angular velocity in axes tilted about x is (a' + c' sin b, b', c' cos b).
    """
    w_z, rate_y = tilted_about_x(tilt, omega[1], omega[2])
    about = w_z / tilt.cos_y
    return omega[0] - about * tilt.sin_y, rate_y, about


@inlined
def slot_axes(axes, c, s, along, across):
    """Compute the axes x, y and z of a slot, the place of a roller in the cage, in world coordinates.

    `axes` of the cage, see `cage_axes`; `c`, `s`: cosine and sine of the slot's angle; `along` and `across`: components
    of the slot's direction, a unit vector, in the cage's plane and along the cage's axis.
    """
    x = plus(times(along, plus(times(c, axes[0]), s, axes[1])), across, axes[2])
    y = plus(times(-s, axes[0]), c, axes[1])
    return x, y, cross(x, y)


class SurfaceHeights(NamedTuple):
    """Heights of surface waves [m] at evenly spaced angles: `races`, [2 races, 2 rows, H], `rollers`, [rollers, K].

    H and K are numbers of angles, 0 if surfaces are smooth. Angles of a race begin at its x axis, angles of a roller at
    the point of its circumference that faces the outer race if the roller's rotation in the cage is zero.
    """

    races: Any
    rollers: Any


@kernel_part
def read_rollers(y, at, rollers, space):
    """Copy slide, its rate and spin of all rollers from state `y` to `space`; set row `DAMAGE` of `space` to zero."""
    for number in range(rollers):
        slot, j = np.uint64(number), roller_in(number, rollers)
        space[col.SLIDE + slot] = y[at.slide + j]
        space[col.SLIDE_RATE + slot] = y[at.slide_rate + j]
        space[col.SPIN + slot] = y[at.spin + j]
        space[col.DAMAGE + slot] = space[col.DAMAGE + col.INNER + slot] = 0.0


@kernel_part
def face_defects(defects, radius, rotation, space):
    """Sum the heights [m] of the rollers' `defects` that may meet a race now, for each roller and race.

    The sums are stored in the row `DAMAGE` of the workspace `space`. `radius` of the rollers [m].
    """
    half = rotation.shape[0] // 2
    for d in range(defects.shape[0]):
        roller = int(defects[d, col.DEFECT_ROLLER])
        slot = 2 * (roller % half) + roller // half
        for race in range(2):
            away = rotation[roller] + defects[d, col.DEFECT_ANGLE] + race * math.pi
            away -= 2.0 * math.pi * math.floor(away / (2.0 * math.pi) + 0.5)
            if abs(away) < FACING_RAD + 0.5 * defects[d, col.DEFECT_EXTENT] / radius:
                space[col.DAMAGE + np.uint64(race * col.RACE + slot)] += abs(defects[d, col.DEFECT_HEIGHT])


@kernel_part
def roller_frames(y, at, slots, tilt, shaft, shaft_angle, model):
    """Compute axes that follow each roller, the races' motion in them, and how many race points the roller may touch.

    `tilt`: `CageTilt`.
    """
    space = model.space
    turn = y[at.cage + 2]
    ring, ring_velocity = entries_from(y, at.ring), entries_from(y, at.ring_rate)
    omega = entries_from(y, at.cage_rate)
    turns, axes = cage_turns(y, at, model.second_cage), cage_axes(tilt)
    tilt_cosine, tilt_sine, centre_distance = model.tilt_cosine, model.tilt_sine, model.centre_distance
    outer_clearance = model.law.roller_radius - model.race_radius[0]
    inner_clearance = model.law.roller_radius - model.race_radius[1]
    arc_radial, arc_height = model.inner_centre_radial, model.inner_centre_axial
    outer, inner, height, patch = model.races.outer, model.races.inner, model.races.height, model.patch
    # a point acts on an approaching roller in half the time over which its contact is averaged
    lead_s = 0.5 * model.law.onset_s
    most_lead = 0.5 * LONGEST_ONSET_M if lead_s > 0.0 else 0.0
    # sense in which rollers move on each race
    outer_onwards, inner_onwards = 1.0 if omega[2] > 0.0 else -1.0, 1.0 if omega[2] > shaft else -1.0
    for p in range(slots):
        side = space[col.SIDE + p]
        own_cosine, own_sine, _ = cage_of_row(turns, side)
        c = own_cosine * space[col.SLOT_COSINE + p] - own_sine * space[col.SLOT_SINE + p]
        s = own_sine * space[col.SLOT_COSINE + p] + own_cosine * space[col.SLOT_SINE + p]
        slot = slot_axes(axes, c, s, tilt_cosine, side * tilt_sine)
        x, along, z = slot
        reach = centre_distance + space[col.SLIDE + p]
        slide_rate, roller_spin = space[col.SLIDE_RATE + p], space[col.SPIN + p]
        w_x, w_y, w_z = along_axes(omega, slot)
        angle = turn + space[col.SLOT_ANGLE + p]
        if side < 0.0:
            angle += turns.ahead
            w_x, w_z = w_x - turns.rate * tilt_sine, w_z + turns.rate * tilt_cosine
        store_vector(space, col.X_WX, p, x)
        store_vector(space, col.Y_WX, p, along)
        store_vector(space, col.Z_WX, p, z)
        store_vector(space, col.CAGE_X, p, (w_x, w_y, w_z))
        m_x, m_y, m_z = along_axes((c, s, 0.0), slot)
        store_vector(space, col.M_X, p, (m_x, m_y, m_z))
        store_vector(space, col.N_X, p, along_axes((-s, c, 0.0), slot))
        here = side != 0.0

        # outer race
        o_x, o_y, o_z = along_axes(ring, slot)
        v_x, v_y, v_z = along_axes(ring_velocity, slot)
        o_x -= reach
        store_vector(space, col.Z_X, p, (side * x[2], side * along[2], side * z[2]))
        store_vector(space, col.O_X, p, (o_x, o_y, o_z))
        store_vector(space, col.V_X, p, (v_x - slide_rate, v_y - reach * w_z, v_z + reach * w_y))
        store_vector(space, col.W_X, p, (-w_x, -w_y, -roller_spin))
        depth, lead = outer_clearance - o_x, -lead_s * (v_x - slide_rate)
        leaning = abs(side * along[2]) * height
        aside = abs(o_y) + leaning
        count_candidates(outer, outer_onwards, depth, o_z, lead, most_lead, aside, angle, here, patch, space, p)

        # inner race
        q = p + col.INNER
        offset = arc_radial * m_z + side * arc_height * z[2]
        store_vector(space, col.Z_X, q, (side * x[2], side * along[2], side * z[2]))
        store_vector(space, col.O_X, q, (-reach, 0.0, 0.0))
        passing = -slide_rate, reach * (shaft * z[2] - w_z), reach * (w_y - shaft * along[2])
        store_vector(space, col.V_X, q, passing)
        turning = shaft * x[2] - w_x, shaft * along[2] - w_y, shaft * z[2] - roller_spin
        store_vector(space, col.W_X, q, turning)
        depth = inner_clearance + arc_radial * m_x + side * arc_height * x[2] - reach
        lead = -lead_s * slide_rate
        angle -= shaft_angle
        count_candidates(inner, inner_onwards, depth, offset, lead, most_lead, leaning, angle, here, patch, space, q)


@inlined
def count_candidates(race, onwards, depth, offset, lead, most_lead, aside, angle, here, patch, space, column):
    """Store a roller's penetration into a race, its position along the race, and how many race points it may touch.

    A race is modelled by circles of numbered points. `race`: its `RaceSearch`; `onwards`: 1 if the roller moves towards
    higher numbers, otherwise -1; `depth`: penetration in the middle of the race's profile [m]; `offset`: distance along
    the roller from its middle to the centre of the profile arc [m]. The damper of a point pushes on an approaching
    roller before they touch, see `point_spring_and_damper`: from the gap `lead` [m] on at this roller's speed, from
    `most_lead` [m] on at any speed. `aside`: largest shift of the points along the race by displacement and tilt [m];
    `angle` from point 0 to the roller [rad]; `here`: False if `column` of the workspace has no roller; `patch`: see
    `Parameters`.
    """
    bound = depth + PROFILE_SLOPE * abs(offset) if here else EMPTY_SLOT_M
    position = angle * race.per_radian
    position -= race.points * math.floor(position * race.per_point)
    space[col.MIDDLE_DEPTH + column] = depth if here else EMPTY_SLOT_M
    space[col.DEPTH_BOUND + column], space[col.POSITION + column] = bound, position
    near = bound + SKIP_MARGIN_M + (lead if lead > 0.0 else 0.0)
    candidates = candidate_count(
        near * race.per_clearance,
        (near + most_lead) * race.per_clearance,
        aside * race.per_spacing,
        onwards * position,
        race.most,
        patch,
    )
    away = (position - race.own_middle) * race.per_point
    damaged = space[col.DAMAGE + column] > 0.0
    own = damaged or race.points * abs(away - math.floor(away + 0.5)) < race.own_half
    space[col.CANDIDATES + column] = candidates
    space[col.CANDIDATE_CODE + column] = OWN_POINTS if own else candidate_code(candidates)


@kernel_part
def candidate_count(depth, depth_ahead, aside, position, most, patch):
    """Compute how many points of each circle of a race may be in contact with a roller, at most `most`.

    Let c be the gap that is left at the next point of the circle when the roller just touches one point. `depth`: upper
    bound of the penetration, divided by c; `depth_ahead`: the same for points ahead of the roller, which push before
    they touch. In spacings of the points: `position` of the roller, which grows as it moves, and `aside`, the largest
    shift of the points along the race. `patch`: `Parameters.patch`, empty if races are modelled by points; if it is
    not, the result is 1 for contact, 0 for none.
    """
    one = 1.0 if depth > 0.0 else 0.0
    if patch is None:
        return one
    before = math.floor(position)
    past = position - before
    # the last point ahead and the first one behind, counted from the point before
    ahead = math.floor(past + aside + math.sqrt(depth_ahead if depth_ahead > 0.0 else 0.0))
    behind = math.floor(aside + math.sqrt(depth if depth > 0.0 else 0.0) - past)
    even = ahead if ahead > behind + 1.0 else behind + 1.0
    later = 1.0 if past >= 0.5 else 0.0
    odd = ahead - later if ahead - later > behind + later else behind + later
    count = 2.0 * even if even <= odd else 2.0 * odd + 1.0
    count = count if count < most else most
    count = count if depth_ahead > 0.0 and ahead + behind >= 0.0 else 0.0
    return one if patch.shape[1] > 0 else count


@kernel_part
def candidate_code(candidates):
    """Convert the number of points that a contact needs to a code.

    If the codes of several contacts are added, the digits of the sum, to the base 64, are the numbers of contacts that
    need at least 1, at least 2 and at least 3 points.
    """
    return (
        (NEEDS_ONE if candidates > 0.0 else 0.0)
        + (NEEDS_TWO if candidates > 1.0 else 0.0)
        + (NEEDS_THREE if candidates > 2.0 else 0.0)
    )


@kernel_part
def add_heights(surface, rotation, count, space):
    """Move each race towards each roller by the heights of the waves on both surfaces where they touch.

    `surface`: `SurfaceHeights`. The movement is along the line from the bearing's centre to the roller; its part along
    the contact's normal is up to 0.6 % smaller at its ends. A wave's slope does not tilt the normal, and the rate of
    its height does not act on the damper: at 3 kHz the force is 2 % too small for a damper's time constant of 10 us.
    """
    races, rollers = surface.races, surface.rollers
    if races.shape[2] == 0:
        return
    half = rotation.shape[0] // 2
    for roller in range(2 * half):
        row = roller // half
        slot = 2 * (roller - row * half) + row
        turned = rotation[roller] / (2.0 * math.pi)
        for race in range(2):
            j = np.uint64(race * col.RACE + slot)
            first, second, share = place_in_table(space[col.POSITION + j] / count, races.shape[2])
            height = (1.0 - share) * races[race, row, first] + share * races[race, row, second]
            # the outer race is met in front of the slot, the inner one behind
            first, second, share = place_in_table(0.5 * race - turned, rollers.shape[1])
            height += (1.0 - share) * rollers[roller, first] + share * rollers[roller, second]
            space[col.O_X + j] += height if race == 1 else -height
            space[col.MIDDLE_DEPTH + j] += height
            space[col.DEPTH_BOUND + j] += height
            candidates = 1.0 if space[col.DEPTH_BOUND + j] > -SKIP_MARGIN_M else 0.0
            space[col.CANDIDATES + j] = candidates
            if space[col.CANDIDATE_CODE + j] < OWN_POINTS:
                space[col.CANDIDATE_CODE + j] = candidate_code(candidates)


@kernel_part
def place_in_table(turns, size):
    """Find the entries before and after an angle [turns] in a table of `size` entries, and the weight of the second."""
    place = (turns - math.floor(turns)) * size
    first = int(place)
    first = first if 0 <= first < size else 0  # also for a state that is no longer finite
    return first, first + 1 if first + 1 < size else 0, place - first
