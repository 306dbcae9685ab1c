"""From the paper's scene to the rig's, one change at a time: what each buys in frequency, level and pattern."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from srbval.report.blocks import Badge, Section
from srbval.report.figures.style import BLUE, GREEN, INK, VERMILION, Drawn, new_figure, panel
from srbval.report.pages import Page, StoredResults, missing, origin_of
from srbval.report.section_texts import Texts

TEXTS = Texts.of_study(__package__)
RECORD_MARKS = (("o", BLUE), ("s", VERMILION))  # of OR and IR records
MARGIN = {"%": 0.1, "dB": 3.0}  # of the cage ratio and of levels: within which a model agrees
PANELS_ACROSS, WATERFALL_INCHES = 3, (7.6, 5.6)
APART = 0.16  # of a row, between the records
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
    units = {row["measure"]: row["unit"] for row in rows}
    table = TEXTS.table("waterfall-table", _lines(rows), measures=measures, units=units)
    return TEXTS.section(
        TEXTS.paragraph("intro", steps=steps),
        TEXTS.figure(
            "waterfall",
            waterfall_plot(rows),
            id="waterfall-chart",
            badge=Badge.MEASURED,
            steps=steps,
            measures=measures,
            ends=ends,
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


@panel
def waterfall_plot(rows: Sequence[Mapping[str, Any]]) -> Drawn:
    """Error and uncertainty over the steps, top to bottom."""
    steps, measures = (list(dict.fromkeys(row[key] for row in rows)) for key in ("step", "measure"))
    figure = new_figure(WATERFALL_INCHES)
    grid = figure.subplots(math.ceil(len(measures) / PANELS_ACROSS), PANELS_ACROSS, squeeze=False, sharey=True)
    for axes, measure in zip(grid.flat, measures, strict=False):
        _waterfall_panel(axes, [row for row in rows if row["measure"] == measure], steps)
        axes.set_title(measure)
    for axes in grid[:, 0]:
        axes.set_yticks(range(len(steps)), labels=steps)
    grid[0, 0].set_ylim(len(steps) - 0.5, -0.5)
    texts = {key: [row[key] for row in rows] for key in ("step", "record", "used_for", "measure", "unit")}
    numbers = {key: [math.nan if row[key] is None else row[key] for row in rows] for key in ("error", "uncertainty")}
    return figure, texts | numbers


def _waterfall_panel(axes: Any, rows: Sequence[Mapping[str, Any]], steps: Sequence[str]) -> None:
    unit = rows[0]["unit"]
    axes.axvspan(-MARGIN[unit], MARGIN[unit], color=GREEN, alpha=0.16, lw=0, zorder=0)
    axes.axvline(0, color=INK, lw=0.9)
    for place, record in enumerate(dict.fromkeys(row["record"] for row in rows)):
        marker, colour = RECORD_MARKS["IR" in record]
        for row in (row for row in rows if row["record"] == record and row["error"] is not None):
            at = steps.index(row["step"]) + APART * (2 * place - 1)
            face = "white" if row["used_for"] == "fit" else colour
            axes.errorbar(
                row["error"], at, xerr=row["uncertainty"], marker=marker, ms=4.5, mec=colour, mfc=face, ecolor=colour,
                elinewidth=1.0, capsize=2.0, zorder=5,
            )  # fmt: skip
    axes.set_xlabel(f"Error, {unit}")


PAGE = Page(
    name="waterfall", place=42, results=("waterfall",), section=section,
    data=lambda results: {
        "waterfall": results.content("waterfall").get("measures", []),
        "bias": results.content("waterfall").get("bias", []),
    },
)  # fmt: skip
