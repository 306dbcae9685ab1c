"""Oil between rollers and races: film thickness, inlet heating, rolling resistance, and constants of the kernels.

Formulas in SI, for floats or arrays; the page "Oil" of the theory has the equations, limits, and what is neglected.
Sources: D. Dowson & S. Toyoda 1979; B. J. Hamrock & D. Dowson 1977, J. Lubr. Technol. 99, 264 (only the abstract was
read); J. F. Murch & W. R. D. Wilson 1975; B. Jacod, C. H. Venner & P. M. Lugt 2001, doi 10.1115/1.1308021 (only the
abstract was read); R. S. Zhou & M. R. Hoeprich 1991; P. K. Goksem & R. A. Hargreaves 1978; B. J. Hamrock & D. Brewe
1983, length of an elliptical contact (for a circle, half of it is Hertz's radius to 3 %); T. A. Harris & M. N.
Kotzalas, Advanced Concepts of Bearing Technology, 2006, drag on a roller (with the area length times diameter, and the
oil's density times `Oil.fill`). Constants are quoted from memory unless the page names them as checked.
"""

import math

import numpy as np

from srbval.arrays import FloatArray
from srbval.models.full.oil_kernel import SPEED_EXPONENT, FilmLaw, OilLaw, rate_power, thermal_share
from srbval.models.full.parameters import CONTACT_MODULUS_PA
from srbval.scene import Oil

REDUCED_MODULUS_PA = 2 * CONTACT_MODULUS_PA  # Dowson's E'
LOAD_EXPONENT = -0.10  # Dowson & Toyoda's film
ROLLING_EXPONENT, ROLLING_LOAD_EXPONENT = 0.648, 0.246
REFERENCE_PA = 1e9  # mean pressure at which film and roughness are compared; the film varies as p^-0.2
PRESSURES_PA = np.linspace(0.02e9, 4e9, 400)
DEGREE = 7  # of the polynomial of the pressure in `film_law`
# Loads at which the kernel's powers of the load, 0.5 and 0.25, agree with the formula, whose couples rise with Q^0.497
# if contacts are shorter than their rollers, otherwise with Q^0.246: to 1 % from 0.1 to 100 kN. The rate: 859 rpm.
SHORT_N, LONG_N, RATE_RAD_S = 5e3, 5e4, 300.0


def line_film_m(oil: Oil, rolling_m_s: float, load_n_m: float, radius_m: float) -> float:
    """Film thickness in the middle of a line contact [m], isothermal: 3.06 R U^0.69 G^0.56 W^-0.10.

    U, G, W: dimensionless speed, material and load (Dowson & Toyoda 1979). `rolling_m_s`: mean speed of both surfaces
    through the contact; `load_n_m`: load per length; R = `radius_m`: reduced radius of curvature along the race.
    """
    speed = oil.viscosity_pa_s * rolling_m_s / (REDUCED_MODULUS_PA * radius_m)
    material = oil.pressure_viscosity_1_pa * REDUCED_MODULUS_PA
    load = load_n_m / (REDUCED_MODULUS_PA * radius_m)
    return 3.06 * radius_m * speed**SPEED_EXPONENT * material**0.56 * load**LOAD_EXPONENT


def elliptical_films_m(
    oil: Oil, rolling_m_s: float, load_n: FloatArray, radius_m: float, across_m: float
) -> tuple[FloatArray, FloatArray]:
    """Film thickness in the middle of an elliptical contact, and least film thickness [m], isothermal.

    Formulas of Hamrock & Dowson (1977); `rolling_m_s`: mean speed of both surfaces through the contact; `radius_m` and
    `across_m`: reduced radii of curvature along the race and along the roller.
    """
    ellipticity = 1.03 * (across_m / radius_m) ** 0.64
    speed = oil.viscosity_pa_s * rolling_m_s / (REDUCED_MODULUS_PA * radius_m)
    material = oil.pressure_viscosity_1_pa * REDUCED_MODULUS_PA
    load = load_n / (REDUCED_MODULUS_PA * radius_m**2)
    middle = 2.69 * speed**0.67 * material**0.53 * load**-0.067 * (1 - 0.61 * math.exp(-0.73 * ellipticity))
    least = 3.63 * speed**0.68 * material**0.49 * load**-0.073 * (1 - math.exp(-0.68 * ellipticity))
    return radius_m * middle, radius_m * least


def thermal_factor(oil: Oil, rolling_m_s: float) -> float:
    """Factor by which heat in the inlet reduces film thickness and rolling resistance: 3.94 / (3.94 + L^0.62).

    L = relative decrease of viscosity per kelvin x viscosity x squared rolling speed / thermal conductivity.
    """
    return float(thermal_share(inlet_heating_s2_m2(oil), rolling_m_s))


def inlet_heating_s2_m2(oil: Oil) -> float:
    """Heating parameter L of `thermal_factor` divided by the squared rolling speed [s2/m2]."""
    return oil.thinning_1_k * oil.viscosity_pa_s / oil.conductivity_w_mk


