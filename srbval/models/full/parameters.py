"""All numbers the kernels need, in one flat tuple of floats and arrays."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import SphericalRollerGeometry
from srbval.bearing.geometry import CIRCLES
from srbval.errors import ConfigurationError
from srbval.models.full.bodies import outer_ring_mass_kg, roller_body
from srbval.models.full.point_cloud import (
    candidate_windows,
    displacement,
    inner_circle,
    outer_circle,
    window_half_count,
)
from srbval.scene import DefectKind, LoadPath, RollerFit, Scene

FloatArray = NDArray[np.float64]


class Race(NamedTuple):
    """Point cloud of one raceway as the contact kernel reads it.

    `windows` shape [W, 3, lanes] [m], `window_of` shape [2, points] and `highest` shape [W] [m]: see
    `candidate_windows`; `cosine` and `sine` are those of the points' angles, shape [points].
    """

    windows: FloatArray
    window_of: NDArray[np.int64]
    highest: FloatArray
    cosine: FloatArray
    sine: FloatArray


class Parameters(NamedTuple):
    """The full model in SI: geometry, bodies, contact, housing, load, drive, point clouds."""

    # geometry
    centre_distance: float  # roller centre from the bearing centre [m]
    tilt_cosine: float
    tilt_sine: float
    profile_radius: float  # of the roller's profile arc [m]
    roller_radius: float  # at the roller's middle [m]
    inner_centre_radial: float  # circle of centres of the inner profile [m]
    inner_centre_axial: float
    # rollers, arrays of shape [2 M]
    roller_angle: FloatArray  # slot angle in the cage [rad]
    roller_cosine: FloatArray
    roller_sine: FloatArray
    roller_row: FloatArray  # +1 for row 1 (z > 0), -1 for row 2
    # bodies
    roller_mass: float
    roller_axial: float
    roller_transverse: float
    cage_axial: float
    cage_transverse: float
    ring_mass: float
    # contact
    stiffness: float
    damping: float
    smoothing: float
    static_friction: float
    dynamic_friction: float
    critical_velocity: float
    # housing, load, drive
    housing_stiffness: float
    housing_damping: float
    force: FloatArray  # external force on the outer ring, shape [3] [N]
    shaft_speed: float  # [rad/s]
    # raceways
    inner: Race
    outer: Race


def make_parameters(scene: Scene, geometry: SphericalRollerGeometry) -> Parameters:
    """Assemble the kernel parameters of a scene (values: the paper's Tables 1 and 4).

    The cage is taken as a thin ring at the pitch radius; its mass is the scene's assumption.
    """
    diameter = roller_diameter_m(scene, geometry)
    body = roller_body(geometry, diameter, scene.bodies.density_kg_m3)
    angle = np.tile(np.arange(geometry.rollers_per_row) * 2 * math.pi / geometry.rollers_per_row, 2)
    cage_axial = scene.bodies.cage_mass_kg * geometry.pitch_radius_m**2
    sprung = scene.load.path is LoadPath.HOUSING
    direction = scene.load.direction_rad
    radial = scene.load.radial_n
    return Parameters(
        centre_distance=geometry.roller_centre_distance_m,
        tilt_cosine=math.cos(geometry.tilt_rad),
        tilt_sine=math.sin(geometry.tilt_rad),
        profile_radius=geometry.raceway_radius_m,
        roller_radius=diameter / 2,
        inner_centre_radial=geometry.inner_centre_radial_m,
        inner_centre_axial=geometry.inner_centre_axial_m,
        roller_angle=angle,
        roller_cosine=np.cos(angle),
        roller_sine=np.sin(angle),
        roller_row=np.repeat([1.0, -1.0], geometry.rollers_per_row),
        roller_mass=body.mass_kg,
        roller_axial=body.axial_kg_m2,
        roller_transverse=body.transverse_kg_m2,
        cage_axial=cage_axial,
        cage_transverse=cage_axial / 2,
        ring_mass=outer_ring_mass_kg(geometry, scene.bodies.density_kg_m3) + scene.housing.mass_kg,
        stiffness=scene.contact.stiffness_n_m,
        damping=scene.contact.damping_ns_m,
        smoothing=scene.contact.smoothing_width_m,
        static_friction=scene.contact.static_friction,
        dynamic_friction=scene.contact.dynamic_friction,
        critical_velocity=scene.contact.critical_velocity_m_s,
        housing_stiffness=scene.housing.stiffness_n_m if sprung else 0.0,
        housing_damping=scene.housing.damping_ns_m,
        force=np.array([radial * math.cos(direction), radial * math.sin(direction), scene.load.axial_n]),
        shaft_speed=scene.shaft_speed_rad_s,
        inner=_race(scene, geometry, DefectKind.INNER, diameter / 2),
        outer=_race(scene, geometry, DefectKind.OUTER, diameter / 2),
    )


def roller_diameter_m(scene: Scene, geometry: SphericalRollerGeometry) -> float:
    """Roller diameter of the scene: raceway gap less the radial play, or Table 1's printed value [m]."""
    if scene.contact.roller_fit is RollerFit.PRINTED:
        return geometry.roller_diameter_m
    diameter = geometry.touching_diameter_m - scene.contact.radial_play_m
    if not 0.9 < diameter / geometry.touching_diameter_m < 1.01:
        raise ConfigurationError(
            f"radial_play_m = {scene.contact.radial_play_m} leaves a roller of {diameter:.6g} m in a gap of "
            f"{geometry.touching_diameter_m:.6g} m; it must be 90 % to 101 % of the gap."
        )
    return diameter


def _race(scene: Scene, geometry: SphericalRollerGeometry, kind: DefectKind, roller_radius: float) -> Race:
    inner = kind is DefectKind.INNER
    circles = [(inner_circle if inner else outer_circle)(geometry, p) for p in CIRCLES]
    n = scene.contact.points_per_circle
    moved = displacement(n, scene.defect if scene.defect.kind is kind else None, scene.load.zone_rad)
    highest = max(0.0, float(moved.max()))
    sign = 1 if inner else -1
    half = window_half_count(
        roller_radius, sign * circles[1].radius_m, points_per_circle=n, highest_m=highest
    )  # fmt: skip
    windows, window_of, heights = candidate_windows(circles, moved, half)
    angle = np.arange(n) * 2 * math.pi / n
    return Race(
        windows=windows, window_of=window_of, highest=heights, cosine=np.cos(angle), sine=np.sin(angle)
    )  # fmt: skip
