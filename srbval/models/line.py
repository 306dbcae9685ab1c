"""The full model with continuous contacts: each circle of a race meets a roller in a patch, not in points.

Same bodies, joints, load and solvers; only the contact differs. With K_c / s held and the points dense (see
`srbval.models.patch`) a circle's normal force at a penetration d is K_c/s (4/3) sqrt(2/kappa) d^(3/2), its damper
2 C_c/s sqrt(2 d/kappa), its elastic energy 2/5 F d. The depth rate is that in the patch's middle: elsewhere along it
rolling adds as much as it takes. Slip is not one over the patch: at xi = x over its half length the penetration is
d (1 - xi^2), and a race that turns by W against a roller of radius rho slips W d (1 + 1/(kappa rho)) xi^2 faster than
in the middle, by some 20 mm/s at the edge; and turning about the tilted normal it slips across, by some 10 mm/s at
either end. Both are far above the critical velocity. So the patch is taken in three parts of equal load, each with its
mean slip, and eq. (19) averaged over the slips in it; a patch held in one piece would stick and bind the rings
tangentially as no row of points does. Left out: the couples by which dampers resist rolling and friction resists
pivoting, with the power both take, and what leans with the normal along a patch.

Near a race's defect a roller meets points again, `DENSER` times as many as the scene says with as much less of K_c and
C_c each: there a raised piece covers only its own length of the patch.

Without points passing by, three of the full model's steps may be taken in one: cage speed to 1e-7, 500-1500 Hz to 1 %.

Answers: all questions, without the excitation by points passing. Cannot answer: point passing itself; defects on
rollers.
"""

import math
from dataclasses import replace

import numpy as np

from srbval.bearing import CIRCLES, Fault, SphericalRollerGeometry
from srbval.errors import ConfigurationError
from srbval.models.full.parameters import Parameters, make_parameters, roller_diameter_m
from srbval.models.full.point_cloud import inner_circle, outer_circle
from srbval.models.patch import Patch, patches
from srbval.scene import Defect, Scene

DENSER = 4  # points for each of the scene's, near a defect


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
                    own.radius_m, 0.0, own.height_m, 1.0, own.normal_radial, 0.0, own.normal_axial,
                )  # fmt: skip
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
