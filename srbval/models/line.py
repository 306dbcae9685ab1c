"""Line model: the full model with races that are continuous curves instead of rows of points.

In both models a roller touches a race only on three circles around the race. In the full model these are rows of
points, of which about three touch the roller at a time; in the line model the contact at each circle is a continuous
patch along the race. Only this differs. For force F and damping of a patch see "Continuous contact" on the page
"Contact" of the theory; at the penetration d in its middle, the elastic energy is 2/5 F d. The force of three points
differs by some per cent. Where a defect raises the race by h, the penetration is d + h.

The damping force depends on the rate of penetration in the middle: rolling adds as much to the rate on one side of the
middle as it removes on the other. At the distance xi from the middle, in half lengths of the patch, the penetration is
d (1 - xi^2). If the race turns at the angular speed W relative to a roller of radius rho, the slip velocity at xi is
larger than in the middle by W d (1 + 1/(kappa rho)) xi^2, with the curvature kappa of the gap along the race. If the
race turns about the contact's normal, it also slips sideways. Both slips are far above the critical velocity of the
friction law, eq. (19) of Giraudo et al. 2025. The patch therefore has three parts of equal load, each with its mean
slip, and the law is averaged over the slips within a part. Neglected: the couples by which dampers resist rolling, the
couples by which friction resists pivoting, the power of these couples, and the inclination of the normal along a patch.

Near a defect, which may raise only a part of the patch, the race consists of points as in the full model, but `DENSER`
times as many; stiffness and damping of each are divided by this number. Elsewhere no points pass the roller, so a time
step may be three times the full model's (RMS in 500-1500 Hz accurate to 1 %).

The model answers all questions of `srbval plan`, but does not contain the vibration that points excite when they pass a
roller in the full model. It cannot simulate defects on rollers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import CIRCLES, Fault, SphericalRollerGeometry
from srbval.errors import ConfigurationError
from srbval.models.full.parameters import Parameters, make_parameters, roller_diameter_m
from srbval.models.full.point_cloud import race_circle
from srbval.scene import Contact, Defect, Scene, with_points

DENSER = 4  # number of points near a defect for each point of the full model
UNDER_ROLLER = np.zeros(())  # distance of a defect's middle from a roller [m]


def line_parameters(scene: Scene, geometry: SphericalRollerGeometry) -> Parameters:
    """Assemble the parameters of the line model; raises `ConfigurationError` for a defect on a roller."""
    if any(d.kind is Fault.ROLLER for d in scene.defects):
        raise ConfigurationError("a defect on a roller: the line model cannot simulate it; use --model full.")
    model = make_parameters(with_points(scene, DENSER * scene.contact.points_per_circle), geometry)
    plain = model.races.plain
    model.races.starts[:, :plain] = np.arange(len(CIRCLES) + 1)
    for race, inner in enumerate((False, True)):
        for i, own in enumerate(race_circle(geometry, p, inner=inner) for p in CIRCLES):
            point = own.radius_m, 0.0, own.height_m, 1.0, own.normal_radial, 0.0, own.normal_axial
            model.races.points[race, :plain, :, i] = point
    radius = roller_diameter_m(scene, geometry) / 2
    both = [patches(geometry, scene.contact, radius, inner=inner) for inner in (False, True)]
    return model._replace(patch=np.array([[_patch_constants(patch) for patch in race] for race in both]))


def _patch_constants(patch: Patch) -> tuple[float, float, float, float]:
    """Constants of the patch for the kernels, with the penetration d and the angular speed W of the module's docstring.

    They are force / d^(3/2), damping / d^(1/2), (slip at ends - slip in middle) / (W d), squared half length / d.
    """
    one = np.ones(1)
    spread = 1 + math.cos(patch.lean_rad) / (patch.curvature_1_m * patch.roller_radius_m)
    return float(patch.force_n(one)[0]), float(patch.damper_ns_m(one)[0]), spread, 2 / patch.curvature_1_m


class DefectOnRace(NamedTuple):
    """Pit or bump of a race, divided into strips along the race, each of the width `strip_m`.

    `half_m`: half of each strip's length along the race; `across_m`: distance of each strip from the middle of the
    contact, across the race; `middle_m`: distances along the race from the roller's to the defect's middle, an array of
    any shape; `reach_m`: largest distance with contact; `race_radius_m`: radius of the race at the defect; `race`: 0
    outer, 1 inner. Under spherical rollers the defect is one strip, on one of the three circles (0 to 2) on which
    rollers touch the race.
    """

    height_m: float
    half_m: FloatArray
    reach_m: float
    race_radius_m: float
    race: int = 0
    circle: int = 0
    across_m: FloatArray = UNDER_ROLLER
    strip_m: float = math.nan
    middle_m: FloatArray = UNDER_ROLLER


@dataclass(frozen=True, kw_only=True)
class Patch:
    """Continuous contact between a roller and one of the three contact circles of a race.

    `stiffness_n_m2`, `damping_ns_m2`: stiffness and damping of a point in the full model, divided by `spacing_m`, the
    distance between these points; `curvature_1_m`: curvature of the gap along the race; `race_radius_m`: radius of the
    circle; `lean_rad`: angle between the contact's normal and the normal in the middle of the roller, along which the
    roller can move; `normal_rad`: angle between the contact's normal and the bearing's radial direction.
    """

    stiffness_n_m2: float
    damping_ns_m2: float
    curvature_1_m: float
    lean_rad: float
    normal_rad: float
    spacing_m: float
    race_radius_m: float
    roller_radius_m: float

    def force_n(self, depth_m: FloatArray) -> FloatArray:
        """Normal force [N] of the contact at the penetrations `depth_m` in its middle, an array of any shape."""
        touched = np.maximum(depth_m, 0.0)
        return self.stiffness_n_m2 * (4 / 3) * math.sqrt(2 / self.curvature_1_m) * touched**1.5

    def damper_ns_m(self, depth_m: FloatArray) -> FloatArray:
        """Damping coefficient [N s/m] of the contact at penetrations `depth_m` in its middle, an array of any shape."""
        return self.damping_ns_m2 * 2 * np.sqrt(2 * np.maximum(depth_m, 0.0) / self.curvature_1_m)

    def place(self, defect: Defect, deepest_m: float) -> DefectOnRace:
        """Place a defect on the circle, for approaches of the rings up to `deepest_m` [m]."""
        half_m = (defect.extent_m or defect.points * self.spacing_m) / 2
        reach_m = math.sqrt(2 * (deepest_m + max(0.0, defect.height_m)) / self.curvature_1_m) + half_m
        return DefectOnRace(defect.height_m, np.array([half_m]), reach_m, self.race_radius_m)

    def added_n(self, depth_m: FloatArray, defect: DefectOnRace) -> FloatArray:
        """Force [N] that a defect adds, negative for a pit; broadcasts `depth_m` and `defect.middle_m`."""
        ends = defect.middle_m - defect.half_m[0], defect.middle_m + defect.half_m[0]
        return self.stiffness_n_m2 * (self._area(depth_m + defect.height_m, *ends) - self._area(depth_m, *ends))

    def _area(self, depth: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
        """Integral of the penetration max(0, depth - curvature x^2 / 2) from x = `start` to `end` [m2]."""
        deep = np.maximum(depth, 0.0)
        reach = np.sqrt(2 * deep / self.curvature_1_m)
        a, b = np.clip(start, -reach, reach), np.clip(end, -reach, reach)
        return deep * (b - a) - self.curvature_1_m / 6 * (b**3 - a**3)


def patches(geometry: SphericalRollerGeometry, contact: Contact, roller_radius_m: float, *, inner: bool) -> list[Patch]:
    """Contacts of a roller with the three contact circles of a race, from the bearing's mid-plane outwards.

    The curvature of the gap is the sum of the roller's and the race's curvatures in the plane through the normal and
    the direction of rolling; the race's is negative on the outer race.
    """
    r_x, found = geometry.raceway_radius_m, []
    for p in CIRCLES:
        lean, circle = (p - 1) * geometry.tilt_rad, race_circle(geometry, p, inner=inner)
        across = roller_radius_m - r_x + r_x * math.cos(lean)
        spacing = 2 * math.pi * circle.radius_m / contact.points_per_circle
        found.append(
            Patch(
                stiffness_n_m2=contact.stiffness_n_m / spacing,
                damping_ns_m2=contact.damping_ns_m / spacing,
                curvature_1_m=math.cos(lean) / across + circle.normal_radial / circle.radius_m,
                lean_rad=lean,
                normal_rad=p * geometry.tilt_rad,
                spacing_m=spacing,
                race_radius_m=circle.radius_m,
                roller_radius_m=across,
            )
        )
    return found
