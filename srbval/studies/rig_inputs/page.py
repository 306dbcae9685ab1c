"""The rig's own scene against the rig's records: frequencies from its inputs alone, amplitudes behind a fitted path."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from srbval.bearing import Fault
from srbval.comparison.bias import LEAST_RECORDS
from srbval.comparison.budget import VERDICT
from srbval.comparison.compared_quantities import CAGE_RATIO
from srbval.comparison.comparison import Comparison
from srbval.path.amplitudes import THIRD_OCTAVES
from srbval.report.blocks import Block
from srbval.report.findings.findings import Evidence
from srbval.report.findings.stored import ShownResult
from srbval.report.model import Section
from srbval.report.section_texts import Texts
from srbval.report.sections.names import missing, origin_of
from srbval.storage.stored_result import AMPLITUDES, PREDICTIONS, RIG_BANDS, RIG_INPUTS, WATERFALL
from srbval.storage.strict_json import json_object

TEXTS = Texts("rig_scene")
DEPTH = "modulation depth"
BAND = "RMS 1400-2800 Hz"  # in which the level over the hole's place is told
MOST_LISTED = 4  # records side by side in the table of predictions
Row = Mapping[str, Any]


def rig_scene_section(evidence: Evidence) -> Section:
    """Errors against uncertainties of the cage speed, and how many amplitudes are near; the appendix has each row."""
    result, bands, amplitudes, waterfall = (
        evidence.results[kind] for kind in (RIG_INPUTS, RIG_BANDS, AMPLITUDES, WATERFALL)
    )
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
    outcome, listed = _predictions(evidence.results[PREDICTIONS], evidence.predicted)
    return TEXTS.section(
        TEXTS.paragraph("intro"), *frequencies, TEXTS.paragraph("amplitudes"), *levels, *outcome,
        appendix=[*further, *listed],
    )  # fmt: skip


def _predictions(result: ShownResult, rows: Sequence[Comparison]) -> tuple[list[Block], list[Block]]:
    """What was predicted of records before they were compared, and how it came out where they are registered."""
    if not result.content:
        return [missing(result)], []
    said = [
        {"record": f"{Fault(one['state']).label}, {one['nominal_rpm']:g} rpm", **one}
        for one in result.content["predictions"]
    ]
    quantities = [
        {"quantity": name, "of": {one["record"]: _predicted(one, name) for one in said if name in one["values"]}}
        for name in dict.fromkeys(name for one in said for name in one["values"])
    ]
    records = [one["record"] for one in said]
    shown = [row for row in rows if row.both_present]
    octaves = [row for row in shown if row.quantity in THIRD_OCTAVES]
    near = sum(abs(row.error) <= VERDICT.near_db for row in octaves)
    intro = TEXTS.paragraph(
        "predictions", records=records, sha256=result.content["predictions_sha256"], command=result.command,
        made_utc=result.content["made_utc"], rows=rows, octaves=octaves, near=near, limit_db=VERDICT.near_db,
        cages=[row for row in shown if row.quantity == CAGE_RATIO.name],
    )  # fmt: skip
    tables = [TEXTS.table("predicted-rows", map(json_object, rows))] if rows else []
    listed = TEXTS.table("predictions", quantities, records=records[:MOST_LISTED], more=len(records) - MOST_LISTED)
    return [intro], [origin_of(result), listed, *tables]


def _predicted(prediction: Row, name: str) -> tuple[float, float]:
    """The value and the 95 % half width of all its parts together."""
    return prediction["values"][name], math.hypot(*(of.get(name, 0.0) for of in prediction["parts"].values()))


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
