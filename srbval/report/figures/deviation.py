"""Comparisons as pictures: Table 6's deviations, predicted against measured quantities."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.comparison.comparison import Comparison, deviation_pct
from srbval.report.figures.files import PanelFiles, save_panel
from srbval.report.figures.style import BLUE, INK, VERMILION, figure_style, new_axes

# kind: (marker, face colour, edge colour); shape and filling tell them apart without colour.
MARKS = {
    "published": ("D", "white", INK),
    "simulated": ("o", BLUE, BLUE),
    "measured": ("s", VERMILION, VERMILION),
}
ROW_INCHES, FRAME_INCHES, WIDTH_INCHES = 0.21, 0.75, 7.6


@dataclass(frozen=True, kw_only=True)
class Deviation:
    """One point: `group` names the defect's line, `source` whose value it is, `kind` a key of `MARKS`.

    `ci95_pct` is the half width of the 95 % interval where it is known.
    """

    group: str
    source: str
    kind: str
    deviation_pct: float
    ci95_pct: float | None = None

    def __post_init__(self) -> None:
        if self.kind not in MARKS:
            raise ValueError(f"{self.source}: kind {self.kind!r} is not one of {', '.join(MARKS)}.")


def deviation_plot(folder: Path, name: str, *, points: Sequence[Deviation]) -> PanelFiles:
    """Draw one row a point, grouped by defect, zero in the middle; write picture and CSV.

    A stand-in is no comparison: it is refused.
    """
    with figure_style():
        figure, axes = new_axes((WIDTH_INCHES, FRAME_INCHES + ROW_INCHES * len(points)))
        axes.axvline(0, color=INK, lw=0.9)
        for row, point in enumerate(points):
            _draw_point(axes, row, point)
        _separate_groups(axes, points)
        axes.set_yticks(range(len(points)), labels=[f"{p.group} · {p.source}" for p in points])
        axes.set(ylim=(len(points) - 0.4, -0.6), xlabel="Deviation from the kinematic frequency, %")
        axes.margins(x=0.12)
        return save_panel(figure, folder, name, _columns(points))


def _draw_point(axes: Any, row: int, point: Deviation) -> None:
    marker, face, edge = MARKS[point.kind]
    axes.errorbar(
        point.deviation_pct, row, xerr=point.ci95_pct, marker=marker, ms=6, mfc=face, mec=edge, mew=1.2,
        ecolor=edge, elinewidth=1.4, capsize=3.5, zorder=5,
    )  # fmt: skip
    uncertain = "" if point.ci95_pct is None else f" ± {point.ci95_pct:.3f}"
    axes.annotate(
        f"{point.deviation_pct:+.3f}{uncertain}", (1.0, row), xycoords=axes.get_yaxis_transform(),
        xytext=(6, 0), textcoords="offset points", va="center", fontsize=7.5, annotation_clip=False,
    )  # fmt: skip


def _separate_groups(axes: Any, points: Sequence[Deviation]) -> None:
    for row in range(1, len(points)):
        if points[row].group != points[row - 1].group:
            axes.axhline(row - 0.5, color="#9aa5b1", lw=0.8)


def _columns(points: Sequence[Deviation]) -> dict[str, list[Any]]:
    return {
        "group": [p.group for p in points],
        "source": [p.source for p in points],
        "kind": [p.kind for p in points],
        "deviation_pct": [p.deviation_pct for p in points],
        "ci95_pct": [float("nan") if p.ci95_pct is None else p.ci95_pct for p in points],
    }


def agreement_plot(folder: Path, name: str, *, rows: Sequence[Comparison], label: str) -> PanelFiles:
    """Draw `rows` of one unit, with the line of agreement and the data's 95 % intervals; write picture and CSV.

    Frequencies are drawn as their deviations from kinematics [%].
    """
    with figure_style():
        figure, axes = new_axes((3.6, 3.4), layout="constrained")
        rig = [_from_kinematics(row, row.rig.value) for row in rows]
        model = [_from_kinematics(row, row.model.value) for row in rows]
        ends = [min(rig + model), max(rig + model)]
        axes.plot(ends, ends, color=INK, lw=0.9)
        half = [row.data_ci95 for row in rows]
        axes.errorbar(rig, model, xerr=half, fmt="o", color=BLUE, ms=4, lw=0.8)
        axes.set(xlabel=f"Measured {label}", ylabel=f"Predicted {label}")
        columns = {"measured": rig, "predicted": model, "measured_ci95": half}
        return save_panel(figure, folder, name, columns)


def _from_kinematics(row: Comparison, value: float) -> float:
    return deviation_pct(value, row.rig.kinematic) if row.rig.kinematic else value
