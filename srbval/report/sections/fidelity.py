"""The model hierarchy: error against cost, by question and by amplitude."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from srbval.models.hierarchy import LEVELS
from srbval.report.blocks import Badge, Listing, Section, Table
from srbval.report.figures.comparison import fidelity_plot
from srbval.report.findings.findings import Findings
from srbval.report.section_texts import Texts

TEXTS = Texts("fidelity")
Row = Mapping[str, Any]


def fidelity_section(findings: Findings) -> Section:
    """Figure, levels, tables."""
    known, rows, rig_rows = findings.ladders["paper"], findings.data["ladder"], findings.data["rig_ladder"]
    levels = TEXTS.each("rung", [level for level in LEVELS if level.name in known.models])
    least = list(_amplitudes(rig_rows))
    return TEXTS.section(
        TEXTS.paragraph("intro", ladder=known, least=least),
        TEXTS.figure("ladder-figure", fidelity_plot(rows=_not_amplitudes(rows)), badge=Badge.SIMULATED),
        appendix=(
            Listing(levels),
            _table(rows, "ladder-table"),
            TEXTS.paragraph("rig", ladder=findings.ladders["rig"]),
            _table(rig_rows, "rig-ladder-table"),
            TEXTS.table("amplitude-ladder-table", least, models=list(least[0]["cells"]), lines=least),
        ),
    )


def _table(given: Sequence[Row], name: str) -> Table:
    shown = _not_amplitudes(given)
    rows = [
        {"title": title, "rungs": {row["model"]: row for row in shown if row["title"] == title}}
        for title in dict.fromkeys(row["title"] for row in shown)
    ]
    return TEXTS.table(
        name,
        rows,
        models=list(dict.fromkeys(row["model"] for row in given)),
        cost={row["model"]: row["wall_per_simulated_s"] for row in given},
        meanings=list({row["title"]: row for row in shown}.values()),
    )


def _not_amplitudes(rows: Sequence[Row]) -> list[Row]:
    """The rows of questions that are no amplitudes."""
    return [row for row in rows if row["margin"] is None]


def _amplitudes(rows: Sequence[Row]) -> Iterator[dict[str, Any]]:
    """One line for each amplitude: every model's error and on how many scenes it is near, and the cheapest that is."""
    for question in dict.fromkeys(row["question"] for row in rows if row["margin"] is not None):
        own = {row["model"]: row for row in rows if row["question"] == question}
        least = next((model for model, row in own.items() if row["least"]), None)
        yield {**next(iter(own.values())), "cells": {model: _cell(row) for model, row in own.items()}, "least": least}


def _cell(row: Row) -> str:
    if row["near"] is None:
        return "cannot"
    error = "none" if row["median_error"] is None else f"{row['median_error']:.2g} [{row['worst_error']:.2g}]"
    return f"{error}; {row['near']}/{row['near_of']}"
