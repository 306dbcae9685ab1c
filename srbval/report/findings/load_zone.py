"""How the simulated bearing carries its load: the force of every roller, what the housing takes, the points passed."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Fault, SphericalRollerGeometry
from srbval.comparison.counterpart import SimulationCase
from srbval.models.full.parameters import make_parameters
from srbval.models.full.point_cloud import wrapped
from srbval.models.run import Run
from srbval.scene import Scene

# The forces of every roller are kept in a short run of their own: some passages of the load zone are enough.
LOAD_ZONE_ID, LOAD_ZONE_SECONDS, LOAD_SNAPSHOTS_HZ = "load-zone", 0.5, 160.0
LOADED_DEG = 30.0  # either side of the middle of the load zone, and of the place opposite


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


def load_zone(run: Run, geometry: SphericalRollerGeometry) -> LoadZone:
    """That of the run of a `load_zone_case`."""
    slots, scene = make_parameters(run.scene, geometry).slot_angle, run.scene
    time = scene.settle_s + np.arange(len(run.load_n)) / scene.detail_rate_hz
    cage = run.cage_ratio * 2 * math.pi * scene.shaft_hz * time
    angle = np.degrees(wrapped(slots + cage[:, None] - scene.load.zone_rad))
    outer, inner = (run.load_n[:, race].sum(axis=2) for race in (0, 1))
    near, far = abs(angle) < LOADED_DEG, abs(angle) > 180 - LOADED_DEG
    return LoadZone(
        angle_deg=angle.ravel(), outer_n=outer.ravel(), inner_n=inner.ravel(), moments=len(run.load_n),
        seconds=run.seconds, within_deg=LOADED_DEG, near_n=float(outer[near].mean()), far_n=float(outer[far].mean()),
        roller_load_share=run.roller_load_share,
    )  # fmt: skip


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
