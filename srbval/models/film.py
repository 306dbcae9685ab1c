"""Films between rollers and races, how they shear, and what rolling costs: closed forms, SI, floats or arrays.

The page "Oil" of the theory has the formulas and what is left out. Sources: D. Dowson & S. Toyoda 1979; B. J. Hamrock &
D. Dowson 1977, J. Lubr. Technol. 99, 264 (abstract read); J. F. Murch & W. R. D. Wilson 1975; B. Jacod, C. H. Venner &
P. M. Lugt 2001, doi 10.1115/1.1308021 (abstract read); R. S. Zhou & M. R. Hoeprich 1991; P. K. Goksem & R. A.
Hargreaves 1978. Constants that the page does not name as checked are quoted from memory."""

import math

from srbval.arrays import FloatArray
from srbval.models.full.film_kernel import SPEED_EXPONENT
from srbval.models.full.oil_kernel import thermal_share
from srbval.scene import Oil

# steel, 207 GPa and 0.3: contact modulus E / (2 (1 - nu^2)) of two bodies, after Hertz, and Dowson's E', twice that
CONTACT_MODULUS_PA = 207e9 / (2 * (1 - 0.3**2))
REDUCED_MODULUS_PA = 2 * CONTACT_MODULUS_PA
LOAD_EXPONENT = -0.10  # Dowson & Toyoda's film
ROLLING_EXPONENT, ROLLING_LOAD_EXPONENT = 0.648, 0.246


def line_film_m(oil: Oil, rolling_m_s: float, load_n_m: float, radius_m: float) -> float:
    """Film in the middle of a line contact: H = 3.06 U^0.69 G^0.56 W^-0.10, isothermal.

    `rolling_m_s`: mean of both surfaces' speeds through the contact; `radius_m`: reduced, along the race.
    """
    speed = oil.viscosity_pa_s * rolling_m_s / (REDUCED_MODULUS_PA * radius_m)
    material = oil.pressure_viscosity_1_pa * REDUCED_MODULUS_PA
    load = load_n_m / (REDUCED_MODULUS_PA * radius_m)
    return 3.06 * radius_m * speed**SPEED_EXPONENT * material**0.56 * load**LOAD_EXPONENT


def elliptical_films_m(
    oil: Oil, rolling_m_s: float, load_n: FloatArray, radius_m: float, across_m: float
) -> tuple[FloatArray, FloatArray]:
    """Film in the middle of an elliptical contact, and its least, isothermal.

    H_c = 2.69 U^0.67 G^0.53 W^-0.067 (1 - 0.61 e^(-0.73 k)), H_min = 3.63 U^0.68 G^0.49 W^-0.073 (1 - e^(-0.68 k)), k =
    1.03 (R_y / R_x)^0.64; `radius_m` reduced along the race, `across_m` along the roller.
    """
    ellipticity = 1.03 * (across_m / radius_m) ** 0.64
    speed = oil.viscosity_pa_s * rolling_m_s / (REDUCED_MODULUS_PA * radius_m)
    material = oil.pressure_viscosity_1_pa * REDUCED_MODULUS_PA
    load = load_n / (REDUCED_MODULUS_PA * radius_m**2)
    middle = 2.69 * speed**0.67 * material**0.53 * load**-0.067 * (1 - 0.61 * math.exp(-0.73 * ellipticity))
    least = 3.63 * speed**0.68 * material**0.49 * load**-0.073 * (1 - math.exp(-0.68 * ellipticity))
    return radius_m * middle, radius_m * least


def thermal_factor(oil: Oil, rolling_m_s: float) -> float:
    """Share of film and rolling resistance that shear heating of the inlet leaves: 3.94 / (3.94 + L^0.62).

    L = beta eta_0 u^2 / k, with the share beta by which the viscosity falls per degree.
    """
    return float(thermal_share(inlet_heating_s2_m2(oil), rolling_m_s))


def inlet_heating_s2_m2(oil: Oil) -> float:
    """L of the inlet's shear heating over the square of the speed [s2/m2]; see `thermal_factor`."""
    return oil.thinning_1_k * oil.viscosity_pa_s / oil.conductivity_w_mk


def line_load_n_m(pressure_pa: float, radius_m: float) -> float:
    """The load per length that has this mean pressure."""
    return 16 * radius_m * pressure_pa**2 / (math.pi * CONTACT_MODULUS_PA)


def rolling_force_n(oil: Oil, rolling_m_s: float, load_n: float, radius_m: float, length_m: float) -> float:
    """Force F of rolling resistance on each surface, isothermal: 29.2 R l (G U)^0.648 W^0.246 / alpha.

    The pressure builds up in the inlet: rolling at u costs 2 F u, and both surfaces together resist turning with the
    couple 2 F R, R reduced. `oil.ContactShape.rolling_couple_nm` gives that couple.
    """
    speed = oil.viscosity_pa_s * rolling_m_s / (REDUCED_MODULUS_PA * radius_m)
    material = oil.pressure_viscosity_1_pa * REDUCED_MODULUS_PA
    load = load_n / (length_m * REDUCED_MODULUS_PA * radius_m)
    force = 29.2 * (material * speed) ** ROLLING_EXPONENT * load**ROLLING_LOAD_EXPONENT
    return force * radius_m * length_m / oil.pressure_viscosity_1_pa
