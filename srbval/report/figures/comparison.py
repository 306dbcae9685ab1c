"""Model against rig as pictures."""

from collections.abc import Mapping, Sequence
from typing import Any

from srbval.bearing import Fault
from srbval.comparison.comparison import Comparison
from srbval.report.figures.style import (
    BLUE,
    GREEN,
    INK,
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


SCENES = {"paper": ("paper's scene", BLUE, "///"), "rig": ("scene rig", GREEN, "")}


@panel
def cage_ratio_plot(rows: Sequence[Mapping[str, Any]]) -> Drawn:
    """Cage ratio at each nominal speed: records of the rig, their mean, the scenes' 95 % bands, kinematics.

    A row has `of` (``record``, ``mean``, ``kinematics``, or a scene of `SCENES`), `nominal_rpm`, `ratio`, and `low` and
    `high`, its 95 % interval; a record's `state` is the fault's code.
    """
    figure = new_figure((4.8, 3.3))
    speeds = sorted({row["nominal_rpm"] for row in rows})
    panels = figure.subplots(1, len(speeds), sharey=True, squeeze=False)[0]
    shown = {row["state"] for row in rows}
    codes = [fault.code for fault in Fault if fault.code in shown and fault.code]
    for rpm, axes in zip(speeds, panels, strict=True):
        for row in (row for row in rows if row["nominal_rpm"] == rpm):
            _draw_ratio(axes, codes, **row)
        axes.set_xticks(range(len(codes) + 1), labels=[*codes, "mean"])
        axes.set(xlim=(-0.6, len(codes) + 0.6), xlabel=f"Record of the rig, {rpm:g} rpm")
        axes.ticklabel_format(axis="y", useOffset=False)
    panels[0].set_ylabel("Cage speed over shaft speed")
    handles = {label: handle for handle, label in zip(*panels[-1].get_legend_handles_labels(), strict=True)}
    figure.legend(handles.values(), handles, loc="outside upper center", ncols=3, frameon=False, columnspacing=1.2)
    return figure, {key: [row[key] for row in rows] for key in rows[0]}


def _draw_ratio(
    axes: Any, codes: Sequence[str], *, of: str, state: str, ratio: float, low: float, high: float, **_: float
) -> None:
    if of == "kinematics":
        axes.axhline(ratio, color=INK, lw=1.2, ls=(0, (5, 2)), label="kinematics")
    elif of in SCENES:
        name, colour, hatch = SCENES[of]
        axes.axhspan(low, high, facecolor=colour, edgecolor=colour, alpha=0.25, lw=0, hatch=hatch)
        axes.axhline(ratio, color=colour, lw=1.4, label=name)
    else:
        place, name = (len(codes), "rig, mean") if of == "mean" else (codes.index(state), "rig, record")
        marker, face = ("D", "white") if of == "mean" else ("s", VERMILION)
        axes.errorbar(
            place, ratio, yerr=[[ratio - low], [high - ratio]], fmt=marker, ms=5.5, mfc=face, mec=VERMILION, mew=1.2,
            ecolor=VERMILION, elinewidth=1.4, capsize=3.5, zorder=5, label=name,
        )  # fmt: skip
