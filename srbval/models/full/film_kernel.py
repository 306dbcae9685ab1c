"""Kernels: how the film under a slice shears.

Eyring's law at the slice's mean pressure p, see `srbval.models.film`, and where asperities touch their friction beside:

    drag = N (1 - s) (tau_0 / p) arsinh(u / u_0) / u + N s mu_b / sqrt(u^2 + u_b^2),   u_0 = tau_0 h / eta(p)

with the load share s of the asperities, and the mean of two places of the slice, Gauss's, as the slip u differs between
its ends. Logarithm and exponential are written out, since a loop with a library's would not run on many columns at once.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from srbval.models.full.contact_kernel import ContactLaw
from srbval.models.full.oil_kernel import rolling_speed, thermal_share
from srbval.models.jit import inlined, kernel_part

GAUSS = 1.0 / math.sqrt(3.0)  # places of a slice, from its middle, in half widths
BOUNDARY_M_S = 1e-3  # slip to which asperities' friction is taken as a slope
LEAST_PA, MOST_GPA = 1e3, 4.0  # of the mean pressure; the curve ends there
SPEED_EXPONENT, ASPERITY, ASPERITY_EXPONENT = 0.69, 1.8, 1.2  # see `film`
DOUBLINGS = 128.0  # 2^7, by which the exponent is divided before it is squared seven times


class FilmLaw(NamedTuple):
    """Constants of a film's shear. Numbers only, but for `curve`.

    `curve`, [2 races, 8]: polynomial over the mean pressure [GPa] whose value is the logarithm of the viscosity over
    that without pressure, less that of the film over the reference film; `hertz`: pi E* / 8 [Pa]; `thickness`: the
    reference film at 1 m/s [m]; `per_thickness`: Eyring's slip speed without pressure over the film [1/s]; `eyring`
    [Pa]; `roughness` [m]; `boundary`: coefficient of friction; `heating`: see `oil_kernel.OilLaw`.
    """

    curve: Any
    hertz: float
    thickness: float
    per_thickness: float
    eyring: float
    roughness: float
    boundary: float
    heating: float


@kernel_part
def law_in_film(law, slices, cage, shaft):
    """`film_at_speed` where slices have a film, and no critical ratio of 0 holds the law as it is."""
    if slices is None:
        return law
    return film_at_speed(law, slices, slices.film, cage, shaft)


@kernel_part
def film_at_speed(law, slices, film, cage, shaft):
    """The law with Eyring's slip speed in place of the critical velocity, and shares of friction, at these speeds.

    The static coefficient becomes the film's share, 1 less that of the asperities; the dynamic one what asperities add.
    """
    if film is None:
        return law
    if slices.critical_ratio == 0.0:
        return law
    rolling = rolling_speed(slices, cage, shaft)
    height = film.thickness * rolling**SPEED_EXPONENT * thermal_share(film.heating, rolling)
    share = math.exp(-ASPERITY * (height / film.roughness) ** ASPERITY_EXPONENT)
    return ContactLaw(
        law.profile_radius, law.roller_radius, law.stiffness, law.damping, law.smoothing,
        law.static_friction * (1.0 - share), law.static_friction * share * film.boundary, film.per_thickness * height,
        law.onset_s,
    )  # fmt: skip


@inlined
def exponential(x):
    """e^x to 1e-4 from -10 to 20."""
    y = x * (1.0 / DOUBLINGS)
    e = 1.0 + y * (1.0 + y * (0.5 + y * (1.0 / 6.0 + y * (1.0 / 24.0))))
    e *= e
    e *= e
    e *= e
    e *= e
    e *= e
    e *= e
    return e * e


@inlined
def logarithm(x):
    """ln x to 1e-5 for x from 1 to 1e11: the 64th root in single precision, and what it leaves, in double."""
    single = math.sqrt(math.sqrt(math.sqrt(math.sqrt(math.sqrt(math.sqrt(np.float32(x)))))))
    root = np.float64(single)
    power = root * root
    power *= power
    power *= power
    power *= power
    power *= power
    power *= power
    off = x / power - 1.0
    t = (root - 1.0) / (root + 1.0)
    t2 = t * t
    return 128.0 * t * (1.0 + t2 * (1.0 / 3.0 + t2 * (0.2 + t2 * (1.0 / 7.0)))) + off * (1.0 - 0.5 * off)


@kernel_part
def film_drag(film, law, race, sagging, normal, length, square, more):
    """Friction over slip of a slice [N s/m]; `more`: by how much the slip differs from its middle to its ends [m/s].

    `sagging`: half the curvature of the gap along the race [1/m]; `length` that touches [m]; `square` of the slip.
    """
    pressure = math.sqrt(film.hertz * sagging * normal / (length + 1e-12)) + LEAST_PA
    x = pressure * 1e-9
    x = x if x < MOST_GPA else MOST_GPA
    curve = film.curve
    high = curve[race, 4] + x * (curve[race, 5] + x * (curve[race, 6] + x * curve[race, 7]))
    thicker = curve[race, 0] + x * (curve[race, 1] + x * (curve[race, 2] + x * (curve[race, 3] + x * high)))
    per_slip = exponential(thicker) / law.critical_velocity
    slip, aside = math.sqrt(square) + 1e-9, GAUSS * more
    a, b = (slip + aside) * per_slip, (slip - aside) * per_slip
    # arsinh a + arsinh b = arsinh(...): one logarithm serves both
    y = a * math.sqrt(1.0 + b * b) + b * math.sqrt(1.0 + a * a)
    sheared = 0.5 * logarithm(y + math.sqrt(1.0 + y * y))
    boundary = law.dynamic_friction / math.sqrt(square + aside * aside + BOUNDARY_M_S * BOUNDARY_M_S)
    return normal * (law.static_friction * film.eyring * sheared / (pressure * slip) + boundary)
