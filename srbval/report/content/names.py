"""Names and badges that all sections share."""

from collections.abc import Mapping

from srbval.bearing import Fault
from srbval.recordings import Origin
from srbval.report.badges import Badge
from srbval.validation.analyse import Analysis

SIDE_NAME = {
    Origin.MEASURED: "test rig, measured",
    Origin.SIMULATED: "model",
    Origin.STAND_IN: "SYNTHETIC STAND-IN, not a measurement",
}
FETCH_COMMAND = "srbval data fetch torino-excerpts"
VERDICT_TONE = {
    "resolved": "warning",
    "not resolved from uncertainty": "good",
    "insufficient data": "neutral",
}


def badge_of(analysis: Analysis) -> Badge:
    """Badge of what an analysis was made from."""
    return Badge(analysis.recording.origin.value)


def side_of(analysis: Analysis) -> str:
    """Which side of a comparison an analysis is, in words."""
    return SIDE_NAME[analysis.recording.origin]


def synthetic_states(side: Mapping[Fault, Analysis]) -> list[str]:
    """The states of a side that are stand-ins, in words."""
    return [state.label for state, analysis in side.items() if analysis.recording.origin is Origin.STAND_IN]
