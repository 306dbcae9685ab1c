"""Amplitudes of the rig's own scene behind a fitted path against the rig's records, from the stored study."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from srbval.comparison.bias import LEAST_RECORDS
from srbval.report.blocks import Section
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts
from srbval.studies.appendix_page import missing, origin_of

TEXTS = Texts.of_study(__package__)
DEPTH = "modulation depth"
BAND = "RMS 1400-2800 Hz"  # in which the effect of the hole's place on the level is stated
Row = Mapping[str, Any]


def section(results: StoredResults) -> Section:
    """How many amplitudes are near and why the others are not; each row, share and bias in the appendix."""
    result = results.get("amplitudes")
    if result is None:
        return TEXTS.section(TEXTS.paragraph("amplitudes"), missing("amplitudes"))
    content = result.content
    shares = content["shares"]
    over = sorted((row for row in content["over_angle"] if row["band"] == BAND), key=lambda row: float(row["level_db"]))
    fitted = [row for row in shares if row["kind"] == DEPTH and row["used_for"] == "fit"]
    depth = {row["predictor"]: row["mean_error"] for row in fitted}
    bias = [*content["bias"], *results.content("waterfall").get("bias", [])]
    withheld = [row for row in content["comparisons"] if row["used_for"] == "withheld" and row["rig_present"]]
    return TEXTS.section(
        TEXTS.paragraph("amplitudes"),
        TEXTS.table("amplitudes-near", list(_by_kind(shares))),
        TEXTS.paragraph("why", least=over[0], most=over[-1], depth=depth),
        appendix=(
            origin_of(result),
            TEXTS.table("amplitude-shares", shares),
            TEXTS.table("amplitude-bias", bias, least_records=LEAST_RECORDS),
            TEXTS.table("amplitude-rows", withheld),
        ),
    )


def _by_kind(shares: Sequence[Row]) -> Iterator[dict[str, Any]]:
    """One row per record and kind, with what each predictor makes of it."""
    for record, kind in dict.fromkeys((row["record"], row["kind"]) for row in shares):
        of = {row["predictor"]: row for row in shares if (row["record"], row["kind"]) == (record, kind)}
        yield {**of["path"], "by": of}


def data(results: StoredResults) -> Row:
    """What ``report.json`` holds of it."""
    content = results.content("amplitudes")
    return {"amplitudes": content.get("shares", [])} | {key: content.get(key, []) for key in ("comparisons", "bias")}


PAGE = Page(name="amplitudes", place=44.2, results=("amplitudes", "waterfall"), section=section, data=data)
