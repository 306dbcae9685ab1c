"""The simulated bearing as the figures show it: slots, circles of points, the defect among them, the load zone."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import CIRCLES, Fault, SphericalRollerGeometry
from srbval.comparison.counterpart import SimulationCase
from srbval.models.full.parameters import make_parameters
from srbval.models.full.point_cloud import Circle, circle_points, inner_circle, outer_circle, wrapped
from srbval.models.run import Run
from srbval.scene import Defect, Scene

# The forces of every roller are kept in a short run of their own: some passages of the load zone are enough.
LOAD_ZONE_ID, LOAD_ZONE_SECONDS, LOAD_SNAPSHOTS_HZ = "load-zone", 0.5, 160.0
LOADED_DEG = 30.0  # either side of the middle of the load zone, and of the place opposite
DEFECT_CIRCLE = 1.0  # the middle one of row 1


@dataclass(frozen=True, kw_only=True, eq=False)
class LoadZone:
    """Contact force of every roller on either race at every moment kept, [n] each; a healthy bearing.

    `angle_deg` counts from the middle of the load zone. `near_n` and `far_n` are the mean forces on the outer race
    within `within_deg` of the middle and of the place opposite.
    """

    JSON_OMITTED: ClassVar = ("angle_deg", "outer_n", "inner_n")  # they lie in the figure's data file

    angle_deg: FloatArray
    outer_n: FloatArray
    inner_n: FloatArray
    moments: int
    seconds: float
    within_deg: float
    near_n: float
    far_n: float
    roller_load_share: float


@dataclass(frozen=True, kw_only=True, eq=False)
class BearingViews:
    """`spacing_m`: of points on the defect's circle.

    `circles` are those of contact points of row 1, by raceway (``outer``, ``inner``) and number p. `defect` holds, for
    every circle of the outer raceway, its points about the defect: along the race and raised by [m], [n] each.
    """

    circles: Mapping[tuple[str, float], Circle]
    defect: Mapping[float, tuple[FloatArray, FloatArray]]
    spacing_m: float
    load_zone: LoadZone


def load_zone_case(scene: Scene) -> SimulationCase:
    """A short run of the healthy bearing in `scene` that keeps the contact loads."""
    every = max(1, round(scene.output_rate_hz / LOAD_SNAPSHOTS_HZ))
    return SimulationCase(
        id=LOAD_ZONE_ID,
        purpose="the load zone, every roller's force",
        state=Fault.HEALTHY,
        scene=replace(
            scene, defect=replace(scene.defect, kind=Fault.HEALTHY), duration_s=LOAD_ZONE_SECONDS,
            detail_rate_hz=scene.output_rate_hz / every,
        ),
    )  # fmt: skip


def bearing_views(scene: Scene, geometry: SphericalRollerGeometry, load_zone_run: Run) -> BearingViews:
    """The views of `scene`, an outer-race defect, and of the run of its `load_zone_case`."""
    slots = make_parameters(scene, geometry).slot_angle
    outer = {p: outer_circle(geometry, p) for p in CIRCLES}
    return BearingViews(
        circles={("outer", p): circle for p, circle in outer.items()}
        | {("inner", p): inner_circle(geometry, p) for p in CIRCLES},
        defect={p: _defect_points(scene, p, circle.radius_m) for p, circle in outer.items()},
        spacing_m=2 * math.pi * outer[DEFECT_CIRCLE].radius_m / scene.contact.points_per_circle,
        load_zone=_load_zone(load_zone_run, slots),
    )


def _defect_points(scene: Scene, circle: float, radius_m: float) -> tuple[FloatArray, FloatArray]:
    defects: tuple[Defect, ...] = (scene.defect,) if circle == DEFECT_CIRCLE else ()
    points = circle_points(scene.contact.points_per_circle, radius_m, defects, scene.load.zone_rad)
    along = wrapped(points.angle - (scene.load.zone_rad + scene.defect.angle_rad)) * radius_m
    order = np.argsort(along)
    return along[order], points.lift[order]


def _load_zone(run: Run, slots: FloatArray) -> LoadZone:
    scene = run.scene
    time = scene.settle_s + np.arange(len(run.load_n)) / scene.detail_rate_hz
    cage = run.cage_ratio * 2 * math.pi * scene.shaft_hz * time
    angle = np.degrees(wrapped(slots + cage[:, None] - scene.load.zone_rad))
    outer, inner = (run.load_n[:, race].sum(axis=2) for race in (0, 1))
    return LoadZone(
        angle_deg=angle.ravel(),
        outer_n=outer.ravel(),
        inner_n=inner.ravel(),
        moments=len(run.load_n),
        seconds=run.seconds,
        within_deg=LOADED_DEG,
        near_n=float(outer[abs(angle) < LOADED_DEG].mean()),
        far_n=float(outer[abs(angle) > 180 - LOADED_DEG].mean()),
        roller_load_share=run.roller_load_share,
    )


def load_sharing(run: Run) -> dict[str, float]:
    """What carries the radial load in a run [N]: the housing's spring and the rollers."""
    radial_n, share = run.scene.load.radial_n, run.roller_load_share
    spring_n = math.hypot(*(run.displacement_m.mean(axis=0))) * run.scene.housing.stiffness_n_m
    return {"radial_n": radial_n, "spring_n": spring_n, "roller_n": share * radial_n, "roller_load_share": share}


def point_passing(run: Run) -> dict[str, float]:
    """Frequencies at which rollers pass the points of the raceways in a run, numerical [Hz]."""
    points, shaft_hz = run.scene.contact.points_per_circle, run.scene.shaft_hz
    return {
        "points_per_circle": points,
        "shaft_rpm": 60 * shaft_hz,
        "outer_hz": points * run.cage_ratio * shaft_hz,
        "inner_hz": points * (1 - run.cage_ratio) * shaft_hz,
    }
