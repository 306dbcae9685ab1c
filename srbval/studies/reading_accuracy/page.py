"""How well frequencies are read: the stored Monte Carlo study of the reading."""

from collections.abc import Mapping
from typing import Any

from srbval.report.blocks import Section
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts, missing, origin_of

TEXTS = Texts.of_study(__package__)
# A line this far above the noise is strong: what is asked of an error is asked from here on.
STRONG_DB = 16.0
LEAST_LINES = 20  # detected in a cell, for its coverage to say something
READING_KEYS = ("accuracy", "false_alarms", "timings", "chains", "transforms")
COVERAGE = (0.92, 0.98)  # of a 95 % interval, as counted in so many records


def section(results: StoredResults) -> Section:
    """Error against the Cramer-Rao bound, coverage of the stated intervals, false alarms, the chain."""
    result = results.get("reading_accuracy")
    if result is None:
        return TEXTS.section(appendix=(missing("reading_accuracy"),))
    rows, chains = result.content["accuracy"], result.content.get("chains")
    steady = [row for row in rows if row["jitter"] == 0]
    weak = [row for row in steady if row["weakest_db"] < STRONG_DB]
    coverage = [row["coverage"] for row in rows if row["trials"] * row["detected"] >= LEAST_LINES]
    intro = TEXTS.paragraph(
        "intro",
        strong=[row["rmse_over_bound"] for row in steady if row["weakest_db"] >= STRONG_DB],
        strong_db=STRONG_DB,
        weak=max(weak, key=lambda row: row["rmse_over_bound"], default=None),
        coverage=coverage,
        least_lines=LEAST_LINES,
        trials=min(row["trials"] for row in rows),
        covered=sum(COVERAGE[0] <= share <= COVERAGE[1] for share in coverage),
    )
    accuracy = TEXTS.table("reading-accuracy", rows)
    alarms = TEXTS.table("reading-false-alarms", result.content["false_alarms"])
    of_chains = (TEXTS.table("reading-chains", chains),) if chains else ()
    return TEXTS.section(appendix=(origin_of(result), intro, accuracy, alarms, *of_chains))


def data(results: StoredResults) -> Mapping[str, Any]:
    """What ``report.json`` holds of it."""
    return {"reading": {key: results.content("reading_accuracy").get(key, []) for key in READING_KEYS}}


PAGE = Page(name="reading_accuracy", place=105, results=("reading_accuracy",), section=section, data=data)
