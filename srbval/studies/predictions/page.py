"""What was predicted of rig records before they were compared, and how it came out where they are registered."""

import math
from collections.abc import Mapping
from typing import Any

from srbval.bearing import DEFAULT_BEARING, Fault, load_bearing
from srbval.comparison.bias import biases
from srbval.comparison.budget import VERDICT
from srbval.comparison.compared_quantities import CAGE_RATIO
from srbval.comparison.comparison import Comparison
from srbval.path.amplitudes import THIRD_OCTAVES
from srbval.recordings.registry import listing
from srbval.report.blocks import Section
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts
from srbval.storage.json_files import to_json
from srbval.studies.appendix_page import missing, origin_of
from srbval.studies.predicted_rows import rows_of_predictions

TEXTS = Texts.of_study(__package__)
MOST_LISTED = 4  # records side by side in the table of predictions
Row = Mapping[str, Any]


def compared(results: StoredResults) -> tuple[Comparison, ...]:
    """The stored predictions against the registered recordings that they are of."""
    content = results.content("predictions")
    return rows_of_predictions(content or None, listing(or_none=True).recordings, load_bearing(DEFAULT_BEARING))


def section(results: StoredResults) -> Section:
    """The outcome in a paragraph; every prediction and every compared row in the appendix."""
    result = results.get("predictions")
    if result is None:
        return TEXTS.section(missing("predictions"))
    rows: tuple[Comparison, ...] = results.gathered["predictions"]
    said = [
        {"record": f"{Fault(one['state']).label}, {one['nominal_rpm']:g} rpm", **one}
        for one in result.content["predictions"]
    ]
    quantities = [
        {"quantity": name, "of": {one["record"]: _predicted(one, name) for one in said if name in one["values"]}}
        for name in dict.fromkeys(name for one in said for name in one["values"])
    ]
    records = [one["record"] for one in said]
    on_both = [row for row in rows if row.both_present]
    octaves = [row for row in on_both if row.quantity in THIRD_OCTAVES]
    near = sum(abs(row.error) <= VERDICT.near_db for row in octaves)
    intro = TEXTS.paragraph(
        "predictions", records=records, sha256=result.content["predictions_sha256"],
        command="srbval study run predictions", made_utc=result.content["made_utc"], rows=rows, octaves=octaves,
        near=near, cages=[row for row in on_both if row.quantity == CAGE_RATIO.name],
    )  # fmt: skip
    tables = [TEXTS.table("predicted-rows", map(to_json, rows))] if rows else []
    listed = TEXTS.table("predictions", quantities, records=records[:MOST_LISTED], more=len(records) - MOST_LISTED)
    return TEXTS.section(intro, appendix=(origin_of(result), listed, *tables))


def _predicted(prediction: Row, name: str) -> tuple[float, float]:
    """The value and the 95 % half width of all its parts together."""
    return prediction["values"][name], math.hypot(*(of.get(name, 0.0) for of in prediction["parts"].values()))


def data(results: StoredResults) -> Row:
    """What ``report.json`` holds of it."""
    content, rows = results.content("predictions"), results.gathered["predictions"]
    predicted = {key: content.get(key) for key in ("predictions_sha256", "predictions")}
    return {"predictions": predicted, "comparisons": list(rows), "bias": list(biases(rows))}


PAGE = Page(name="predictions", place=44.3, results=("predictions",), section=section, data=data, gather=compared)
