"""What is simulated, in pictures: the bearing's section, its point clouds, the defect, and which rollers carry."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import CIRCLES, Fault, SphericalRollerGeometry
from srbval.evidence.gather import Evidence
from srbval.models.full.parameters import make_parameters
from srbval.models.full.point_cloud import circle_points, outer_circle, wrapped
from srbval.models.run import Run
from srbval.models.simulate import simulate
from srbval.report.badges import Badge
from srbval.report.blocks import Block, Figure, FigureGrid, Paragraph
from srbval.report.figures.geometry import axial_section, defect_cloud, whole_bearing
from srbval.report.figures.load_zone import load_zone
from srbval.report.model import Section
from srbval.scene import Defect, Scene

# The forces of every roller are kept in a short run of their own: some passages of the load zone are enough.
LOAD_SECONDS, LOAD_SNAPSHOTS_HZ = 0.5, 160.0
LOADED_DEG = 30.0  # either side of the middle of the load zone, and of the place opposite


def bearing_section(evidence: Evidence, scene_picture: Figure, folder: Path) -> Section:
    """The paper's Figures 1, 5 and 8, the scene along the shaft and the load zone."""
    geometry = evidence.bearing.geometry
    assert geometry is not None, "the report's bearing is one the model can run"
    scene = evidence.runs["paper-outer"].scene
    slots = make_parameters(scene, geometry).slot_angle
    blocks: tuple[Block, ...] = (
        Paragraph(
            "A double-row spherical roller bearing: barrel rollers in two tilted rows between an outer raceway that is "
            "part of a sphere and the two raceways of the inner ring. In the model each raceway is a set of points on "
            "three circles a row, each point a spring and a damper against the roller that touches it; a **defect** is "
            "a few points moved off the raceway. Every time a roller meets it, a short blow runs through the bearing. "
            "On the outer race that happens at **BPFO** (ball pass frequency, outer), on the inner race at **BPFI**; "
            "both are multiples of the shaft's speed that only the geometry sets, as long as all rolls."
        ),
        _section(geometry, folder),
        FigureGrid(figures=(_whole(geometry, slots, scene, folder), scene_picture), columns=2),
        _defect(geometry, scene, folder),
        _load_zone(scene, slots, folder),
    )
    return Section(id="bearing", title="The bearing that is simulated", blocks=blocks)


def _section(geometry: SphericalRollerGeometry, folder: Path) -> Figure:
    files = axial_section(folder, "bearing-section", geometry=geometry)
    return Figure(
        id="bearing-section", label="Section along the shaft", file=files.picture, data=files.data,
        caption="As the paper's Figure 1, drawn from its Table 1: upper half of the bearing, both rows. The roller is "
        "the one that just touches both raceways (radial play 0).",
        alt="Section of the bearing along the shaft: two tilted barrel rollers between the spherical outer raceway and "
        "the inner ring, three contact points marked on either raceway of each row.",
    )  # fmt: skip


def _whole(geometry: SphericalRollerGeometry, slots: NDArray[np.float64], scene: Scene, folder: Path) -> Figure:
    angle = scene.load.zone_rad + scene.defect.angle_rad
    files = whole_bearing(folder, "bearing-whole", geometry=geometry, slot_angle_rad=slots, defect_rad=angle)
    return Figure(
        id="bearing-whole", label="The whole bearing", file=files.picture, data=files.data,
        caption=f"As the paper's Figure 8: all {len(slots)} rollers at the start of a run and the circles of points of "
        "both raceways (grey outer, orange inner; fewer points than there are). The star is the outer-race defect.",
        alt="The bearing in three dimensions: two rows of barrel rollers, three circles of points on either raceway of "
        "each row, a star at the top where the outer race's defect stands.",
    )  # fmt: skip


def _defect(geometry: SphericalRollerGeometry, scene: Scene, folder: Path) -> Figure:
    count, zone, defect = scene.contact.points_per_circle, scene.load.zone_rad, scene.defect
    radii = {p: outer_circle(geometry, p).radius_m for p in CIRCLES}
    nowhere: tuple[Defect, ...] = ()
    points = {p: circle_points(count, r, (defect,) if p == 1.0 else nowhere, zone) for p, r in radii.items()}
    middle = zone + defect.angle_rad
    files = defect_cloud(folder, "defect-cloud", points=points, radii_m=radii, zone_rad=middle)
    spacing = 2e3 * math.pi * radii[1.0] / count
    return Figure(
        id="defect-cloud", label="The defect among its points", file=files.picture, data=files.data,
        badge=Badge.SIMULATED,
        caption=f"As the paper's Figure 5: outer raceway of row 1 about its defect, {count} points a circle, "
        f"{spacing:.2f} mm apart on the middle one. {defect.points} points of the middle circle are raised by "
        f"{defect.height_m * 1e3:g} mm. The rig's defects are drilled pits of 2 mm across and 0.5 mm deep.",
        alt=f"Left the points of three circles seen flat, {defect.points} of the middle circle marked as raised; right "
        f"the middle circle from the side with those points {defect.height_m * 1e3:g} mm above the others.",
    )  # fmt: skip


def _load_zone(scene: Scene, slots: NDArray[np.float64], folder: Path) -> Figure:
    run = simulate(_watched(scene))
    angle = _angles(run, slots)
    outer, inner = (run.load_n[:, race].sum(axis=2) for race in (0, 1))
    files = load_zone(folder, "load-zone", angle_deg=angle.ravel(), outer_n=outer.ravel(), inner_n=inner.ravel())
    near, far = (float(outer[place].mean()) for place in (abs(angle) < LOADED_DEG, abs(angle) > 180 - LOADED_DEG))
    return Figure(
        id="load-zone", label="The load zone", file=files.picture, data=files.data, badge=Badge.SIMULATED,
        caption=f"Normal force of every roller on either race, healthy bearing, {60 * scene.shaft_hz:g} rpm, "
        f"{scene.load.radial_n / 1e3:g} kN, {len(run.load_n)} moments in {run.seconds:g} s. Within {LOADED_DEG:g} "
        f"degrees of the middle a roller carries {near / 1e3:.2f} kN in the mean, opposite {far / 1e3:.2f} kN: with no "
        "play and no interference unloaded rollers rattle between the races. All rollers together carry "
        f"{100 * run.roller_load_share:.1f} % of the load, the housing's spring the rest (see what the paper leaves "
        "open).",
        alt=f"Contact force over the roller's angle: {near / 1e3:.2f} kN in the mean about the load zone's middle, "
        f"{far / 1e3:.2f} kN opposite, single values scattered widely.",
    )  # fmt: skip


def _watched(scene: Scene) -> Scene:
    every = max(1, round(scene.output_rate_hz / LOAD_SNAPSHOTS_HZ))
    healthy = replace(scene.defect, kind=Fault.HEALTHY)
    return replace(scene, defect=healthy, duration_s=LOAD_SECONDS, detail_rate_hz=scene.output_rate_hz / every)


def _angles(run: Run, slots: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angle of every roller from the middle of the load zone at every moment kept, [k, 2 M], degrees."""
    scene = run.scene
    time = scene.settle_s + np.arange(len(run.load_n)) / scene.detail_rate_hz
    cage = run.cage_ratio * 2 * math.pi * scene.shaft_hz * time
    return np.degrees(wrapped(slots + cage[:, None] - scene.load.zone_rad))
