"""The line rung's parameters: those of the full model, points exchanged for patches."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import CIRCLES, Fault, SphericalRollerGeometry
from srbval.errors import ConfigurationError
from srbval.models.full.parameters import Parameters, make_parameters, roller_diameter_m
from srbval.models.full.point_cloud import inner_circle, outer_circle
from srbval.models.patch import Patch, patches
from srbval.scene import Defect, Scene

FloatArray = NDArray[np.float64]

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
    contact = replace(
        scene.contact,
        points_per_circle=DENSER * scene.contact.points_per_circle,
        stiffness_n_m=scene.contact.stiffness_n_m / DENSER,
        damping_ns_m=scene.contact.damping_ns_m / DENSER,
    )
    return replace(
        scene,
        contact=contact,
        defect=_as_long(scene.defect),
        further_defects=tuple(_as_long(d) for d in scene.further_defects),
    )


def _as_long(defect: Defect) -> Defect:
    """A defect of neighbouring points covers as much of the race with denser ones."""
    return defect if defect.extent_m is not None else replace(defect, points=DENSER * defect.points)


def _row(patch: Patch) -> tuple[float, float, float, float]:
    """What the kernel needs of a circle: force over d^(3/2), damper over d^(1/2), spread of the slip over W d, and the
    square of the patch's half length over d.
    """
    one = np.ones(1)
    spread = 1 + math.cos(patch.lean_rad) / (patch.curvature_1_m * patch.roller_radius_m)
    return float(patch.force_n(one)[0]), float(patch.damper_ns_m(one)[0]), spread, 2 / patch.curvature_1_m
