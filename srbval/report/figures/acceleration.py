"""Figure 11's kind: normalised acceleration and its envelope against time."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from srbval.arrays import FloatArray
from srbval.report.figures.files import PanelFiles, extreme_indices, rounded, save_panel
from srbval.report.figures.style import (
    HALF,
    INK,
    figure_style,
    legend_above,
    new_axes,
    origin_style,
    stamp_stand_in,
    title_panel,
)

PLOTTED_BINS = 700
Y_LABEL = "Acceleration, std. dev."


def acceleration_panel(
    folder: Path,
    name: str,
    *,
    time_s: ArrayLike,
    acceleration: ArrayLike,
    envelope: ArrayLike,
    origin: str,
    window_s: tuple[float, float],
    y_limits: tuple[float, float],
    letter: str = "",
    title: str = "",
    period_s: float | None = None,
    period_name: str = "",
    inches: tuple[float, float] = HALF,
    y_label: str = Y_LABEL,
) -> PanelFiles:
    """Draw acceleration (light) and envelope (strong) over `window_s`; write picture and CSV.

    `acceleration` and `envelope`, shape [n], are in standard deviations of the record, or as `y_label` says. Give
    every panel of a figure the same `window_s` length and `y_limits`. `period_s` marks one spacing of the fault line
    (named `period_name`) as a bar, to be compared with the spacing of the bursts.
    """
    time, signal, strength = (np.asarray(a, dtype=np.float64) for a in (time_s, acceleration, envelope))
    start, stop = window_s
    inside = (time >= start) & (time <= stop)
    time, signal, strength = time[inside] - start, signal[inside], strength[inside]
    kept = extreme_indices(signal, PLOTTED_BINS)
    with figure_style():
        figure, axes = new_axes(inches)
        draw_acceleration(axes, time[kept], signal[kept], strength[kept], origin=origin, y_label=y_label)
        axes.set(xlim=(0, (stop - start) * 1e3), ylim=y_limits)
        if period_s:
            _mark_period(axes, period_s * 1e3, period_name)
        title_panel(axes, origin, letter, title)
        legend_above(axes)
        stamp_stand_in(axes, origin)
        shown = {"acceleration_std": rounded(signal[kept]), "envelope_std": rounded(strength[kept])}
        columns = {"time_s": time[kept]} | shown
        return save_panel(figure, folder, name, columns)


def draw_acceleration(
    axes: Any,
    time_s: FloatArray,
    acceleration: FloatArray,
    envelope: FloatArray,
    *,
    origin: str,
    y_label: str = Y_LABEL,
) -> None:
    """Draw acceleration (light) and envelope (strong) over time, all [n], onto given axes."""
    style = origin_style(origin)
    axes.plot(time_s * 1e3, acceleration, color=style.light, lw=0.6, label="acceleration")
    axes.plot(time_s * 1e3, envelope, color=style.colour, lw=1.2, label="its envelope")
    axes.set(xlabel="Time, ms", ylabel=y_label)


def _mark_period(axes: Any, period_ms: float, period_name: str) -> None:
    """A bar of one period at the lower left, with its name and length."""
    low, high = axes.get_ylim()
    level = low + 0.07 * (high - low)
    start = 0.03 * axes.get_xlim()[1]
    axes.errorbar(start + period_ms / 2, level, xerr=period_ms / 2, color=INK, lw=1.3, capsize=3, zorder=40)
    axes.text(
        start + period_ms + 0.015 * axes.get_xlim()[1], level, f"{period_name} = {period_ms:.2f} ms",
        va="center", fontsize=7.5, zorder=40,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1},
    )  # fmt: skip
