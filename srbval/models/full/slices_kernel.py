"""Kernels: contacts cut into slices along the roller, as in ISO/TS 16281 (2008).

A slice of a race meets the roller in the roller's meridian or, at a defect, on the defect's edge, see `foot_of_slice`.
Its gap to the barrel has the closed form of `contact_kernel.penetration`. Across the slice's width the penetration is
linear; force, its slope and energy are on the page "Contact" of the theory. A negative penetration at an end counts as
zero: the force is smooth while a slice comes into contact. The damper's coefficient is the slope times a time constant
(2.5e-6 to 25e-6 s after E. Krämer; quoted from memory, not checked).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from srbval.models.full import columns as col
from srbval.models.full.contact_kernel import (
    add_contact,
    add_damping,
    approach_and_slip,
    normal_force,
    penetration,
    place_of_point,
    with_friction,
)
from srbval.models.full.frames_kernel import roller_in
from srbval.models.full.oil_kernel import film_drag, film_on_race, law_in_film, rolling_speed
from srbval.models.full.vectors_kernel import axes_at, dot, plus, store_vector, times, to_world, vector_at
from srbval.models.jit import inlined, kernel_part

# x^(1/9) over x^(1/8), for the first guess of one Newton step; error after it 1.6e-6 from 1e-11 m to 1 mm.
ROOT_0, ROOT_1, ROOT_2, ROOT_3, ROOT_4 = (
    0.005134520247930662, 1.3552062471394482, -1.4104892213712499, 2.9277482460540822, -2.576623832987226,
)  # fmt: skip
# Polynomials on [0, 1], see `slice_spring`: (9/19) (1 - (1 - r)^(19/9)) / r to 8e-5, (1 - (1 - r)^(10/9)) / r to 2e-3,
# (81/266) (1 - (1 - r)^(28/9)) / r to 2e-5; the middle of the load from the deeper end, in touched lengths, to 2e-4.
FORCE_0, FORCE_1, FORCE_2, FORCE_3, FORCE_4 = (
    1.0000778650318949, -0.5582497123587, 0.03591365541497632, -0.024671343307856954, 0.020576861857523096,
)  # fmt: skip
SLOPE_0, SLOPE_1, SLOPE_2, SLOPE_3 = 1.1129655578303614, -0.1022596759372016, 0.11516154524610224, -0.12419824532765562
ENERGY_0, ENERGY_1, ENERGY_2, ENERGY_3, ENERGY_4 = (
    0.9473474491609976, -0.9992911216779274, 0.36625439412153266, -0.002021169818851181, -0.007771532554399984,
)  # fmt: skip
MIDDLE_0, MIDDLE_1, MIDDLE_2, MIDDLE_3 = (
    0.5001995811484456, -0.0987286774058343, -0.01738024202711869, -0.06246256968352471,
)  # fmt: skip
ON_ROLLER = 1  # in the plan: the defect is on the roller
LEAST_SLIP = 1e-9  # added to slips [m/s], which are divided by; a millionth of the least critical velocity in use


class SliceTable(NamedTuple):
    """Slices into which the contacts of rollers with both races are cut, and constants of their forces.

    `rows`, shape [2 races, W, col.SLICE_ROWS, slices]: W tables with the geometry and stiffness of each slice, table 0
    for a sound race, one more for each defect; `starts`, [2, W, 4]: number of the first slice in each third of the
    contact's length, and the number of slices; `middle`, [2, W]: angle of the defect on the race [rad]; `reach`, [2,
    W]: distance from a defect's middle within which a roller meets it [m]; `damping_s`: time constant of the damper
    [s]; `critical_ratio`: slide-to-roll ratio at which friction reaches its limit, 0 if friction depends on the slip
    alone; `outer_radius`, `inner_radius`: distance of the middle of the contacts from the shaft's axis [m]; `film`:
    `FilmLaw` if friction is the shear of an oil film, or None.
    """

    rows: Any
    starts: Any
    middle: Any
    reach: Any
    damping_s: float
    critical_ratio: float
    outer_radius: float
    inner_radius: float
    film: Any = None


@inlined
def ninth_root(x, inverse):
    """Compute x^(1/9) for x above 1e-37; `inverse` is 1 / x.

    A first guess in single precision is refined by two terms of the series of (y^9 / x)^(-1/9) about 1, to be fast.
    """
    u = np.float64(math.sqrt(math.sqrt(math.sqrt(np.float32(x)))))
    y = ROOT_0 + u * (ROOT_1 + u * (ROOT_2 + u * (ROOT_3 + u * ROOT_4)))
    y2 = y * y
    y4 = y2 * y2
    off = y4 * y4 * y * inverse - 1.0
    return y * (1.0 - off * (1.0 / 9.0 - off * (5.0 / 81.0)))


@inlined
def slice_spring(stiffness, depth, spread, bend, least):
    """Compute a slice's force [N], stiffness [N/m], energy times two [J], touching fraction of the width, load offset.

    `stiffness`: force over penetration^(10/9); `depth`: mean penetration; `spread`: difference of the penetration
    between the slice's ends; `bend`: curvature of the gap along the roller times the width squared; `least`: smallest
    spread, above 0; in N, m. The load offset is the distance from the slice's middle to the middle of the load, towards
    the deeper end, divided by the width.

    If only the part t of the width touches, the curved course of the penetration over this part is replaced by a
    straight line: the penetration e at the deeper end is reduced by bend (1 - t^2) / 12, the spread by bend (1 - t) /
    2. With r = spread / e, at most 1, all results are powers of e times polynomials in r, so that one ninth root is
    enough.
    """
    e = depth + 0.5 * spread
    t = e / spread
    t = t if t > 0.0 else 0.0
    t = t if t < 1.0 else 1.0
    e -= bend * (1.0 - t * t) * (1.0 / 12.0)
    e = e if e > 1e-30 else 1e-30
    spread -= 0.5 * bend * (1.0 - t)
    spread = spread if spread > least else least
    inverse = 1.0 / (e * spread)
    per_spread, per_e = inverse * e, inverse * spread
    touched = spread if spread < e else e
    r, part = touched * per_e, touched * per_spread
    per = stiffness * part * e * ninth_root(e, per_e)
    force = FORCE_0 + r * (FORCE_1 + r * (FORCE_2 + r * (FORCE_3 + r * FORCE_4)))
    slope = SLOPE_0 + r * (SLOPE_1 + r * (SLOPE_2 + r * SLOPE_3))
    energy = ENERGY_0 + r * (ENERGY_1 + r * (ENERGY_2 + r * (ENERGY_3 + r * ENERGY_4)))
    off = 0.5 - part * (MIDDLE_0 + r * (MIDDLE_1 + r * (MIDDLE_2 + r * MIDDLE_3)))
    return per * force, per * per_e * slope, per * e * energy, part, off


@inlined
def friction_of_slice(law, slip, deviation):
    """Divide the mean friction coefficient from `slip` - `deviation` to `slip` + `deviation` by `slip`; result in s/m.

    `slip` and `deviation` are above 0 [m/s]. By eq. (19) of Giraudo et al. 2025, the coefficient rises linearly to its
    static value at the critical slip velocity, and falls linearly to its dynamic value at 1.5 times this velocity.
    """
    critical = law.critical_velocity
    high, low = slip + deviation, abs(slip - deviation)
    a, b = (high if high < critical else critical), (low if low < critical else critical)
    risen = law.static_friction * (0.5 * (a * a - b * b) / critical + (high - a) - (low - b))
    over, under = high - a, low - b
    half = 0.5 * critical
    a, b = (over if over < half else half), (under if under < half else half)
    fallen = (law.static_friction - law.dynamic_friction) * ((a * a - b * b) / critical + (over - a) - (under - b))
    return (risen - fallen) / (2.0 * deviation * slip)


@kernel_part
def law_at_speed(law, slices, cage, shaft):
    """Adapt the contact law to `cage` and `shaft` speed [rad/s] for lubricated contacts cut into `slices`.

    The coefficient of friction rises with the slide-to-roll ratio, slip over rolling speed, to its limit at the
    critical ratio; if friction is the shear of an oil film, see `law_in_film`. The rolling speed is that of
    `rolling_speed`; both rows of rollers use row 1's cage. No change if the critical ratio is 0 or `slices` is None.
    """
    if slices is None:
        return law
    if slices.critical_ratio == 0.0:
        return law
    rolling = rolling_speed(slices, cage, shaft)
    critical = slices.critical_ratio * rolling
    law = with_friction(law, law.damping, law.static_friction, law.dynamic_friction, critical)
    return law_in_film(law, slices.film, rolling)


@kernel_part
def evaluate_slices(slices, law, rotation, model, groups, single, first_third, end_third, damping, first_time):
    """Add the forces of contacts that are cut into slices along the roller; no effect if `slices` is None.

    Of the three thirds of a contact's length, numbered 0 to 2, the slices in `first_third` to `end_third` - 1 are
    evaluated; see `forces_kernel.evaluate_contacts` for the other arguments.
    """
    if slices is None:
        return
    space, plan = model.space, model.plan
    if first_time is not None:
        find_defects(slices, single, plan, space, rotation, model)
    for group in range(groups):
        race = plan[group, col.GROUP_RACE]
        first, end = slices.starts[race, 0, first_third], slices.starts[race, 0, end_third]
        start, stop = plan[group, col.GROUP_FIRST], plan[group, col.GROUP_END]
        face_roller(space, start, stop)
        while first < end and not touches(law, slices, race, first, space, start, stop):
            first += 1
        while first < end and not touches(law, slices, race, end - 1, space, start, stop):
            end -= 1
        slice_columns(law, slices, slices.film, race, 0, first, end, space, start, stop, damping, None, False)
    for i in range(single):
        row, start = col.FIRST_SINGLE + i, col.SINGLE + i * col.LANES
        race, window = plan[row, col.SINGLE_RACE], plan[row, col.SINGLE_WINDOW]
        first, end = slices.starts[race, window, first_third], slices.starts[race, window, end_third]
        away, on_roller = space[col.POSITION + np.uint64(start)], plan[row, col.SINGLE_BASE] == ON_ROLLER
        slice_columns(
            law, slices, slices.film, race, window, first, end, space, start, start + 1, damping, away, on_roller
        )


@kernel_part
def find_defects(slices, single, plan, space, rotation, model):
    """Find the defect, and its distance, for each of the `single` contacts that may meet a defect of race or roller.

    `rotation`: angles of the rollers about their own axes [rad]. A defect of the roller takes precedence over a defect
    of the race and is marked by `ON_ROLLER` in `plan`. The distance along the race from the defect's middle to the
    roller is stored in row `POSITION` of `space`: [rad] for a defect of the race, [m] for a defect of the roller.
    """
    defects, spare_of, rollers = model.roller_defects, model.spare_of, rotation.shape[0]
    per_point, roller_radius = 2.0 * math.pi / model.races.window_of.shape[2], model.law.roller_radius
    for i in range(single):
        row, start = col.FIRST_SINGLE + i, np.uint64(col.SINGLE + i * col.LANES)
        race, window, at = plan[row, col.SINGLE_RACE], plan[row, col.SINGLE_WINDOW], plan[row, col.SINGLE_FROM]
        face_roller(space, start, start + np.uint64(1))
        away = space[col.POSITION + np.uint64(at)] * per_point + space[col.SHIFT + start] - slices.middle[race, window]
        space[col.POSITION + start] = away - 2.0 * math.pi * math.floor(away / (2.0 * math.pi) + 0.5)
        plan[row, col.SINGLE_BASE] = 0
        if not space[col.DAMAGE + np.uint64(at)] > 0.0:
            continue
        roller = roller_in(at - race * col.RACE, rollers)
        spare = slices.rows.shape[1] - 1 - spare_of[roller]
        for d in range(defects.shape[0]):
            if defects[d, col.DEFECT_ROLLER] == roller:
                # the contact's place on the roller: in front of the outer race, behind it for the inner one
                sense = 1.0 if race == 0 else -1.0
                contact = math.atan2(sense * space[col.A_Y + start], sense * space[col.A_X + start])
                away = contact - rotation[roller] - defects[d, col.DEFECT_ANGLE]
                away -= 2.0 * math.pi * math.floor(away / (2.0 * math.pi) + 0.5)
                away *= sense * roller_radius
                if abs(away) < slices.reach[race, spare]:
                    plan[row, col.SINGLE_WINDOW], plan[row, col.SINGLE_BASE] = spare, ON_ROLLER
                    space[col.POSITION + start] = away


@kernel_part
def face_roller(space, start, stop):
    """Turn the race's radial and tangential axes so that its radial-axial plane contains the roller's centre.

    In this plane the roller is nearest to the race, even if the ring is displaced: motion along the race does not
    change the penetration. `start` to `stop` - 1: columns of `space`, one for each contact; the angle of the turn [rad]
    is stored in row `SHIFT`.
    """
    for j in range(np.uint64(start), np.uint64(stop)):
        radial, tangential = vector_at(space, col.A_X, j), vector_at(space, col.B_X, j)
        centre = vector_at(space, col.O_X, j)
        turn = dot(centre, tangential) / dot(centre, radial)
        turn = turn if abs(turn) < 0.1 else 0.0
        turn *= 1.0 - turn * turn * (1.0 / 3.0)
        c = 1.0 - 0.5 * turn * turn
        store_vector(space, col.A_X, j, plus(times(c, radial), turn, tangential))
        store_vector(space, col.B_X, j, plus(times(c, tangential), -turn, radial))
        space[col.SHIFT + j] = turn


@kernel_part
def touches(law, slices, race, i, space, start, stop):
    """True if slice `i` of a sound race touches one of the rollers in the columns `start` to `stop` - 1 of `space`."""
    radial, axial = slices.rows[race, 0, col.SLICE_RADIAL, i], slices.rows[race, 0, col.SLICE_AXIAL, i]
    normal_radial = slices.rows[race, 0, col.SLICE_NORMAL_RADIAL, i]
    normal_axial = slices.rows[race, 0, col.SLICE_NORMAL_AXIAL, i]
    width, vertex = slices.rows[race, 0, col.SLICE_WIDTH, i], slices.rows[race, 0, col.SLICE_VERTEX, i]
    deepest = -1.0
    for j in range(np.uint64(start), np.uint64(stop)):
        depth, normal = penetration(law, place_of_point((radial, 0.0, axial), space, j))
        sine, _, _ = angle_of_gap(normal_radial, normal_axial, normal, space, j)
        spread = abs(sine) * width
        depth += 0.5 * (spread if spread > vertex else vertex)
        deepest = depth if depth > deepest else deepest
    return deepest > 0.0


@inlined
def angle_of_gap(normal_radial, normal_axial, normal, space, j):
    """Compute the sine of the angle between race and roller surface at a slice of contact `j`, in the plane x-z.

    x is the roller's radial direction, z its axis. `normal_radial`, `normal_axial`: components of the race's normal in
    the race's axes; `normal` of the roller. Also returns x and z of the race's tangent.
    """
    r_x = normal_radial * space[col.A_X + j] + normal_axial * space[col.Z_X + j]
    r_z = normal_radial * space[col.A_Z + j] + normal_axial * space[col.Z_Z + j]
    return normal[0] * r_z - normal[2] * r_x, r_z, -r_x


@kernel_part
def slice_columns(law, slices, film, race, window, first, last, space, start, stop, damping, away, on_roller):
    """Add the forces of slices `first` to `last` - 1 to the contacts of a `race` with some rollers.

    Each contact has a column of the array `space`, here `start` to `stop` - 1. `window`: number of the table in
    `SliceTable.rows`; `away`: distance of the roller from a defect, see `find_defects`, or None without a defect. At a
    defect of the race the force acts along the normal of the roller's surface; at a defect of the roller (`on_roller`),
    whose edge meets the race, along the normal of the race. Other arguments as in `contact_columns`.
    """
    begin, end = np.uint64(start), np.uint64(stop)
    rows = slices.rows
    shear = film_on_race(film, law, race)
    for i in range(first, last):
        radial, axial = rows[race, window, col.SLICE_RADIAL, i], rows[race, window, col.SLICE_AXIAL, i]
        normal_radial = rows[race, window, col.SLICE_NORMAL_RADIAL, i]
        normal_axial = rows[race, window, col.SLICE_NORMAL_AXIAL, i]
        stiffness, width = rows[race, window, col.SLICE_STIFFNESS, i], rows[race, window, col.SLICE_WIDTH, i]
        vertex, lift = rows[race, window, col.SLICE_VERTEX, i], rows[race, window, col.SLICE_LIFT, i]
        bend, half_curvature = rows[race, window, col.SLICE_BEND, i], rows[race, window, col.SLICE_SAG, i]
        tangential = 0.0
        if away is not None:
            along = away if on_roller else away * radial
            radial, tangential, axial = foot_of_slice(rows, race, window, i, along)
        for j in range(begin, end):
            place = place_of_point((radial, tangential, axial), space, j)
            depth, normal = penetration(law, place)
            sine, along_x, along_z = angle_of_gap(normal_radial, normal_axial, normal, space, j)
            if on_roller:  # the race's normal, which then points into the race
                turn = tangential / radial
                reversed_normal = -normal_radial, -turn * normal_radial, -normal_axial
                normal = to_world(reversed_normal, axes_at(space, col.A_X, j))
            spread = abs(sine) * width
            spread = spread if spread > vertex else vertex
            spring, slope, twice_energy, touched, off = slice_spring(stiffness, depth - lift, spread, bend, vertex)
            # force and slip apply at the middle of the load
            side = sine * width / vertex
            side = side if side < 1.0 else 1.0
            off *= width * (side if side > -1.0 else -1.0)
            place = place[0] - off * along_x, place[1], place[2] - off * along_z
            viscous = slices.damping_s * slope
            u_n, slip = approach_and_slip(place, normal, space, j)
            pressure = normal_force(spring, viscous, u_n)
            # difference of the slip between a slice's middle and its ends
            deviation = 0.5 * touched * width * abs(space[col.W_Z + j] * along_x - space[col.W_X + j] * along_z)
            square = dot(slip, slip)
            if film is None:
                speed = math.sqrt(square + LEAST_SLIP * LEAST_SLIP)
                drag = pressure * friction_of_slice(law, speed, deviation + LEAST_SLIP)
            else:
                drag = film_drag(shear, half_curvature, pressure, touched * width, square, deviation)
            add_contact(place, normal, pressure, times(drag, slip), space, j)
            space[col.FRICTION_LOSS + j] += drag * square
            space[col.DAMPING_LOSS + j] += (spring - pressure) * u_n
            space[col.TWICE_ENERGY + j] += twice_energy
            if damping is not None:
                viscous = viscous if pressure > 0.0 else 0.0
                add_damping(viscous, drag, place, normal, space, j)


@kernel_part
def foot_of_slice(rows, race, window, i, away):
    """Compute where slice `i` of a race with a defect meets a roller: radial, along the race, axial [m].

    The defect's middle is `away` [m] behind the roller's meridian. The surface has three parts: the race up to the
    defect's edge, the ramp behind the edge, and the floor, which is above the race if the defect is a raised piece. The
    roller rests on the part that penetrates it most: at the place where the surfaces of this part and of the roller are
    parallel or, if this place is not within the part, on the part's end. The forces then have a potential.
    """
    radial, axial = rows[race, window, col.SLICE_RADIAL, i], rows[race, window, col.SLICE_AXIAL, i]
    half, ramp = rows[race, window, col.SLICE_HALF, i], rows[race, window, col.SLICE_RAMP, i]
    floor, half_curvature = rows[race, window, col.SLICE_FLOOR, i], rows[race, window, col.SLICE_SAG, i]
    side = 1.0 if away > 0.0 else -1.0
    inside = half - side * away  # from the roller's meridian to the nearest edge, along the race
    best, lift = inside if inside > 0.0 else 0.0, 0.0
    least = half_curvature * best * best
    # distance towards the middle of the nearest place on the floor behind the ramp
    floor_at = ramp - inside if ramp > inside else 0.0
    drop = floor + half_curvature * floor_at * floor_at
    if drop < least:
        best, lift, least = -floor_at, floor, drop
    if ramp > 0.0:
        # parallel to the ramp: nearer to the edge by slope over curvature, but on the ramp
        along = 0.5 * floor / (ramp * half_curvature)
        along = along if along < inside else inside
        along = along if along > inside - ramp else inside - ramp
        below = floor * (inside - along) / ramp
        drop = below + half_curvature * along * along
        if drop < least:
            best, lift = along, below
    normal_radial = rows[race, window, col.SLICE_NORMAL_RADIAL, i]
    turn = side * best / radial
    sunk = radial - lift * normal_radial
    return (sunk * math.cos(turn), sunk * math.sin(turn), axial - lift * rows[race, window, col.SLICE_NORMAL_AXIAL, i])
