"""Oil in the slices model: constants of traction, rolling resistance, drag and friction in cage pockets.

The page "Oil" of the theory describes rolling resistance, drag, and what is neglected. The length of an elliptical
contact follows B. J. Hamrock & D. Brewe 1983 (quoted from memory; for a circle it is Hertz's radius to 1 %). The drag
on a roller is computed with the area length times diameter and the oil's density times `Oil.fill` (T. A. Harris &
M. N. Kotzalas, Advanced Concepts of Bearing Technology, 2006; quoted from memory)."""

import math

import numpy as np

from srbval.models.film import (
    CONTACT_MODULUS_PA,
    REDUCED_MODULUS_PA,
    inlet_heating_s2_m2,
    line_film_m,
    line_load_n_m,
    rolling_force_n,
)
from srbval.models.full.film_kernel import FilmLaw
from srbval.models.full.oil_kernel import OilLaw, rate_power
from srbval.scene import Oil

REFERENCE_PA = 1e9  # mean pressure at which film and roughness are compared; the film varies as p^-0.2
PRESSURES_PA = np.linspace(0.02e9, 4e9, 400)
DEGREE = 7
# Loads at which the kernel's powers of the load, 0.5 and 0.25, agree with the formula, whose couples rise with Q^0.497
# if contacts are shorter than their rollers, otherwise with Q^0.246: to 1 % from 0.1 to 100 kN. The rate: 859 rpm.
SHORT_N, LONG_N, RATE_RAD_S = 5e3, 5e4, 300.0


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
        """Couple of rolling resistance [N m], 2 R `rolling_force_n`; `rate_rad_s`: rolling speed / reduced radius R."""
        force = rolling_force_n(oil, rate_rad_s * self.along_m, load_n, self.along_m, length_m)
        return 2 * force * self.along_m


def film_law(oil: Oil, shapes: list[ContactShape]) -> FilmLaw:
    """Constants of oil-film friction in contacts `shapes`; the fit of viscosity over thickness is accurate to 5 %."""
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
    """Constants of rolling resistance, drag and pocket friction, for contacts `shapes` and roller radius `roller_m`."""
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
