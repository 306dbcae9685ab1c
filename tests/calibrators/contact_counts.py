"""How many points are in contact: counted from a run's geometry, quasi-statically and independent of the kernels.

From a run's ring displacement, cage angle and cage tilt, each roller is put where the contact forces of its two races
and the centrifugal force balance along its slot; then the points inside it are counted. Friction, damping, defects and
the rollers' own bouncing are left out: counts are good to a few per cent.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import CIRCLES, SphericalRollerGeometry, load_bearing
from srbval.models.full.bodies import roller_body
from srbval.models.full.parameters import roller_diameter_m
from srbval.models.full.point_cloud import Circle, inner_circle, outer_circle, reach_m
from srbval.models.run import Run
from srbval.scene import Scene

SLIDE_LIMIT_M = 2e-4
HALVINGS = 36  # of the slide's interval: far below a micrometre's thousandth
SNAPSHOTS = 12


@dataclass(frozen=True, kw_only=True)
class ContactCounts:
    """Means over a run: points in contact, roller-race pairs in contact, rollers pressed between both races."""

    points: float
    contacts: float
    loaded_rollers: float


def count_contacts(run: Run, snapshots: int = SNAPSHOTS) -> ContactCounts:
    """Count over `snapshots` moments of `run`, evenly spaced."""
    moments = np.linspace(0, len(run.cage_rad_s) - 1, snapshots).round().astype(int)
    depths = [point_depths(run, int(moment)) for moment in moments]
    points = np.array([(d > 0).sum(axis=(2, 3)) for d in depths])  # [snapshots, races, rollers]
    return ContactCounts(
        points=float(points.sum(axis=(1, 2)).mean()),
        contacts=float((points > 0).sum(axis=(1, 2)).mean()),
        loaded_rollers=float((points > 0).all(axis=1).sum(axis=1).mean()),
    )


def point_depths(run: Run, moment: int) -> FloatArray:
    """Depth of every candidate point in its roller at output `moment` [m], shape [2 races, rollers, 3, window].

    Races are outer, inner; circles in the order of `CIRCLES`; negative where the point is not in contact.
    """
    scene, geometry = run.scene, load_bearing(run.scene.bearing).geometry
    assert geometry is not None, "a run exists, so its bearing has a geometry"
    time_s = scene.settle_s + (moment + 1) / scene.output_rate_hz
    turn = (
        scene.settle_s * float(run.cage_rad_s.mean()) + float(run.cage_rad_s[: moment + 1].sum()) / scene.output_rate_hz
    )
    slots = slot_axes(geometry, turn, run.cage_tilt_rad[moment])
    places = [
        _candidates(scene, geometry, slots, outer_circle, 0.0) + run.displacement_m[moment],
        _candidates(scene, geometry, slots, inner_circle, 2 * math.pi * scene.shaft_hz * time_s),
    ]
    local = np.array([np.einsum("rcwi,rki->rcwk", place, slots) for place in places])
    return _settled(scene, geometry, local, float(run.cage_rad_s[moment]))


def slot_axes(geometry: SphericalRollerGeometry, turn_rad: float, tilt_rad: FloatArray) -> FloatArray:
    """Axes of all slots in world coordinates, rows 1 then 2, shape [rollers, 3 axes, 3]: outwards, along the race,
    along the roller.
    """
    angle = turn_rad + np.tile(np.arange(geometry.rollers_per_row) * 2 * math.pi / geometry.rollers_per_row, 2)
    side = np.repeat([1.0, -1.0], geometry.rollers_per_row)
    c, s = math.cos(geometry.tilt_rad), math.sin(geometry.tilt_rad)
    outwards = np.stack([c * np.cos(angle), c * np.sin(angle), side * s], axis=1)
    along = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    axes = np.stack([outwards, along, np.cross(outwards, along)], axis=1)
    (ca, cb), (sa, sb) = np.cos(tilt_rad), np.sin(tilt_rad)
    about_x = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]])
    about_y = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    tilted: FloatArray = axes @ (about_x @ about_y).T
    return tilted


def _candidates(
    scene: Scene, geometry: SphericalRollerGeometry, slots: FloatArray, circle_of: Any, race_angle_rad: float
) -> FloatArray:
    """Points of a race near each roller in world axes, shape [rollers, 3, window, 3]."""
    count = scene.contact.points_per_circle
    circles: list[Circle] = [circle_of(geometry, p) for p in CIRCLES]
    window = _window(geometry, count)
    roller = np.arctan2(slots[:, 0, 1], slots[:, 0, 0])
    nearest = np.round((roller - race_angle_rad) * count / (2 * math.pi))
    angle = race_angle_rad + (nearest[:, None] + np.arange(-window, window + 1)) * 2 * math.pi / count
    side = np.sign(slots[:, 0, 2])[:, None]
    points = [
        np.stack([c.radius_m * np.cos(angle), c.radius_m * np.sin(angle), side * c.height_m + 0 * angle], axis=2)
        for c in circles
    ]
    return np.stack(points, axis=1)


def _window(geometry: SphericalRollerGeometry, count: int) -> int:
    """Number of points on either side of a roller that it can reach, on either race."""
    widest = reach_m(SLIDE_LIMIT_M, geometry.roller_diameter_m / 2, -geometry.raceway_radius_m)
    return math.ceil(widest * count / (2 * math.pi * inner_circle(geometry, CIRCLES[-1]).radius_m))


def _settled(scene: Scene, geometry: SphericalRollerGeometry, local: FloatArray, cage_rad_s: float) -> FloatArray:
    """Depths with every roller at rest in its slot, by bisection; `local` in slot axes about the bearing's centre."""
    radius = roller_diameter_m(scene, geometry) / 2
    mass = roller_body(geometry, 2 * radius, scene.bodies.density_kg_m3).mass_kg
    outwards_n = mass * geometry.pitch_radius_m * math.cos(geometry.tilt_rad) * cage_rad_s**2
    low, high = np.full(local.shape[1], -SLIDE_LIMIT_M), np.full(local.shape[1], SLIDE_LIMIT_M)
    for _ in range(HALVINGS):
        slide = (low + high) / 2
        depth, push = _depth_and_push(geometry, radius, local, slide)
        net = outwards_n + scene.contact.stiffness_n_m * np.sum(np.maximum(depth, 0) * push, axis=(0, 2, 3))
        low, high = np.where(net > 0, slide, low), np.where(net > 0, high, slide)
    return _depth_and_push(geometry, radius, local, (low + high) / 2)[0]


def _depth_and_push(
    geometry: SphericalRollerGeometry, radius: float, local: FloatArray, slide: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Depth in a barrel (an arc of the race's profile swept about the axis), and the force's share along the slot."""
    x = local[..., 0] - (geometry.roller_centre_distance_m + slide)[:, None, None]
    rho = np.hypot(x, local[..., 1])
    s = rho + geometry.raceway_radius_m - radius
    distance = np.hypot(s, local[..., 2])
    return geometry.raceway_radius_m - distance, -s / distance * x / rho
