"""The ladder of models: error against cost, predictions against fresh scenes, and the missing harmonic."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

from srbval.report.badges import Badge
from srbval.report.blocks import Block, Listing
from srbval.report.figures.ladder import ladder_plot
from srbval.report.findings.findings import Evidence
from srbval.report.findings.harmonics import HarmonicPattern, HarmonicPatterns
from srbval.report.findings.stored import ShownLadder
from srbval.report.model import Section
from srbval.report.section_texts import Texts
from srbval.report.table import Table

TEXTS = Texts("ladder")


def ladder_section(evidence: Evidence) -> Section:
    """Figure, table, rungs, held-out scenes, harmonic pattern."""
    ladder = evidence.ladder
    rungs = [item for name, title in ladder.rungs for item in TEXTS.listing("rung", name=name, title=title).items]
    plot = partial(ladder_plot, rows=_plain(ladder))
    least = list(_amplitudes(evidence.rig_ladder))
    return TEXTS.section(
        TEXTS.paragraph("intro", ladder=ladder, least=least),
        TEXTS.figure("ladder-figure", plot, badge=Badge.SIMULATED),
        appendix=(
            Listing(items=tuple(rungs)),
            _table(ladder, "ladder-table"),
            TEXTS.paragraph("rig", ladder=evidence.rig_ladder),
            _table(evidence.rig_ladder, "rig-ladder-table"),
            TEXTS.table("amplitude-ladder-table", least, models=list(least[0]["cells"]), lines=least),
            *_patterns(evidence.patterns),
        ),
    )


def _table(ladder: ShownLadder, name: str) -> Table:
    shown = _plain(ladder)
    rows = [
        {"title": title, "rungs": {row["model"]: row for row in shown if row["title"] == title}}
        for title in dict.fromkeys(row["title"] for row in shown)
    ]
    return TEXTS.table(
        name,
        rows,
        models=list(dict.fromkeys(row["model"] for row in ladder.rows)),
        cost={row["model"]: row["wall_per_simulated_s"] for row in ladder.rows},
        meanings=list({row["title"]: row for row in shown}.values()),
    )


def _plain(ladder: ShownLadder) -> list[Mapping[str, Any]]:
    """The rows of questions that are no amplitudes."""
    return [row for row in ladder.rows if row["margin"] is None]


def _amplitudes(ladder: ShownLadder) -> Iterator[dict[str, Any]]:
    """One line for each amplitude: every rung's error and on how many scenes it is near, and the least rung that is."""
    for question in dict.fromkeys(row["question"] for row in ladder.rows if row["margin"] is not None):
        own = {row["model"]: row for row in ladder.rows if row["question"] == question}
        least = next((model for model, row in own.items() if row["least"]), None)
        yield {**next(iter(own.values())), "cells": {model: _cell(row) for model, row in own.items()}, "least": least}


def _cell(row: Mapping[str, Any]) -> str:
    if row["near"] is None:
        return "cannot"
    error = "none" if row["median_error"] is None else f"{row['median_error']:.2g} [{row['worst_error']:.2g}]"
    return f"{error}; {row['near']}/{row['near_of']}"


def _patterns(patterns: HarmonicPatterns) -> Iterator[Block]:
    """Conclusion, each rung at the paper's bump, one rung over bump heights."""

    def measured(*models: str) -> list[float]:
        rows: list[HarmonicPattern] = [row for row in patterns.by_rung if row.model in models]
        return [row.paper_band for row in rows if row.paper_band is not None]

    yield TEXTS.paragraph(
        "missing-harmonic",
        patterns=patterns,
        sinc=[row.by_sinc for row in patterns.by_rung],
        pulses=measured("impulse", "planar"),
        full=measured("full"),
        harmonics=lambda values: TEXTS.text("harmonics", values=values),
    )
    yield TEXTS.table("pattern-rungs-table", patterns.by_rung, patterns=patterns)
    yield TEXTS.table("pattern-table", patterns.by_height, patterns=patterns)
