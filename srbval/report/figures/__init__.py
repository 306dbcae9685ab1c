"""Figures of the report: functions from plain arrays to a picture and a CSV file of what it shows."""

from srbval.report.figures.acceleration import acceleration_panel
from srbval.report.figures.cursors import Cursor, fault_cursors
from srbval.report.figures.deviation import Deviation, deviation_plot
from srbval.report.figures.files import PanelFiles
from srbval.report.figures.scalogram import scalogram_panel
from srbval.report.figures.scene import bearing_scene
from srbval.report.figures.spectrum import envelope_spectrum_panel

__all__ = [
    "Cursor",
    "Deviation",
    "PanelFiles",
    "acceleration_panel",
    "bearing_scene",
    "deviation_plot",
    "envelope_spectrum_panel",
    "fault_cursors",
    "scalogram_panel",
]
