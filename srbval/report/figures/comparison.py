"""Figures of the probabilities of bearing states, and of the cage ratios of model and test rig."""

from collections.abc import Mapping, Sequence
from typing import Any

from srbval.bearing import Fault
from srbval.diagnosis.fault_posterior import FAULT_PAIRS, LABELS
from srbval.report.figures import style
from srbval.report.figures.style import BLUE, GREEN, INK, VERMILION, PanelData, legend_above, new_axes, panel

# Colours of the states.
STATE_COLOURS = {"outer": VERMILION, "inner": style.PURPLE, "roller": style.ORANGE, "other": style.SOFT}
STATE_COLOURS |= {"two parts": "#6b4a3a", "open": "#c9c2b2", "healthy": "#9fd3bd"}
MAX_LABEL_CHARACTERS = 34  # characters of a recording's name


@panel
def probabilities_plot(rows: Sequence[tuple[str, Mapping[str, float]]]) -> PanelData:
    """Draw one stacked bar per recording; `rows` are pairs of recording name and probabilities of bearing states."""
    figure, axes = new_axes((7.6, 0.85 + 0.2 * len(rows)))
    left = [0.0] * len(rows)
    places, columns = range(len(rows)), dict[str, Any](recording=[name for name, _ in rows])
    for state, colour in STATE_COLOURS.items():
        own = [state] if state != "two parts" else FAULT_PAIRS.values()
        shares = [100 * sum(shown.get(name, 0.0) for name in own) for _, shown in rows]
        axes.barh(places, shares, left=left, color=colour, height=0.72, label=LABELS.get(state, state))
        left = [one + more for one, more in zip(left, shares, strict=True)]
        columns |= {f"{state}_pct": shares}
    names = [name if len(name) <= MAX_LABEL_CHARACTERS else f"…{name[1 - MAX_LABEL_CHARACTERS :]}" for name, _ in rows]
    axes.set_yticks(places, labels=names, parse_math=False)
    axes.set(xlim=(0, 100), ylim=(len(rows) - 0.4, -0.6), xlabel="Probability, %")
    axes.grid(False, axis="y")
    legend_above(axes)
    return figure, columns


RATIO_LOOK = {"ms": 5.5, "mew": 1.2, "elinewidth": 1.4, "capsize": 3.5, "zorder": 5}
SCENE_LOOKS = {"paper": ("paper's scene", BLUE, "///"), "rig": ("scene rig", GREEN, "")}


@panel
def cage_ratio_plot(rows: Sequence[Mapping[str, Any]]) -> PanelData:
    """Plot ratios of cage to shaft speed, one panel for each nominal speed; for `rows` see `cage_ratio_rows`."""
    figure = style.new_figure((4.8, 3.3))
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
    elif of in SCENE_LOOKS:
        name, colour, hatch = SCENE_LOOKS[of]
        axes.axhspan(low, high, facecolor=colour, edgecolor=colour, alpha=0.25, lw=0, hatch=hatch)
        axes.axhline(ratio, color=colour, lw=1.4, label=name)
    else:
        place, name = (len(codes), "rig, mean") if of == "mean" else (codes.index(state), "rig, record")
        marker, face = ("D", "white") if of == "mean" else ("s", VERMILION)
        look = {"fmt": marker, "mfc": face, "mec": VERMILION, "ecolor": VERMILION, "label": name}
        axes.errorbar(place, ratio, yerr=[[ratio - low], [high - ratio]], **RATIO_LOOK, **look)
