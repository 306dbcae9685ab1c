"""The bearing seen along the shaft, so that a newcomer sees what is simulated; and Table 6 as a picture."""

from __future__ import annotations

import math
from pathlib import Path

from srbval.evidence.gather import Evidence
from srbval.report.badges import Badge
from srbval.report.blocks import Figure
from srbval.report.figures import Deviation, bearing_scene, deviation_plot
from srbval.validation.comparison import deviation_pct
from srbval.validation.table6 import RigSource, Table6Row

SENSOR_RAD = math.pi / 4


def scene_figure(evidence: Evidence, folder: Path) -> Figure:
    """Rollers, load, outer-race defect and sensor of the paper's outer-race scene."""
    scene = evidence.runs["paper-outer"].scene
    geometry = evidence.bearing.geometry
    assert geometry is not None, "the report's bearing is one the model can run"
    load, defect = scene.load, scene.defect
    files = bearing_scene(
        folder, "bearing-scene",
        pitch_radius_m=geometry.pitch_radius_m, roller_diameter_m=geometry.roller_diameter_m,
        rollers=geometry.rollers_per_row, outer_diameter_m=geometry.outer_diameter_m,
        load_text=f"{load.radial_n / 1e3:g} kN", load_angle_rad=load.direction_rad,
        defect=defect.kind.scene_word, defect_angle_rad=load.zone_rad + defect.angle_rad,
        sensor_angle_rad=SENSOR_RAD, first_roller_rad=0.0, title="One row, seen along the shaft",
    )  # fmt: skip
    return Figure(
        id="bearing-scene", label="The scene", file=files.picture, data=files.data, badge=Badge.SIMULATED, wide=False,
        caption=f"One of two rows of {geometry.rollers_per_row} rollers. The load pushes the outer ring "
        "against the rollers "
        "on the opposite side, the load zone; the outer-race defect stands in its middle, the sensor's direction at "
        "45 degrees.",
        alt="Cross-section of the bearing with its rollers, the load on the outer ring, the outer-race "
        "defect in the load zone and the sensor at 45 degrees.",
    )  # fmt: skip


def table6_figure(evidence: Evidence, folder: Path) -> Figure:
    """Deviations from kinematics of every source in Table 6."""
    points = [point for row in evidence.rows for point in _points(row)]
    files = deviation_plot(folder, "table6-deviations", points=points)
    return Figure(
        id="table6-deviations", label="Table 6 as a picture", file=files.picture, data=files.data, badge=None,
        caption="Deviation of each race line from its kinematic frequency. Bars are 95 % intervals where "
        "they are known; the paper states none.",
        alt="Deviations from the kinematic frequency in per cent for the paper's model and rig, our "
        "model, and the measured recordings, by defect.",
    )  # fmt: skip


def _points(row: Table6Row) -> list[Deviation]:
    group = f"{row.comparison.fault.code} at {row.shaft_rpm:.0f} rpm"
    ours = Deviation(group=group, source="our model", kind="simulated", deviation_pct=row.model_deviation_pct,
                     ci95_pct=100 * (row.comparison.model.ci95 or 0.0) / row.line.kinematic_hz or None)  # fmt: skip
    rig_ci95_hz = row.comparison.rig.ci95
    if row.rig_source is RigSource.MEASURED and rig_ci95_hz is not None:
        rig = Deviation(group=group, source="rig, measured", kind="measured", deviation_pct=row.rig_deviation_pct,
                        ci95_pct=100 * rig_ci95_hz / row.line.kinematic_hz)  # fmt: skip
        return [ours, rig]
    found = [
        ours,
        Deviation(group=group, source="paper's rig", kind="published", deviation_pct=row.rig_deviation_pct),
    ]
    if row.printed is not None:
        pct = deviation_pct(row.printed.model_hz, row.line.kinematic_hz)
        found.append(Deviation(group=group, source="paper's model", kind="published", deviation_pct=pct))
    return found
