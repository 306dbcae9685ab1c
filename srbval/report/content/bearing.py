"""The bearing that is simulated: the paper's Figures 1, 5 and 8, the scene along the shaft and the load zone."""

import math
from pathlib import Path

from srbval.evidence.evidence import Evidence
from srbval.report.badges import Badge
from srbval.report.blocks import Figure, FigureGrid
from srbval.report.figures.geometry import axial_section, defect_cloud, whole_bearing
from srbval.report.figures.load_zone import load_zone
from srbval.report.figures.scene import bearing_scene
from srbval.report.model import Section
from srbval.report.section_texts import Texts

TEXTS = Texts("bearing")
SENSOR_RAD = math.pi / 4


def bearing_section(evidence: Evidence, folder: Path) -> Section:
    """What the bearing looks like, where its defect and its load are."""
    scene, views, geometry = evidence.runs["paper-outer"].scene, evidence.views, evidence.bearing.geometry
    assert geometry is not None, "the report's bearing is one the model can run"
    slots, zone = views.slot_angle_rad, views.load_zone
    section = axial_section(folder, "bearing-section", geometry=geometry, circles=views.circles)
    whole = whole_bearing(
        folder, "bearing-whole", geometry=geometry, circles=views.circles, slot_angle_rad=slots,
        defect_rad=scene.load.zone_rad + scene.defect.angle_rad,
    )  # fmt: skip
    cloud = defect_cloud(folder, "defect-cloud", points=views.defect)
    forces = load_zone(
        folder, "load-zone", angle_deg=zone.angle_deg, outer_n=zone.outer_n, inner_n=zone.inner_n
    )  # fmt: skip
    pair = TEXTS.figure("bearing-whole", whole, rollers=len(slots)), _scene_figure(evidence, folder)
    return TEXTS.section(
        TEXTS.paragraph("intro"),
        TEXTS.figure("bearing-section", section),
        FigureGrid(figures=pair, columns=2),
        TEXTS.figure(
            "defect-cloud", cloud, badge=Badge.SIMULATED, scene=scene, defect=scene.defect, spacing_m=views.spacing_m
        ),
        TEXTS.figure("load-zone", forces, badge=Badge.SIMULATED, scene=scene, zone=zone),
    )


def _scene_figure(evidence: Evidence, folder: Path) -> Figure:
    """Rollers, load, outer-race defect and sensor of the paper's outer-race scene."""
    scene, geometry = evidence.runs["paper-outer"].scene, evidence.bearing.geometry
    assert geometry is not None, "the report's bearing is one the model can run"
    load, defect = scene.load, scene.defect
    files = bearing_scene(
        folder, "bearing-scene",
        pitch_radius_m=geometry.pitch_radius_m, roller_diameter_m=geometry.roller_diameter_m,
        rollers=geometry.rollers_per_row, outer_diameter_m=geometry.outer_diameter_m,
        load_text=f"{load.radial_n / 1e3:g} kN", load_angle_rad=load.direction_rad,
        defect=defect.kind.value, defect_angle_rad=load.zone_rad + defect.angle_rad,
        sensor_angle_rad=SENSOR_RAD, first_roller_rad=0.0, title="One row, seen along the shaft",
    )  # fmt: skip
    return TEXTS.figure("bearing-scene", files, badge=Badge.SIMULATED, geometry=geometry)
