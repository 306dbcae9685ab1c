"""Masses and moments of inertia of the bodies, from their shapes and densities."""

import math
from dataclasses import dataclass

import numpy as np

from srbval.bearing import SphericalRollerGeometry

GAUSS_POINTS = 32  # the profiles are smooth; 32 points integrate them to rounding


@dataclass(frozen=True, kw_only=True)
class RollerBody:
    """A barrel roller: mass [kg], moments of inertia about its axis and across it [kg m2]."""

    mass_kg: float
    axial_kg_m2: float
    transverse_kg_m2: float


def roller_body(geometry: SphericalRollerGeometry, diameter_m: float, density_kg_m3: float) -> RollerBody:
    """Solid of revolution of the raceway's profile arc, `diameter_m` at its middle.

    Integrals over the width: m = rho pi int r^2 dz, I_a = rho pi/2 int r^4 dz,
    I_t = I_a/2 + rho pi int r^2 z^2 dz (any text on rigid bodies). No end chamfers, no bore.
    """
    half = geometry.roller_width_m / 2
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    z, dz = half * nodes, half * weights
    radius = diameter_m / 2 - geometry.raceway_radius_m + np.sqrt(geometry.raceway_radius_m**2 - z**2)
    axial = density_kg_m3 * math.pi / 2 * float(np.sum(radius**4 * dz))
    return RollerBody(
        mass_kg=density_kg_m3 * math.pi * float(np.sum(radius**2 * dz)),
        axial_kg_m2=axial,
        transverse_kg_m2=axial / 2 + density_kg_m3 * math.pi * float(np.sum(radius**2 * z**2 * dz)),
    )


def outer_ring_mass_kg(geometry: SphericalRollerGeometry, density_kg_m3: float) -> float:
    """Mass of the outer ring: a cylinder of the outer diameter less the sphere of the raceway [kg].

    V = pi int (R_o^2 - (R_x^2 - z^2)) dz over the width; the lubrication groove is ignored.
    """
    half = geometry.width_m / 2
    outer, sphere = geometry.outer_diameter_m / 2, geometry.raceway_radius_m
    volume = 2 * math.pi * ((outer**2 - sphere**2) * half + half**3 / 3)
    return density_kg_m3 * volume
