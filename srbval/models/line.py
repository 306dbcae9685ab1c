"""The full model with continuous contacts: each circle of a race meets a roller in a patch, not in points.

Same bodies, joints, load and solvers; only the contact differs: force and damper of a patch are on the page "Contact"
of the theory, "Continuous contact"; its elastic energy is 2/5 F d. A contact of about three points, the paper's,
follows them within some per cent. A defect raises a piece of the race: within the piece d + h takes the place of d.

The depth rate is that in the patch's middle: elsewhere along it rolling adds as much as it takes. At xi = x over the
half length the penetration is d (1 - xi^2), and a race that turns by W against a roller of radius rho slips
W d (1 + 1/(kappa rho)) xi^2 faster than in the middle, and across if it turns about the tilted normal, both far above
the critical velocity. So the patch is taken in three parts of equal load, each with its mean slip, and eq. (19) is
averaged over the slips in it. Left out: the couples by which dampers resist rolling and friction resists pivoting, with
the power both take, and the lean of the normal along a patch.

Near a race's defect a roller meets points again, `DENSER` times as many as the scene says with as much less of K_c and
C_c each: there a raised piece covers only its own length of the patch.

Without points passing by, three of the full model's steps may be taken in one: cage speed to 1e-7, 500-1500 Hz to 1 %.

Answers: all questions, without the excitation by points passing. Cannot answer: point passing itself; defects on
rollers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import CIRCLES, Fault, SphericalRollerGeometry
from srbval.errors import ConfigurationError
from srbval.models.full.parameters import Parameters, make_parameters, roller_diameter_m
from srbval.models.full.point_cloud import cross_section, inner_circle, outer_circle
from srbval.scene import Contact, Defect, DefectShape, Scene

DENSER = 4  # points for each of the scene's, near a defect
PARTS = 24  # pieces of one height in a defect that is not flat


def line_parameters(scene: Scene, geometry: SphericalRollerGeometry) -> Parameters:
    """Assemble the kernel parameters; `ConfigurationError` for a defect on a roller."""
    if any(d.kind is Fault.ROLLER for d in scene.defects):
        raise ConfigurationError("a defect on a roller: the line model has none; use --model full.")
    model = make_parameters(_denser(scene), geometry)
    for race, circle in enumerate((outer_circle, inner_circle)):
        for window in range(model.races.plain):
            model.races.starts[race, window] = np.arange(len(CIRCLES) + 1)
            for i, p in enumerate(CIRCLES):
                own = circle(geometry, p)
                model.races.points[race, window, :, i] = (
                    own.radius_m,
                    0.0,
                    own.height_m,
                    1.0,
                    own.normal_radial,
                    0.0,
                    own.normal_axial,
                )
    radius = roller_diameter_m(scene, geometry) / 2
    both = [patches(geometry, scene.contact, radius, inner=inner) for inner in (False, True)]
    return model._replace(patch=np.array([[_row(patch) for patch in race] for race in both]))


def _denser(scene: Scene) -> Scene:
    own, defect, further = scene.contact, _as_long(scene.defect), tuple(map(_as_long, scene.further_defects))
    stiffness, damping = own.stiffness_n_m / DENSER, own.damping_ns_m / DENSER
    count = DENSER * own.points_per_circle
    contact = replace(own, points_per_circle=count, stiffness_n_m=stiffness, damping_ns_m=damping)
    return replace(scene, contact=contact, defect=defect, further_defects=further)


def _as_long(defect: Defect) -> Defect:
    """A defect of neighbouring points covers as much of the race with denser ones."""
    return defect if defect.extent_m is not None else replace(defect, points=DENSER * defect.points)


def _row(patch: Patch) -> tuple[float, float, float, float]:
    """A circle's patch as the kernel reads it, see `columns`."""
    one = np.ones(1)
    spread = 1 + math.cos(patch.lean_rad) / (patch.curvature_1_m * patch.roller_radius_m)
    return float(patch.force_n(one)[0]), float(patch.damper_ns_m(one)[0]), spread, 2 / patch.curvature_1_m


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
        """Force added by a raised piece whose middle is `middle_m` along the race from the roller; shapes broadcast."""
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
        return deep * (b - a) - self.curvature_1_m / 6 * (b**3 - a**3)


class Piece(NamedTuple):
    """A raised piece in parts of length `part_m`: their `offset_m` from its middle and `height_m`, both [parts]."""

    offset_m: FloatArray
    height_m: FloatArray
    part_m: float


def patches(geometry: SphericalRollerGeometry, contact: Contact, roller_radius_m: float, *, inner: bool) -> list[Patch]:
    """The three circles of a race, from the mid-plane outwards.

    Roller: normal curvature of the barrel across its axis, cos(lean) / radius there. Race: normal curvature along the
    circle, cos(normal) / radius, negative on the outer.
    """
    r_x, found = geometry.raceway_radius_m, []
    for p in CIRCLES:
        lean, circle = (p - 1) * geometry.tilt_rad, (inner_circle if inner else outer_circle)(geometry, p)
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


def piece(defect: Defect, spacing_m: float) -> Piece:
    """A defect as a raised piece: its extent, or as many spacings as it has points."""
    length = defect.extent_m if defect.extent_m is not None else defect.points * spacing_m
    parts = PARTS if defect.extent_m is not None and defect.shape is DefectShape.COSINE else 1
    share = (np.arange(parts) + 0.5) / parts - 0.5
    height = np.ones(1) if parts == 1 else cross_section(share, defect.shape)
    return Piece(offset_m=share * length, height_m=defect.height_m * height, part_m=length / parts)
