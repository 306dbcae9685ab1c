"""From the paper's scene to the rig's, one change at a time: what each buys in frequency, level and pattern."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from srbval.report.blocks import Badge, Section
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts, missing, origin_of
from srbval.studies.waterfall.figure import waterfall_plot

TEXTS = Texts.of_study(__package__)
FORMAT = {"%": "+.3f", "dB": "+.1f"}


def section(results: StoredResults) -> Section:
    """Chart and table of every step; only a remark where nothing is stored."""
    result = results.get("waterfall")
    if result is None:
        return TEXTS.section(missing("waterfall"))
    rows: Sequence[Mapping[str, Any]] = result.content["measures"]
    steps, measures = (list(dict.fromkeys(row[key] for row in rows)) for key in ("step", "measure"))
    ends = {measure: [_text(found[0]), _text(found[-1])] for measure in measures
            if (found := [row for row in rows if row["measure"] == measure])}  # fmt: skip
    plot = partial(waterfall_plot, rows=rows)
    units = {row["measure"]: row["unit"] for row in rows}
    table = TEXTS.table("waterfall-table", _lines(rows), measures=measures, units=units)
    return TEXTS.section(
        TEXTS.paragraph("intro", steps=steps),
        TEXTS.figure(
            "waterfall", plot, id="waterfall-chart", badge=Badge.MEASURED, steps=steps, measures=measures, ends=ends
        ),
        appendix=[origin_of(result), table],
    )


def _lines(rows: Sequence[Mapping[str, Any]]) -> Iterator[dict[str, Any]]:
    """One line for each step and record."""
    measures = dict.fromkeys((row["measure"] for row in rows), "")
    for step, record in dict.fromkeys((row["step"], row["record"]) for row in rows):
        own = [row for row in rows if (row["step"], row["record"]) == (step, record)]
        used = own[0]["used_for"]
        cells = measures | {row["measure"]: _text(row) + ", fit" * (row["used_for"] == "fit" != used) for row in own}
        yield {"step": step, "record": record, "used_for": used, "cells": cells}


def _text(row: Mapping[str, Any]) -> str:
    if row["error"] is None:
        return "not shown"
    of = f", {row['shown']} of {row['compared']}" if row["shown"] < row["compared"] else ""
    return f"{row['error']:{FORMAT[row['unit']]}} [{row['uncertainty']:{FORMAT[row['unit']][1:]}}]{of}"


PAGE = Page(
    name="waterfall", place=42, results=("waterfall",), section=section,
    data=lambda results: {
        "waterfall": results.content("waterfall").get("measures", []),
        "bias": results.content("waterfall").get("bias", []),
    },
)  # fmt: skip
