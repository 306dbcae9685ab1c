"""Names, badges and remarks that several sections share."""

from collections.abc import Mapping

from srbval.bearing import Fault
from srbval.reading.analyse import Analysis
from srbval.recordings import Origin
from srbval.report.blocks import Badge, Callout, Paragraph, Tone
from srbval.report.section_texts import Texts
from srbval.storage.stored_result import StoredResult

STORED = Texts("stored")
SIDE_NAME = {
    Origin.MEASURED: "rig",
    Origin.SIMULATED: "model",
    Origin.STAND_IN: "SYNTHETIC STAND-IN, not a measurement",
}
FETCH_COMMAND = "srbval data fetch torino-excerpts"
VERDICT_TONE = {
    "resolved": "warning",
    "agrees": "good",
    "undecided": "neutral",
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


def origin_of(result: StoredResult) -> Paragraph:
    """Machine, date, revision and command of a stored result, and whether it is stale."""
    return STORED.paragraph("origin", origin=result.origin, stale=result.stale)


def missing(name: str) -> Callout:
    """What stands in place of a result that is not there."""
    return STORED.callout("missing", tone=Tone.WARNING, command=f"srbval study run {name}")
