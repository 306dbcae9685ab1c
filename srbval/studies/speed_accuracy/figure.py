"""Speed against accuracy: error over cost, a mark a solver, the best front as a line, failed runs in a row above."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from srbval.models.run import USABLE
from srbval.report.figures.style import BLUE, GREEN, INK, ORANGE, PURPLE, SOFT, VERMILION, Drawn, new_figure, panel

# Shape and colour tell the methods apart, each alone.
MARKS = ("v", "<", ">", "^", "s", "o", "D", "P", "X")
COLOURS = ("#7a8794", "#4e5a68", ORANGE, INK, PURPLE, BLUE, GREEN, VERMILION, "#a3161f")
SIZE_INCHES = (7.6, 3.3)
COST = "wall_per_simulated_s"
Row = Mapping[str, Any]


@panel
def speed_accuracy_plot(
    runs: Sequence[Row], *, panels: Mapping[str, str], fronts: Mapping[str, str], floors: Mapping[str, float | None]
) -> Drawn:
    """One panel for each of `panels` (value's name, axis label).

    `runs` are rows of the stored bench with the `marks` that they are shown with; a value of None was not measured. The
    default solver at its default step has a ring. `fronts` names for values the flag of the runs on their front, a
    line; `floors`: what the converged run itself vouches for, dashed. A failed run without a cost stands at the left.
    """
    solvers = list(dict.fromkeys(run["solver"] for run in runs))
    figure = new_figure(SIZE_INCHES)
    rows = figure.subplots(2, len(panels), height_ratios=(1, 8), sharex="col", squeeze=False)
    for place, (value, label) in enumerate(panels.items()):
        above, ax = rows[0][place], rows[1][place]
        _failed(above, runs, solvers, first=place == 0)
        _panel(ax, runs, solvers, value, fronts.get(value, ""))
        _floor(ax, floors.get(value))
        ax.set(xlabel="Wall s per simulated s", ylabel=label)
        ax.axvline(1.0, color="#9aa5b1", lw=0.7, ls=":")
        _ticks(ax.xaxis, ax.get_xlim())
        _ticks(ax.yaxis, ax.get_ylim())
    _legend(figure, solvers)
    names = ("solver", "dt_s", COST, *panels, "status")
    return figure, {key: [math.nan if run[key] is None else run[key] for run in runs] for key in names}


def _panel(ax: Any, runs: Sequence[Row], solvers: Sequence[str], value: str, front: str) -> None:
    ax.set(xscale="log", yscale="log")
    drawn = []
    for run in runs:
        cost, height = run[COST], run[value]
        if run["status"] not in USABLE or cost is None or not height:
            continue
        drawn.append((cost, height, run["solver"]))
        mark, colour = _look(solvers, run["solver"])
        ax.plot(cost, height, mark, color=colour, ms=5, mew=0.6, mec="white", zorder=4)
        if "default" in run["marks"]:
            ax.plot(cost, height, "o", mfc="none", mec=INK, ms=11, mew=1.1, zorder=5)
    for solver in solvers:
        own = sorted((x, y) for x, y, name in drawn if name == solver)
        ax.plot([x for x, _ in own], [y for _, y in own], color=_look(solvers, solver)[1], lw=0.7, alpha=0.4, zorder=1)
    ax.margins(0.08)
    best = sorted((run[COST], run[value]) for run in runs if run.get(front))
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


def _failed(above: Any, runs: Sequence[Row], solvers: Sequence[str], *, first: bool) -> None:
    """The failed runs of a panel at their cost, in a row of their own."""
    above.set_xscale("log")
    left = min((run[COST] for run in runs if run[COST] is not None), default=1.0)
    for run in runs:
        if run["status"] not in USABLE:
            mark, colour = _look(solvers, run["solver"])
            above.plot(run[COST] or left, 0.5, "x", color="#a3161f", ms=9, mew=1.3)
            above.plot(run[COST] or left, 0.5, mark, color=colour, ms=5, mew=0.6, mec="white")
    above.set(ylim=(0, 1), yticks=[])
    above.set_facecolor("#faf0f0")
    above.tick_params(labelbottom=False, length=0, which="both")
    above.grid(visible=False)
    if first:
        above.set_ylabel("failed", rotation=0, ha="right", va="center", color="#a3161f", fontsize=7.5)


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
