"""The model hierarchy: error against cost, by question and by amplitude; from the tables that come with the program."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from srbval.models.hierarchy import LEVELS
from srbval.plan.calibrated import shipped_calibration
from srbval.report.blocks import Badge, Listing, Section, Table
from srbval.report.figures.style import BLUE, GREEN, INK, ORANGE, PURPLE, SOFT, VERMILION, Drawn, new_figure, panel
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts
from srbval.studies.calibration_runs import summary

TEXTS = Texts.of_study(__package__)
Row = Mapping[str, Any]


def section(_: StoredResults) -> Section:
    """Figure, levels, tables; of the tables that come with the program."""
    known, of_rig = shipped_calibration("paper"), shipped_calibration("rig")
    rows, rig_rows = summary(known), summary(of_rig)
    levels = TEXTS.each("rung", [level for level in LEVELS if level.name in known.models])
    least = list(_amplitudes(rig_rows))
    return TEXTS.section(
        TEXTS.paragraph("intro", ladder=known, least=least),
        TEXTS.figure("ladder-figure", fidelity_plot(rows=_not_amplitudes(rows)), badge=Badge.SIMULATED),
        appendix=(
            Listing(levels),
            _table(rows, "ladder-table"),
            TEXTS.paragraph("rig", ladder=of_rig),
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


# Shape and colour of each fidelity level, the simplest model first.
LEVEL_MARKS = (("v", ORANGE), ("D", GREEN), ("s", BLUE), ("P", PURPLE), ("o", VERMILION))
LEVELS_INCHES = (7.6, 3.7)
LEVEL_COLUMNS = 3
LEVEL_DATA = (
    "question",
    "model",
    "scenes",
    "unanswered",
    "median_error_pct",
    "worst_error_pct",
    "wall_per_simulated_s",
)
LEAST_PCT = 1e-3  # smaller errors are drawn here, with an arrow down


@panel
def fidelity_plot(rows: Sequence[Mapping[str, Any]]) -> Drawn:
    """Error against cost, one panel a question: the rows of `summary`, the worst error as a bar.

    A model that never answered stands in the strip above the axis, hollow.
    """
    questions = list(dict.fromkeys(row["question"] for row in rows))
    models = list(dict.fromkeys(row["model"] for row in rows))
    figure = new_figure(LEVELS_INCHES)
    grid = figure.subplots(
        math.ceil(len(questions) / LEVEL_COLUMNS), LEVEL_COLUMNS, squeeze=False, sharex=True, sharey=True
    )
    for axes, question in zip(grid.flat, questions, strict=False):
        _level_panel(axes, [row for row in rows if row["question"] == question], models)
    for axes in grid[-1]:
        axes.set_xlabel("Wall time per simulated s, s")
    for line in grid:
        line[0].set_ylabel("Error, %")
    handles, labels = grid.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(models), frameon=False)
    return figure, {name: [math.nan if row[name] is None else row[name] for row in rows] for name in LEVEL_DATA}


def _level_panel(axes: Any, rows: Sequence[Mapping[str, Any]], models: Sequence[str]) -> None:
    from matplotlib.ticker import NullLocator

    axes.set(xscale="log", yscale="log", title=rows[0]["question"].replace("-", " ").capitalize())
    for row in rows:
        marker, colour = LEVEL_MARKS[models.index(row["model"]) % len(LEVEL_MARKS)]
        look = {"marker": marker, "ms": 7, "color": colour, "mec": INK, "mew": 0.6, "ls": "none", "label": row["model"]}
        if row["median_error_pct"] is None:
            axes.plot(row["wall_per_simulated_s"], 1.04, transform=axes.get_xaxis_transform(), clip_on=False,
                      **look | {"mfc": "white", "mec": colour})  # fmt: skip
            continue
        median, worst = (max(row[key], LEAST_PCT) for key in ("median_error_pct", "worst_error_pct"))
        axes.errorbar(row["wall_per_simulated_s"], median, yerr=[[0.0], [worst - median]], capsize=2.5,
                      elinewidth=1.1, ecolor=colour, **look)  # fmt: skip
        if row["median_error_pct"] < LEAST_PCT:
            axes.annotate("", (row["wall_per_simulated_s"], LEAST_PCT), xytext=(0, -13), textcoords="offset points",
                          arrowprops={"arrowstyle": "<|-", "color": colour, "lw": 1.1})  # fmt: skip
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_locator(NullLocator())
    axes.axhline(0.5, color=SOFT, lw=0.8, ls=(0, (4, 3)))
    axes.margins(x=0.12, y=0.12)


PAGE = Page(
    name="model_hierarchy", place=50, results=(), section=section,
    data=lambda _: {"ladder": summary(shipped_calibration("paper")), "rig_ladder": summary(shipped_calibration("rig"))},
)  # fmt: skip
