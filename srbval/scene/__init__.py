"""Scenes: all inputs of a simulation, from speed, loads and defects to model and solver."""

from srbval.scene.oil import Oil
from srbval.scene.parts import Contact, Defect, DefectShape, LoadPath, RollerFit, SpeedProfile, Traction
from srbval.scene.read import (
    UncertainInput,
    changes_at,
    draw_rig_changes,
    load_scene,
    merge,
    paper_scene,
    rig_inputs,
    scene_table,
    sobol,
)
from srbval.scene.scene import Scene, with_points
from srbval.scene.sensor_path import BANDS_HZ, SENSOR_ANGLE_RAD, SENSOR_AXIS, SensorPath, parts_along_sensor
from srbval.scene.surface import Surface
