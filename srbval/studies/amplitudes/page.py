"""Amplitudes of the rig's own scene behind a fitted path against the rig's records, from the stored study.

In the appendix also the outcome of the predictions that were stored before three records were compared:
``prediction_outcome``, computed once by the revision that it names (`StoredResult.stale` says why it is never computed
again).
"""

from collections.abc import Mapping, Sequence
from typing import Any

from srbval.comparison.bias import LEAST_RECORDS
from srbval.comparison.compared_quantities import CAGE_RATIO
from srbval.report.blocks import Block, Section
from srbval.report.pages import Page, StoredResults, missing, origin_of
from srbval.report.section_texts import Texts

TEXTS = Texts.of_study(__package__)
DEPTH = "modulation depth"
TABLED = ("locked level", "total level")  # kinds of rows that the counts stand for
UNEXPLAINED = "IR_353rpm_sample"  # far below what the model and the same race's other record imply
Row = Mapping[str, Any]


def section(results: StoredResults) -> Section:
    """The counts with what each part is worth, and every locked band; level and pattern, bias, rows in the appendix."""
    result, predicted = results.get("amplitudes"), _outcome(results)
    if result is None:
        return TEXTS.section(TEXTS.paragraph("amplitudes"), missing("amplitudes"), appendix=predicted)
    content = result.content
    withheld = [
        row for row in content["comparisons"]
        if row["used_for"] == "withheld" and row["rig_present"] and row["kind"] not in TABLED
    ]  # fmt: skip
    return TEXTS.section(
        TEXTS.paragraph("amplitudes"),
        TEXTS.paragraph("counts", counts=content["counts"]),
        TEXTS.table("worth", content["worth"]),
        TEXTS.paragraph(
            "causes",
            counts=content["counts"],
            unexplained=[row for row in content["bands"] if row["record"] == UNEXPLAINED and not row["censored"]],
        ),
        TEXTS.table("locked", content["bands"], mounting=content["mounting"]),
        appendix=(
            *predicted,
            origin_of(result),
            TEXTS.table("level-and-pattern", content["level_and_pattern"]),
            TEXTS.paragraph("mounting", mounting=content["mounting"], crps=content["crps_db"]),
            TEXTS.table("amplitude-bias", content["bias"], least_records=LEAST_RECORDS),
            TEXTS.table("amplitude-rows", withheld),
        ),
    )


def _outcome(results: StoredResults) -> Sequence[Block]:
    """What became of the stored predictions, failures first, and every row of it; nothing without that result."""
    content = results.content("prediction_outcome")
    if not content:
        return ()
    present = [row for row in content["comparisons"] if row["rig_present"]]
    said = TEXTS.paragraph(
        "outcome", outcome=content, depths=[row for row in present if row["kind"] == DEPTH],
        cages=[row for row in present if row["quantity"] == CAGE_RATIO.name],
    )  # fmt: skip
    return said, TEXTS.table("outcome-rows", content["comparisons"], outcome=content)


def data(results: StoredResults) -> Row:
    """What ``report.json`` holds of it."""
    content, outcome = results.content("amplitudes"), results.content("prediction_outcome")
    return {
        "amplitudes": content.get("counts"),
        "bias": content.get("bias", []),
        "comparisons": [*content.get("comparisons", []), *outcome.get("comparisons", [])],
        "prediction_outcome": {key: value for key, value in outcome.items() if key != "comparisons"},
    }


RESULTS = ("amplitudes", "prediction_outcome")
PAGE = Page(name="amplitudes", place=44.2, results=RESULTS, section=section, data=data)
