"""Kernels: effects of oil: friction of the films, rolling resistance, drag, friction in the cage's pockets.

The drag of the film in a slice of a contact, force over slip, is Eyring's law at the slice's mean pressure p plus the
friction of touching asperities:

    drag = N (1 - s) (tau_0 / p) arsinh(u / u_0) / u + N s mu_b / (u + u_b),   u_0 = tau_0 h / eta(p)

with slip u, normal force N, the asperities' share s of the load, their friction coefficient mu_b at high slip, the slip
u_b at which half of mu_b is reached, Eyring's stress tau_0, film thickness h and viscosity eta. The drag is averaged
over the slice's two Gauss points, because the slip differs between its ends. Logarithm and exponential are written out:
library calls would prevent vector instructions.

The other forces are small beside the load and change slowly, so steps treat them explicitly: rolling resistance alone
would stop a roller's spin in 0.3 s. Equations: `srbval.models.oil`. A pocket's friction along the slot (10 N) is left
out.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from srbval.models.full import columns as col
from srbval.models.full.contact_kernel import with_friction
from srbval.models.jit import kernel_part

THERMAL, THERMAL_EXPONENT = 3.94, 0.62  # of Murch & Wilson
LEAST_RAD_S = 1e-6
GAUSS = 1.0 / math.sqrt(3.0)  # places of a slice, from its middle, in half widths
LEAST_M_S = 1e-6  # added to slips; a thousandth of Eyring's
BOUNDARY_M_S = 1e-3  # slip up to which the asperities' friction rises
LEAST_GPA, MOST_GPA = 1e-6, 4.0  # limits of the mean pressure in the polynomial
MOST_S_M = 1e8  # far beyond any film; larger squares overflow in single precision
SPEED_EXPONENT, ASPERITY, ASPERITY_EXPONENT = 0.69, 1.8, 1.2  # of Dowson & Toyoda, and of Zhou & Hoeprich
# Polynomials: 2^(y + 1/2) from -1/2 to 1/2 to 3e-6, and ln(1.1 + t) for 1.1 + t from 0.75 to 1.5 to 2e-5, exact at 1.
EXP_0, EXP_1, EXP_2, EXP_3, EXP_4 = (
    1.4142136691396427, 0.9802211666369074, 0.33972390019397863, 0.07908570124787076, 0.013683982893831248,
)  # fmt: skip
LOG_0, LOG_1, LOG_2, LOG_3, LOG_4, LOG_5 = (
    0.09529915075957063, 0.9090600810807347, -0.41215527847234446,
    0.25117496817302565, -0.19131780055505507, 0.12831185451687513,
)  # fmt: skip
LOG_MIDDLE, MIDDLE_BITS = 1.1, 1061158912  # the bits of 0.75


class FilmLaw(NamedTuple):
    """Constants of the oil film's friction; all are numbers except `curve`.

    The reference film is the thinner of both races' films at a mean pressure of 1 GPa. `curve`, [2 races, 8]:
    coefficients of a polynomial in the mean pressure [GPa] for the binary logarithm of a / b, where a is the viscosity
    divided by the viscosity without pressure, and b the film's thickness divided by that of the reference film.
    `hertz`: pi / 8 times the contact modulus [Pa]; `thickness` of the reference film at a rolling speed of 1 m/s [m];
    `per_thickness`: Eyring's stress over viscosity without pressure [1/s]; `eyring`: Eyring's stress [Pa]; `roughness`
    [m]; `boundary`: friction coefficient of asperities; `heating`: see `OilLaw`.
    """

    curve: Any
    hertz: float
    thickness: float
    per_thickness: float
    eyring: float
    roughness: float
    boundary: float
    heating: float


class OilLaw(NamedTuple):
    """Constants of the oil's forces on rollers; all are numbers except `rolling`.

    `rolling`, [2 races, 2]: couple that resists rolling [N m] at 1 rad/s between race and roller. The first number is
    for contacts shorter than their roller and is divided by the square root of the load [N]; the second is for contacts
    as long as their roller and is divided by the fourth root of the load. `heating`: heating number L at a rolling
    speed of 1 m/s; `drag`: force on a roller over its speed squared [kg/m]; `pocket`: friction coefficient at the cage.
    """

    rolling: Any
    heating: float
    drag: float
    pocket: float


@kernel_part
def rolling_speed(slices, cage, shaft):
    """Compute the speed at which contacts move over the rollers [m/s], mean of both races; `cage`, `shaft`: [rad/s]."""
    return 0.5 * (slices.outer_radius * abs(cage) + slices.inner_radius * abs(shaft - cage)) + 1e-6


@kernel_part
def thermal_share(heating, rolling):
    """Compute the factor of shear heating on an oil film, 3.94 / (3.94 + (`heating` v^2)^0.62), v = `rolling` [m/s]."""
    return THERMAL / (THERMAL + (heating * rolling * rolling) ** THERMAL_EXPONENT)


@kernel_part
def law_in_film(law, film, rolling):
    """Copy the contact law with three fields changed to constants of an oil `film`, as `film_drag` needs them.

    `rolling`: speed at which the contacts move over the rollers [m/s]. In the copy, `static_friction` is the share of
    the load on the oil, `dynamic_friction` the share on touching asperities times their friction coefficient.
    `critical_velocity` is Eyring's stress times the thickness of the thinner of both races' films, over the viscosity
    without pressure [m/s]. If `film` is None, the law is returned unchanged.
    """
    if film is None:
        return law
    height = film.thickness * rolling**SPEED_EXPONENT * thermal_share(film.heating, rolling)
    share = math.exp(-ASPERITY * (height / film.roughness) ** ASPERITY_EXPONENT)
    static, dynamic = law.static_friction * (1.0 - share), law.static_friction * share * film.boundary
    return with_friction(law, law.damping, static, dynamic, film.per_thickness * height)


@kernel_part
def power_of_two(x):
    """Compute 2^x to 1e-5 for x from -100 to 60, in single precision, by a polynomial and the exponent bits."""
    x += np.float32(128.0)  # above zero, so that the conversion rounds down
    whole = np.int32(x)
    y = x - np.float32(whole) - np.float32(0.5)
    e = np.float32(EXP_1) + y * (np.float32(EXP_2) + y * (np.float32(EXP_3) + y * np.float32(EXP_4)))
    return (np.float32(EXP_0) + y * e) * np.int32((whole - np.int32(1)) << np.int32(23)).view(np.float32)


@kernel_part
def logarithm(x):
    """Compute ln x to 2e-5 for x above 0.75, in single precision, by a polynomial and the exponent bits."""
    bits = np.float32(x).view(np.int32)
    exponent = np.int32(np.int32(bits - np.int32(MIDDLE_BITS)) >> np.int32(23))
    t = np.int32(bits - np.int32(exponent << np.int32(23))).view(np.float32) - np.float32(LOG_MIDDLE)
    series = np.float32(LOG_2) + t * (np.float32(LOG_3) + t * (np.float32(LOG_4) + t * np.float32(LOG_5)))
    return np.float32(LOG_0) + t * (np.float32(LOG_1) + t * series) + np.float32(exponent) * np.float32(math.log(2.0))


@kernel_part
def film_on_race(film, law, race):
    """Collect the constants that `film_drag` needs for one race, in single precision; `law`: from `law_in_film`."""
    if film is None:
        return None
    curve = film.curve
    return (
        np.float32(curve[race, 0]),
        np.float32(curve[race, 1]),
        np.float32(curve[race, 2]),
        np.float32(curve[race, 3]),
        np.float32(curve[race, 4]),
        np.float32(curve[race, 5]),
        np.float32(curve[race, 6]),
        np.float32(curve[race, 7]),
        np.float32(film.hertz * 1e-18),
        np.float32(1.0 / law.critical_velocity),
        np.float32(0.5e-9 * law.static_friction * film.eyring),
        np.float32(law.dynamic_friction),
    )


@kernel_part
def film_drag(film, half_curvature, normal, length, square, deviation):
    """Compute friction force over slip [N s/m] of a slice in an oil film, in single precision to be fast.

    `film`: from `film_on_race`; `half_curvature`: half the curvature of the gap along the race [1/m]; `normal` force
    [N]; `length` of the contact along the roller [m]; `square` of the slip in the slice's middle [m2/s2]; `deviation`:
    difference of the slip at the slice's ends from this slip [m/s].
    """
    c0, c1, c2, c3, c4, c5, c6, c7, hertz, per_velocity, eyring, boundary = film
    one, load = np.float32(1.0), np.float32(normal) / (np.float32(length) + np.float32(1e-12))
    pressure = math.sqrt(hertz * np.float32(half_curvature) * load) + np.float32(LEAST_GPA)
    x = pressure if pressure < np.float32(MOST_GPA) else np.float32(MOST_GPA)
    thicker = c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * (c5 + x * (c6 + x * c7))))))
    per_slip = power_of_two(thicker) * per_velocity
    per_slip = per_slip if per_slip < np.float32(MOST_S_M) else np.float32(MOST_S_M)
    squared, aside = np.float32(square), np.float32(GAUSS) * np.float32(deviation)
    slip = math.sqrt(squared) + np.float32(LEAST_M_S)
    a, b = (slip + aside) * per_slip, (slip - aside) * per_slip
    # arsinh a + arsinh b, a the larger: one logarithm is enough
    size = abs(b)
    greater, less = a + math.sqrt(one + a * a), size + math.sqrt(one + size * size)
    sheared = logarithm(greater * less if b > np.float32(0.0) else greater / less)
    resting = slip + aside + np.float32(BOUNDARY_M_S)
    return normal * np.float64((eyring * sheared * resting + boundary * pressure * slip) / (pressure * slip * resting))


@kernel_part
def rate_power(rate):
    """Compute rate^0.6484 from square roots, which is fast; the exponent of Goksem & Hargreaves is 0.648."""
    half = math.sqrt(np.float32(rate))
    eighth = math.sqrt(math.sqrt(half))
    last = math.sqrt(math.sqrt(math.sqrt(eighth)))
    return np.float64(half * eighth * last * math.sqrt(last))


@kernel_part
def resist_rolling(space, j, short, full):
    """Add the couple that resists rolling to the torque of contact `j`; returns the power lost to it [W].

    `short`, `full`: factors, see `OilLaw.rolling`, for contacts shorter than their roller and contacts as long as it.
    """
    root = math.sqrt(math.sqrt(np.float32(space[col.F_X + j] ** 2 + space[col.F_Y + j] ** 2 + space[col.F_Z + j] ** 2)))
    shorter, longest = short * root, full * math.sqrt(root)
    rate = space[col.W_Z + j]
    size = abs(rate) + LEAST_RAD_S
    couple = rate_power(size) * (shorter if shorter < longest else longest) * rate / size
    space[col.T_Z + j] += couple
    return couple * rate


@kernel_part
def add_oil_forces(oil, model, slots, cage, shaft, totals):
    """Add the oil's rolling resistance and the pockets' friction to the rollers' torques, and the powers to `totals`.

    Also writes the couples on the cages to row `ON_CAGE` of the workspace. Call it after all contact forces. No effect
    if `oil` (`OilLaw`) is None.
    """
    if oil is None:
        return
    space = model.space
    radius, weight = model.law.roller_radius, model.roller_mass * model.gravity
    thermal = thermal_share(oil.heating, rolling_speed(model.slices, cage, shaft))
    outer_short, outer_full = thermal * oil.rolling[0, 0], thermal * oil.rolling[0, 1]
    inner_short, inner_full = thermal * oil.rolling[1, 0], thermal * oil.rolling[1, 1]
    drag_factor, pocket, centre = oil.drag, oil.pocket, model.centre_distance
    rolled = dragged = rubbed = 0.0
    for p in range(slots):
        there = space[col.SIDE + p] * space[col.SIDE + p]  # 0 of an empty slot
        rolled += resist_rolling(space, p, outer_short, outer_full)
        rolled += resist_rolling(space, p + col.INNER, inner_short, inner_full)
        speed = (centre + space[col.SLIDE + p]) * space[col.CAGE_Z + p]
        drag = -drag_factor * there * abs(speed) * speed
        dragged -= drag * speed
        push = space[col.F_Y + p] + space[col.F_Y + p + col.INNER] + drag + weight * space[col.Y_WY + p]
        turning = space[col.SPIN + p] - space[col.CAGE_Z + p]
        couple = -pocket * there * abs(push) * radius * turning / (abs(turning) + LEAST_RAD_S)
        space[col.T_Z + p] += couple  # the ring does not turn: only the roller uses this torque
        space[col.ON_CAGE + p] = (centre + space[col.SLIDE + p]) * drag - couple
        rubbed -= couple * turning
    totals[col.ROLLING_POWER], totals[col.DRAG_POWER], totals[col.POCKET_POWER] = rolled, dragged, rubbed
