"""Continuous contact of a roller and a race: the point cloud's law in the limit of dense points.

A circle of points at spacing s, each a spring K_c, meets a roller that would penetrate it by d at the nearest place.
A point at distance x along the race is met by d - kappa x^2 / 2, kappa the curvature of the gap (roller's plus race's,
the concave outer race counting negative). With s going to zero and K_c / s held, the sum over the points becomes

    F(d) = K_c / s * integral of max(0, d - kappa x^2 / 2) dx = K_c / s * (4/3) * sqrt(2 / kappa) * d^(3/2),

a 3/2-power law; the touched length is 2 sqrt(2 d / kappa), so that many points over s are damped by C_c each. A
contact of about three points, the paper's, follows it within some per cent, as its roller rolls from point to point.

A defect raises a piece of the race. Within the piece d + h takes the place of d, beside it nothing changes; so it
covers only its own length of the patch, and a roller touches a high one before and after it touches the race.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import CIRCLES, SphericalRollerGeometry
from srbval.models.full.point_cloud import cross_section
from srbval.scene import Contact, Defect, DefectShape

PARTS = 24  # of a defect that is not flat, each of one height


@dataclass(frozen=True, kw_only=True)
class Patch:
    """One circle of a race against a roller.

    `stiffness_n_m2`: K_c / s; `damping_ns_m2`: C_c / s; `curvature_1_m`: of the gap along the race; `lean_rad`: from
    the roller's slot to the circle's normal; `normal_rad`: from the bearing's radial direction to it.
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
        """Normal force at a penetration `depth_m`, any shape."""
        touched = np.maximum(depth_m, 0.0)
        return self.stiffness_n_m2 * (4 / 3) * math.sqrt(2 / self.curvature_1_m) * touched**1.5

    def damper_ns_m(self, depth_m: FloatArray) -> FloatArray:
        """Sum of the touching points' C_c at a penetration `depth_m`, any shape."""
        return self.damping_ns_m2 * 2 * np.sqrt(2 * np.maximum(depth_m, 0.0) / self.curvature_1_m)

    def raised_force_n(self, depth_m: FloatArray, middle_m: FloatArray, defect: Piece) -> FloatArray:
        """What a raised piece whose middle is `middle_m` along the race from the roller adds to the force.

        Both arrays broadcast together.
        """
        added = np.zeros(np.broadcast_shapes(depth_m.shape, middle_m.shape))
        for offset, height in zip(defect.offset_m, defect.height_m, strict=True):
            start, end = middle_m + offset - defect.part_m / 2, middle_m + offset + defect.part_m / 2
            added += self._area(depth_m + height, start, end) - self._area(depth_m, start, end)
        return self.stiffness_n_m2 * added

    def _area(self, depth: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
        """Integral of max(0, depth - kappa x^2 / 2) from `start` to `end` [m2]."""
        deep = np.maximum(depth, 0.0)
        reach = np.sqrt(2 * deep / self.curvature_1_m)
        a, b = np.clip(start, -reach, reach), np.clip(end, -reach, reach)
        area: FloatArray = deep * (b - a) - self.curvature_1_m / 6 * (b**3 - a**3)
        return area


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """A raised piece in parts of length `part_m`: their `offset_m` from its middle and `height_m`, both [parts]."""

    offset_m: FloatArray
    height_m: FloatArray
    part_m: float

    @property
    def length_m(self) -> float:
        """Along the race."""
        return self.part_m * len(self.offset_m)


def patches(geometry: SphericalRollerGeometry, contact: Contact, roller_radius_m: float, *, inner: bool) -> list[Patch]:
    """The three circles of a race, from the mid-plane outwards.

    Roller: normal curvature of the barrel across its axis, cos(lean) / radius there. Race: normal curvature along the
    circle, cos(normal) / radius, negative on the outer.
    """
    r_x, found = geometry.raceway_radius_m, []
    for p in CIRCLES:
        normal, lean = p * geometry.tilt_rad, (p - 1) * geometry.tilt_rad
        across = roller_radius_m - r_x + r_x * math.cos(lean)
        radius = (geometry.inner_centre_radial_m if inner else 0.0) + (-r_x if inner else r_x) * math.cos(normal)
        race = math.cos(normal) / radius
        spacing = 2 * math.pi * radius / contact.points_per_circle
        found.append(
            Patch(
                stiffness_n_m2=contact.stiffness_n_m / spacing,
                damping_ns_m2=contact.damping_ns_m / spacing,
                curvature_1_m=math.cos(lean) / across + (race if inner else -race),
                lean_rad=lean,
                normal_rad=normal,
                spacing_m=spacing,
                race_radius_m=radius,
                roller_radius_m=across,
            )
        )
    return found


def piece(defect: Defect, spacing_m: float) -> Piece:
    """A defect as a raised piece: its extent, or as many spacings as it has points."""
    length = defect.extent_m if defect.extent_m is not None else defect.points * spacing_m
    parts = PARTS if defect.extent_m is not None and defect.shape is DefectShape.COSINE else 1
    share = (np.arange(parts) + 0.5) / parts - 0.5
    height = np.ones(1) if parts == 1 else cross_section(share, defect.shape)
    return Piece(offset_m=share * length, height_m=defect.height_m * height, part_m=length / parts)
