"""Oil films between rollers and races, their heating, and rolling resistance: formulas in SI, for floats or arrays.

The page "Oil" of the theory has the formulas and their limits. Sources: D. Dowson & S. Toyoda 1979; B. J. Hamrock & D.
Dowson 1977, J. Lubr. Technol. 99, 264 (only the abstract was read); J. F. Murch & W. R. D. Wilson 1975; B. Jacod, C. H.
Venner & P. M. Lugt 2001, doi 10.1115/1.1308021 (only the abstract was read); R. S. Zhou & M. R. Hoeprich 1991; P. K.
Goksem & R. A. Hargreaves 1978. Constants are quoted from memory unless the page names them as checked."""

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
    """Film thickness in the middle of a line contact [m], isothermal: 3.06 R U^0.69 G^0.56 W^-0.10.

    U, G, W: dimensionless speed, material and load (Dowson & Toyoda 1979); `rolling_m_s`: mean speed of both surfaces
    through the contact; `radius_m`, R: reduced radius of curvature along the race.
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
    """Heating parameter L of `thermal_factor`, divided by the square of the rolling speed [s2/m2]."""
    return oil.thinning_1_k * oil.viscosity_pa_s / oil.conductivity_w_mk


def line_load_n_m(pressure_pa: float, radius_m: float) -> float:
    """Load per length of a line contact [N/m] at which the mean Hertzian pressure is `pressure_pa`."""
    return 16 * radius_m * pressure_pa**2 / (math.pi * CONTACT_MODULUS_PA)


def rolling_force_n(oil: Oil, rolling_m_s: float, load_n: float, radius_m: float, length_m: float) -> float:
    """Force F of rolling resistance on each surface [N], isothermal: 29.2 R l (G U)^0.648 W^0.246 / alpha.

    The force is due to the pressure in the inlet; rolling at the speed u takes the power 2 F u. R: reduced radius, l:
    length of the contact, alpha: pressure-viscosity coefficient; U, G, W: see `line_film_m`.
    """
    speed = oil.viscosity_pa_s * rolling_m_s / (REDUCED_MODULUS_PA * radius_m)
    material = oil.pressure_viscosity_1_pa * REDUCED_MODULUS_PA
    load = load_n / (length_m * REDUCED_MODULUS_PA * radius_m)
    force = 29.2 * (material * speed) ** ROLLING_EXPONENT * load**ROLLING_LOAD_EXPONENT
    return force * radius_m * length_m / oil.pressure_viscosity_1_pa
