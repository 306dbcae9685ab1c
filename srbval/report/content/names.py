"""Names and badges that all sections share."""

from __future__ import annotations

from srbval.recordings import Origin
from srbval.report.badges import Badge
from srbval.validation.analyse import Analysis

BADGE = {
    Origin.MEASURED: Badge.MEASURED,
    Origin.SIMULATED: Badge.SIMULATED,
    Origin.STAND_IN: Badge.STAND_IN,
}
SIDE_NAME = {
    Origin.MEASURED: "test rig, measured",
    Origin.SIMULATED: "model",
    Origin.STAND_IN: "SYNTHETIC STAND-IN, not a measurement",
}
FETCH_COMMAND = "srbval data fetch torino-excerpts"


def badge_of(analysis: Analysis) -> Badge:
    """Badge of what an analysis was made from."""
    return BADGE[analysis.recording.origin]


def rpm_of(analysis: Analysis) -> float:
    """Shaft speed of an analysis [rpm]."""
    return 60 * analysis.speed.value_hz
