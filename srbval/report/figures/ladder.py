"""The ladder as a picture: error against cost, one panel a question, one mark a rung."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from numpy.typing import ArrayLike

from srbval.report.figures.style import BLUE, GREEN, INK, ORANGE, PURPLE, SOFT, VERMILION, new_figure, panel

# Shape and colour of each rung, from the bottom of the ladder up.
MARKS = (("v", ORANGE), ("D", GREEN), ("s", BLUE), ("P", PURPLE), ("o", VERMILION))
SIZE_INCHES = (7.6, 3.7)
COLUMNS = 3
DATA = ("question", "model", "scenes", "unanswered", "median_error_pct", "worst_error_pct", "wall_per_simulated_s")
LEAST_PCT = 1e-3  # smaller errors are drawn here, with an arrow down


@panel()
def ladder_plot(rows: Sequence[Mapping[str, Any]]) -> tuple[Any, Mapping[str, ArrayLike]]:
    """The rows of `plan.table.summary`: median error and, as a bar, the worst.

    A rung that never answered stands in the strip above the axis, hollow.
    """
    questions = list(dict.fromkeys(row["question"] for row in rows))
    models = list(dict.fromkeys(row["model"] for row in rows))
    figure = new_figure(SIZE_INCHES)
    grid = figure.subplots(math.ceil(len(questions) / COLUMNS), COLUMNS, squeeze=False, sharex=True, sharey=True)
    for axes, question in zip(grid.flat, questions, strict=False):
        _panel(axes, [row for row in rows if row["question"] == question], models)
    for axes in grid[-1]:
        axes.set_xlabel("Wall time per simulated s, s")
    for line in grid:
        line[0].set_ylabel("Error, %")
    handles, labels = grid.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(models), frameon=False)
    return figure, {name: [math.nan if row[name] is None else row[name] for row in rows] for name in DATA}


def _panel(axes: Any, rows: Sequence[Mapping[str, Any]], models: Sequence[str]) -> None:
    from matplotlib.ticker import NullLocator

    axes.set(xscale="log", yscale="log", title=rows[0]["question"].replace("-", " ").capitalize())
    for row in rows:
        marker, colour = MARKS[models.index(row["model"]) % len(MARKS)]
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
