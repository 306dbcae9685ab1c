"""Speed against accuracy: error over cost, a mark a solver, the best front as a line, failed runs in a row above."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.report.figures.files import PanelFiles, save_panel
from srbval.report.figures.style import BLUE, GREEN, INK, ORANGE, PURPLE, SOFT, VERMILION, figure_style, new_figure

# Shape and colour tell the methods apart, each alone.
MARKS = ("v", "<", ">", "^", "s", "o", "D", "P", "X")
COLOURS = ("#7a8794", "#4e5a68", ORANGE, INK, PURPLE, BLUE, GREEN, VERMILION, "#a3161f")
SIZE_INCHES = (7.6, 3.3)


@dataclass(frozen=True, kw_only=True)
class CostPoint:
    """A run: `cost` in wall seconds per simulated second, `values` by panel (None: not measured), `failed` or not.

    `ringed`: the default solver at its default step.
    """

    solver: str
    dt_s: float
    cost: float | None
    values: Mapping[str, float | None]
    status: str
    ringed: bool

    @property
    def failed(self) -> bool:
        """Is it drawn in the row of the failed?"""
        return self.status != "ok"


def speed_accuracy_plot(
    folder: Path,
    name: str,
    *,
    points: Sequence[CostPoint],
    panels: Mapping[str, str],
    fronts: Sequence[str],
    floors: Mapping[str, float | None],
) -> PanelFiles:
    """Draw one panel for each of `panels` (value's name, axis label); write picture and CSV.

    `fronts` names those values of which less is better, so that a front is drawn; `floors`: what the converged run
    itself vouches for, drawn as a dashed line. A failed run without a cost stands at the left edge.
    """
    solvers = list(dict.fromkeys(point.solver for point in points))
    with figure_style():
        figure, rows = _axes(len(panels))
        for place, (value, label) in enumerate(panels.items()):
            above, ax = rows[0][place], rows[1][place]
            _failed(above, points, solvers, first=place == 0)
            _panel(ax, points, solvers, value, front=value in fronts)
            _floor(ax, floors.get(value))
            ax.set(xlabel="Wall s per simulated s", ylabel=label)
            ax.axvline(1.0, color="#9aa5b1", lw=0.7, ls=":")
            _ticks(ax.xaxis, ax.get_xlim())
            _ticks(ax.yaxis, ax.get_ylim())
        _legend(figure, solvers)
        return save_panel(figure, folder, name, _columns(points, panels))


def _axes(columns: int) -> tuple[Any, Any]:
    figure = new_figure(SIZE_INCHES)
    return figure, figure.subplots(2, columns, height_ratios=(1, 8), sharex="col", squeeze=False)


def _panel(ax: Any, points: Sequence[CostPoint], solvers: Sequence[str], value: str, *, front: bool) -> None:
    ax.set(xscale="log", yscale="log")
    drawn = []
    for point in points:
        height = point.values.get(value)
        if point.failed or point.cost is None or not height:
            continue
        drawn.append((point.cost, height))
        mark, colour = _look(solvers, point.solver)
        ax.plot(point.cost, height, mark, color=colour, ms=5, mew=0.6, mec="white", zorder=4)
        if point.ringed:
            ax.plot(point.cost, height, "o", mfc="none", mec=INK, ms=11, mew=1.1, zorder=5)
    for solver in solvers:
        own = sorted((p.cost, h) for p in points if p.solver == solver and not p.failed
                     and p.cost is not None and (h := p.values.get(value)))  # fmt: skip
        ax.plot([x for x, _ in own], [y for _, y in own], color=_look(solvers, solver)[1], lw=0.7, alpha=0.4, zorder=1)
    ax.margins(0.08)
    best = _front(drawn) if front else []
    ax.plot([x for x, _ in best], [y for _, y in best], color=GREEN, lw=1.6, alpha=0.55, zorder=2)


def _floor(ax: Any, floor: float | None) -> None:
    """What the converged run vouches for."""
    if floor:
        ax.axhline(floor, color=SOFT, ls="--", lw=0.9)
        ax.annotate("converged run", (1, floor), xycoords=("axes fraction", "data"), ha="right", va="bottom",
                    fontsize=6.5, color=SOFT)  # fmt: skip


def _ticks(axis: Any, limits: tuple[float, float]) -> None:
    """Few labelled ticks whatever the axis spans: powers of ten, or some between them where it spans little."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    decades = math.log10(limits[1] / limits[0])
    steps = {2.5: (1.0,), 1.6: (1.0, 3.0), 0.8: (1.0, 2.0, 5.0), 0.0: (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0)}
    between = next(some for least, some in steps.items() if decades > least)
    axis.set_major_locator(LogLocator(subs=between))
    axis.set_minor_locator(NullLocator())
    if decades <= 2.5:
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _failed(above: Any, points: Sequence[CostPoint], solvers: Sequence[str], *, first: bool) -> None:
    """The failed runs of a panel at their cost, in a row of their own."""
    above.set_xscale("log")
    left = min((p.cost for p in points if p.cost is not None), default=1.0)
    for point in points:
        if point.failed:
            mark, colour = _look(solvers, point.solver)
            above.plot(point.cost or left, 0.5, "x", color="#a3161f", ms=9, mew=1.3)
            above.plot(point.cost or left, 0.5, mark, color=colour, ms=5, mew=0.6, mec="white")
    above.set(ylim=(0, 1), yticks=[])
    above.set_facecolor("#faf0f0")
    above.tick_params(labelbottom=False, length=0, which="both")
    above.grid(visible=False)
    if first:
        above.set_ylabel("failed", rotation=0, ha="right", va="center", color="#a3161f", fontsize=7.5)


def _front(drawn: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Points that no cheaper or equally cheap one beats, cheapest first."""
    front: list[tuple[float, float]] = []
    for point in sorted(drawn):
        if not front or point[1] < front[-1][1]:
            front.append(point)
    return front


def _look(solvers: Sequence[str], solver: str) -> tuple[str, str]:
    place = solvers.index(solver)
    return MARKS[place % len(MARKS)], COLOURS[place % len(COLOURS)]


def _legend(figure: Any, solvers: Sequence[str]) -> None:
    from matplotlib.lines import Line2D

    handles = []
    for solver in solvers:
        mark, colour = _look(solvers, solver)
        handles.append(Line2D([], [], marker=mark, ls="", color=colour, ms=5, label=solver))
    handles.append(Line2D([], [], marker="o", ls="", mfc="none", mec=INK, ms=9, label="default"))
    handles.append(Line2D([], [], color=GREEN, lw=1.6, alpha=0.55, label="front"))
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), fontsize=7, frameon=False,
                  columnspacing=0.9, handletextpad=0.3, handlelength=1.4)  # fmt: skip


def _columns(points: Sequence[CostPoint], panels: Mapping[str, str]) -> dict[str, list[Any]]:
    columns: dict[str, list[Any]] = {
        "solver": [p.solver for p in points],
        "dt_s": [p.dt_s for p in points],
        "wall_per_simulated_s": [math.nan if p.cost is None else p.cost for p in points],
    }
    for value in panels:
        columns[value] = [math.nan if (v := p.values.get(value)) is None else v for p in points]
    return columns | {"status": [p.status for p in points]}
