"""The rig's own scene against the rig's records: frequencies from its inputs alone, amplitudes behind a fitted path."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from srbval.evidence.stored import ShownResult
from srbval.report.blocks import Block
from srbval.report.content.names import missing, origin_of
from srbval.report.model import Section
from srbval.report.section_texts import Texts
from srbval.validation.bias import LEAST_RECORDS

TEXTS = Texts("rig_scene")
DEPTH = "modulation depth"
BAND = "RMS 1400-2800 Hz"  # in which the level over the hole's place is told
Row = Mapping[str, Any]


def rig_scene_section(
    result: ShownResult, bands: ShownResult, amplitudes: ShownResult, waterfall: ShownResult
) -> Section:
    """Errors against uncertainties of the cage speed, and how many amplitudes are near; the appendix has each row.

    `bands` tells in which band both sides are read; of the `waterfall` only the paper's scene's biases are shown.
    """
    frequencies: list[Block] = [missing(result)]
    further: list[Block] = []
    if result.content:
        studies = result.content["studies"]
        frequencies = [TEXTS.table("rig-scene-table", studies)]
        inputs = TEXTS.table("rig-inputs-table", studies[0]["effects"], study=studies[0])
        further = [origin_of(result), inputs, *_bands(bands, studies)]
    levels: list[Block] = [missing(amplitudes)]
    if amplitudes.content:
        shares = amplitudes.content["shares"]
        over = [row for row in amplitudes.content["over_angle"] if row["band"] == BAND]
        over.sort(key=lambda row: float(row["level_db"]))
        fitted = [row for row in shares if row["kind"] == DEPTH and row["used_for"] == "fit"]
        depth = {row["predictor"]: row["mean_error"] for row in fitted}
        why = TEXTS.paragraph("why", least=over[0], most=over[-1], depth=depth)
        levels = [TEXTS.table("amplitudes-near", list(_by_kind(shares))), why]
        paper = waterfall.content["bias"] if waterfall.content else []
        further += [origin_of(amplitudes), *_amplitudes(amplitudes.content, paper)]
    return TEXTS.section(
        TEXTS.paragraph("intro"), *frequencies, TEXTS.paragraph("amplitudes"), *levels, appendix=further
    )


def _by_kind(shares: Sequence[Row]) -> Iterator[dict[str, Any]]:
    """One row per record and kind, with what each predictor makes of it."""
    for record, kind in dict.fromkeys((row["record"], row["kind"]) for row in shares):
        of = {row["predictor"]: row for row in shares if (row["record"], row["kind"]) == (record, kind)}
        yield {**of["path"], "by": of}


def _amplitudes(content: Row, paper: Sequence[Row]) -> Iterator[Block]:
    """Every predictor's errors, biases with the `paper` scene's, and every quantity that a withheld record shows."""
    withheld = [row for row in content["comparisons"] if row["used_for"] == "withheld" and row["rig_present"]]
    yield TEXTS.table("amplitude-shares", content["shares"])
    yield TEXTS.table("amplitude-bias", [*content["bias"], *paper], least_records=LEAST_RECORDS)
    yield TEXTS.table("amplitude-rows", withheld)


def _bands(result: ShownResult, studies: Sequence[Mapping[str, Any]]) -> Iterator[Block]:
    """Model and rig in both of the paper's bands, and what is not as on the rig."""
    if not result.content:
        yield missing(result)
        return
    content = result.content
    yield TEXTS.paragraph("bands", served=content["served"], band_hz=content["band_hz"])
    yield origin_of(result)
    yield TEXTS.table("rig-bands-table", content["rows"])
    slow = [study for study in studies if study["uncertainty_pct"] is None]
    yield TEXTS.paragraph("open", drive_w=content["drive_w"], slow=slow)
