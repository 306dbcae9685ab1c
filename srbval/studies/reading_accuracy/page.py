"""How well frequencies are read: the stored Monte Carlo study of the reading."""

from collections.abc import Iterator, Mapping
from typing import Any

from srbval.report.blocks import Block
from srbval.report.pages import appendix_page
from srbval.report.section_texts import Texts

# A line this far above the noise is strong: what is asked of an error is asked from here on.
STRONG_DB = 16.0
LEAST_LINES = 20  # detected in a cell, for its coverage to say something
READING_KEYS = ("accuracy", "false_alarms", "chains", "transforms")
COVERAGE = (0.92, 0.98)  # of a 95 % interval, as counted in so many records


def blocks(texts: Texts, content: Mapping[str, Any]) -> Iterator[Block]:
    """Error against the Cramer-Rao bound, coverage of the stated intervals, false alarms, the chain."""
    rows = content["accuracy"]
    steady = [row for row in rows if row["jitter"] == 0]
    weak = [row for row in steady if row["weakest_db"] < STRONG_DB]
    coverage = [row["coverage"] for row in rows if row["trials"] * row["detected"] >= LEAST_LINES]
    yield texts.paragraph(
        "intro",
        strong=[row["rmse_over_bound"] for row in steady if row["weakest_db"] >= STRONG_DB],
        strong_db=STRONG_DB,
        weak=max(weak, key=lambda row: row["rmse_over_bound"], default=None),
        coverage=coverage,
        least_lines=LEAST_LINES,
        trials=min(row["trials"] for row in rows),
        covered=sum(COVERAGE[0] <= share <= COVERAGE[1] for share in coverage),
    )
    yield texts.table("reading-by-length", content.get("by_length", []))
    yield texts.table("reading-accuracy", rows)
    yield texts.table("reading-false-alarms", content["false_alarms"])
    if content.get("chains"):
        yield texts.table("reading-chains", content["chains"])


PAGE = appendix_page(
    __package__, 105, blocks, data=lambda content: {"reading": {key: content.get(key, []) for key in READING_KEYS}}
)
