"""The bearing that is simulated: the paper's Figures 1, 5 and 8, the scene along the shaft and the load zone."""

from functools import partial

from srbval.report.badges import Badge
from srbval.report.blocks import FigureGrid
from srbval.report.figures.geometry import axial_section, defect_cloud, whole_bearing
from srbval.report.figures.scene import bearing_scene, load_zone
from srbval.report.findings.findings import Evidence
from srbval.report.model import Section
from srbval.report.section_texts import Texts

TEXTS = Texts("bearing")


def bearing_section(evidence: Evidence) -> Section:
    """What the bearing looks like, where its defect and its load are."""
    scene, views, geometry = evidence.runs["paper-outer"].scene, evidence.views, evidence.bearing.geometry
    assert geometry is not None, "the report's bearing is one the model can run"
    slots, zone = views.slot_angle_rad, views.load_zone
    section = partial(axial_section, geometry=geometry, circles=views.circles)
    whole = partial(
        whole_bearing, geometry=geometry, circles=views.circles, slot_angle_rad=slots,
        defect_rad=scene.load.zone_rad + scene.defect.angle_rad,
    )  # fmt: skip
    cloud = partial(defect_cloud, points=views.defect)
    forces = partial(load_zone, zone=zone)
    along = partial(bearing_scene, scene=scene, geometry=geometry, zone=zone)
    pair = (
        TEXTS.figure("bearing-whole", whole, suffix=".png", rollers=len(slots)),
        TEXTS.figure("bearing-scene", along, badge=Badge.SIMULATED, geometry=geometry),
    )
    defect = TEXTS.figure(
        "defect-cloud", cloud, badge=Badge.SIMULATED, scene=scene, defect=scene.defect, spacing_m=views.spacing_m
    )
    return TEXTS.section(
        appendix=(
            TEXTS.paragraph("intro"),
            TEXTS.figure("bearing-section", section),
            FigureGrid(figures=pair, columns=2),
            defect,
            TEXTS.figure("load-zone", forces, badge=Badge.SIMULATED, scene=scene, zone=zone),
        )
    )
