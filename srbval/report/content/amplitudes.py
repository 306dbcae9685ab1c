"""Amplitudes in m/s2 of the rig's scene behind its path to the sensor, against the rig's records."""

from srbval.evidence.stored import ShownResult
from srbval.report.content.names import missing, origin_of
from srbval.report.model import Section
from srbval.report.section_texts import Texts
from srbval.validation.bias import LEAST_RECORDS

TEXTS = Texts("amplitudes")
BAND = "RMS 1400-2800 Hz"


def amplitudes_section(result: ShownResult, waterfall: ShownResult) -> Section:
    """How many quantities of each kind are near, fit and withheld records apart, and every withheld one.

    Of the `waterfall` only the bias of the paper's scene.
    """
    if not result.content:
        return TEXTS.section(TEXTS.paragraph("intro"), missing(result))
    content = result.content
    withheld = [row for row in content["comparisons"] if row["used_for"] == "withheld" and row["rig_present"]]
    over = sorted((row for row in content["over_angle"] if row["band"] == BAND), key=lambda row: row["level_db"])
    paper = waterfall.content["bias"] if waterfall.content else []
    return TEXTS.section(
        TEXTS.paragraph("intro"),
        TEXTS.paragraph("why", least=over[0], most=over[-1]),
        origin_of(result),
        TEXTS.table("amplitude-shares", content["shares"]),
        TEXTS.table("amplitude-bias", [*content["bias"], *paper], least_records=LEAST_RECORDS),
        TEXTS.table("amplitude-rows", withheld),
    )
