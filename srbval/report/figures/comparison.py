"""Model against rig as pictures, the validation matrix as a map, and error against cost of every model."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from srbval.comparison.comparison import Comparison
from srbval.report.figures.style import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    SOFT,
    VERMILION,
    Drawn,
    new_axes,
    new_figure,
    panel,
)

# kind: (marker, face colour, edge colour); shape and filling tell them apart without colour.
MARKS = {
    "published": ("D", "white", INK),
    "simulated": ("o", BLUE, BLUE),
    "measured": ("s", VERMILION, VERMILION),
}
ROW_INCHES, FRAME_INCHES, WIDTH_INCHES = 0.21, 0.75, 7.6
CELL_INCHES, MAP_INCHES = (0.56, 0.2), (2.0, 1.0)  # of a map: a cell, and all about its cells


@panel
def deviation_plot(points: Sequence[Mapping[str, Any]]) -> Drawn:
    """One row a point, grouped by defect, zero in the middle.

    A point has a `group` (the defect's line), a `source` (whose value it is), its `kind`, a key of `MARKS` (a stand-in
    is no comparison: it is refused by a KeyError), `deviation_pct`, and `ci95_pct`, the half width of its 95 %
    interval, None where it is not known.
    """
    figure, axes = new_axes((WIDTH_INCHES, FRAME_INCHES + ROW_INCHES * len(points)))
    axes.axvline(0, color=INK, lw=0.9)
    for row, point in enumerate(points):
        _draw_point(axes, row, **point)
        if row and point["group"] != points[row - 1]["group"]:
            axes.axhline(row - 0.5, color="#9aa5b1", lw=0.8)
    axes.set_yticks(range(len(points)), labels=[f"{p['group']} · {p['source']}" for p in points])
    axes.set(ylim=(len(points) - 0.4, -0.6), xlabel="Deviation from the kinematic frequency, %")
    axes.margins(x=0.12)
    return figure, {key: [float("nan") if p[key] is None else p[key] for p in points] for key in points[0]}


def _draw_point(axes: Any, row: int, *, kind: str, deviation_pct: float, ci95_pct: float | None, **_: str) -> None:
    marker, face, edge = MARKS[kind]
    axes.errorbar(
        deviation_pct, row, xerr=ci95_pct, marker=marker, ms=6, mfc=face, mec=edge, mew=1.2,
        ecolor=edge, elinewidth=1.4, capsize=3.5, zorder=5,
    )  # fmt: skip
    uncertain = "" if ci95_pct is None else f" ± {ci95_pct:.3f}"
    axes.annotate(
        f"{deviation_pct:+.3f}{uncertain}", (1.0, row), xycoords=axes.get_yaxis_transform(),
        xytext=(6, 0), textcoords="offset points", va="center", fontsize=7.5, annotation_clip=False,
    )  # fmt: skip


@panel
def agreement_plot(rows: Sequence[Comparison], label: str) -> Drawn:
    """Predicted against measured `rows` of one unit, with the line of agreement and the data's 95 % intervals.

    Frequencies are drawn as their deviations from kinematics [%].
    """
    figure, axes = new_axes((3.6, 3.4), layout="constrained")
    rig = [_from_kinematics(row, row.rig.value) for row in rows]
    model = [_from_kinematics(row, row.model.value) for row in rows]
    ends = [min(rig + model), max(rig + model)]
    axes.plot(ends, ends, color=INK, lw=0.9)
    half = [row.data_ci95 for row in rows]
    axes.errorbar(rig, model, xerr=half, fmt="o", color=BLUE, ms=4, lw=0.8)
    axes.set(xlabel=f"Measured {label}", ylabel=f"Predicted {label}")
    return figure, {"measured": rig, "predicted": model, "measured_ci95": half}


def _from_kinematics(row: Comparison, value: float) -> float:
    return 100 * (value / row.rig.kinematic - 1) if row.rig.kinematic else value


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
    """Error against cost, one panel a question: the rows of `plan.table.summary`, the worst error as a bar.

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