def line_load_n_m(pressure_pa: float, radius_m: float) -> float:
    """Load per length of a line contact [N/m] at which the mean Hertzian pressure is `pressure_pa`."""
    return 16 * radius_m * pressure_pa**2 / (math.pi * CONTACT_MODULUS_PA)


def rolling_force_n(oil: Oil, rolling_m_s: float, load_n: float, radius_m: float, length_m: float) -> float:
    """Force F of rolling resistance on each surface [N], isothermal: 29.2 R l (G U)^0.648 W^0.246 / alpha.

    The pressure in the inlet causes the force; rolling at the speed u = `rolling_m_s` takes the power 2 F u. R and l:
    reduced `radius_m` and `length_m` of the contact; alpha: pressure-viscosity coefficient; U, G, W: see `line_film_m`.
    """
    speed = oil.viscosity_pa_s * rolling_m_s / (REDUCED_MODULUS_PA * radius_m)
    material = oil.pressure_viscosity_1_pa * REDUCED_MODULUS_PA
    load = load_n / (length_m * REDUCED_MODULUS_PA * radius_m)
    force = 29.2 * (material * speed) ** ROLLING_EXPONENT * load**ROLLING_LOAD_EXPONENT
    return force * radius_m * length_m / oil.pressure_viscosity_1_pa


class ContactShape:
    """Contact of a roller with one race, given by the curvatures of the gap along the race and across it [1/m]."""

    def __init__(self, along_1_m: float, across_1_m: float, roller_length_m: float) -> None:
        self.along_m, self.across_m = 1 / along_1_m, 1 / max(across_1_m, 1e-9)
        self.roller_length_m = roller_length_m

    def length_m(self, load_n: float) -> float:
        """Length of the contact along the roller [m] (Hamrock & Brewe 1983), at most the roller's length."""
        ratio = self.across_m / self.along_m
        shape = (1.0339 * ratio**0.636) ** 2 * (1 + 0.5968 / ratio)
        radius = 1 / (1 / self.along_m + 1 / self.across_m)
        found = 2 * (6 * shape * load_n * radius / (math.pi * REDUCED_MODULUS_PA)) ** (1 / 3)
        return float(min(found, self.roller_length_m))

    def rolling_couple_nm(self, oil: Oil, rate_rad_s: float, load_n: float, length_m: float) -> float:
        """Rolling-resistance couple [N m]: 2 R x `rolling_force_n` at the speed R x `rate_rad_s`; R: reduced radius."""
        force = rolling_force_n(oil, rate_rad_s * self.along_m, load_n, self.along_m, length_m)
        return 2 * force * self.along_m


def film_law(oil: Oil, shapes: list[ContactShape]) -> FilmLaw:
    """Constants of the friction by oil films in the contacts `shapes` with the outer and the inner race.

    A polynomial of the pressure, fitted for each race, gives the viscosity divided by the film thickness to 5 %.
    """
    films = [[line_film_m(oil, 1.0, line_load_n_m(p, s.along_m), s.along_m) for p in PRESSURES_PA] for s in shapes]
    thickness = min(line_film_m(oil, 1.0, line_load_n_m(REFERENCE_PA, s.along_m), s.along_m) for s in shapes)
    thicker = np.array([oil.log_thickening(p) for p in PRESSURES_PA]) - np.log(np.array(films) / thickness)
    fits = [np.polynomial.Polynomial.fit(PRESSURES_PA * 1e-9, row, DEGREE) for row in thicker / math.log(2)]
    return FilmLaw(
        curve=np.array([fit.convert().coef for fit in fits]),
        hertz=math.pi * CONTACT_MODULUS_PA / 8,
        thickness=thickness,
        per_thickness=oil.eyring_stress_pa / oil.viscosity_pa_s,
        eyring=oil.eyring_stress_pa,
        roughness=oil.roughness_m,
        boundary=oil.boundary_friction,
        heating=inlet_heating_s2_m2(oil),
    )


def oil_law(oil: Oil, shapes: list[ContactShape], roller_m: float) -> OilLaw:
    """Constants of rolling resistance, drag and friction in the cage's pockets; `roller_m`: radius of the rollers."""
    rolling = np.zeros((2, 2))
    for race, shape in enumerate(shapes if oil.rolling_resistance else []):
        short = shape.rolling_couple_nm(oil, RATE_RAD_S, SHORT_N, shape.length_m(SHORT_N)) / SHORT_N**0.5
        full = shape.rolling_couple_nm(oil, RATE_RAD_S, LONG_N, shape.roller_length_m) / LONG_N**0.25
        rolling[race] = np.array([short, full]) / rate_power(RATE_RAD_S)
    area = 2 * roller_m * shapes[0].roller_length_m
    return OilLaw(
        rolling=rolling,
        heating=inlet_heating_s2_m2(oil),
        drag=0.5 * oil.fill * oil.density_kg_m3 * oil.drag_coefficient * area,
        pocket=oil.pocket_friction,
    )
