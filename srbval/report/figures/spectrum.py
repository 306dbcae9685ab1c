"""Figures 12 and 13's kind: envelope spectrum with named fault lines."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from srbval.arrays import FloatArray
from srbval.report.figures.cursors import Cursor
from srbval.report.figures.decimate import extreme_indices
from srbval.report.figures.files import PanelFiles, rounded, save_panel
from srbval.report.figures.style import (
    GREEN,
    HEALTHY,
    INK,
    figure_style,
    legend_above,
    new_axes,
    origin_style,
    stamp_stand_in,
    title_panel,
)

PLOTTED_BINS = 600
DATA_BINS = 1500  # of the data file: all of a short record, the least and greatest of each stretch of a long one
HEALTHY_DASHES = (0, (3, 1.2))
ORDER_LABEL_POINTS = 15.0  # height of the row of the order axis' label above the axes


def envelope_spectrum_panel(
    folder: Path,
    name: str,
    *,
    frequency_hz: ArrayLike,
    amplitude: ArrayLike,
    shaft_hz: float,
    origin: str,
    cursors: Sequence[Cursor] = (),
    peaks: Sequence[tuple[float, float]] = (),
    healthy: tuple[ArrayLike, ArrayLike] | None = None,
    letter: str = "",
    title: str = "",
    f_max_hz: float = 600.0,
    y_limits: tuple[float, float] | None = None,
    y_label: str = "Envelope (modulus), std. dev.",
    log_scale: bool = False,
    size: str = "wide",
) -> PanelFiles:
    """Draw an envelope spectrum up to `f_max_hz`, Hz below and shaft orders on top; write picture and CSV.

    `cursors` are the lines expected (see `fault_cursors`), `peaks` the (frequency [Hz], amplitude) found.
    `healthy` is the (frequency, amplitude) of the healthy bearing at the same speed, drawn dashed. Give
    both sides of a comparison the same `y_limits`.
    """
    frequency, height = _plotted(frequency_hz, amplitude, f_max_hz)
    reference = None if healthy is None else _plotted(*healthy, f_max_hz)
    top = y_limits or _limits(height, reference, log_scale)
    style = origin_style(origin)
    with figure_style():
        figure, axes = new_axes(size)
        axes.set(xlim=(0, f_max_hz), ylim=top, xlabel="Frequency, Hz", ylabel=y_label)
        if log_scale:
            axes.set_yscale("log")
        axes.plot(frequency, height, color=style.colour, lw=1.0, label=style.word.lower(), zorder=4)
        if reference is not None:
            axes.plot(*reference, color=HEALTHY, lw=0.8, ls=HEALTHY_DASHES, label="healthy", zorder=5)
        _draw_peaks(axes, peaks, f_max_hz)
        _draw_cursors(axes, cursors, shaft_hz)
        _order_axis(axes, shaft_hz)
        title_panel(axes, origin, letter, title, pad=9.0)
        legend_above(axes, points=ORDER_LABEL_POINTS)
        stamp_stand_in(axes, origin)
        data = _columns(_plotted(frequency_hz, amplitude, f_max_hz, DATA_BINS), healthy, shaft_hz)
        return save_panel(figure, folder, name, data)


def _plotted(
    frequency_hz: ArrayLike, amplitude: ArrayLike, f_max_hz: float, bins: int = PLOTTED_BINS
) -> tuple[FloatArray, FloatArray]:
    frequency, height = np.asarray(frequency_hz, dtype=float), np.asarray(amplitude, dtype=float)
    inside = (frequency > 0) & (frequency <= f_max_hz)
    frequency, height = frequency[inside], height[inside]
    kept = extreme_indices(height, bins)
    return frequency[kept], height[kept]


def _limits(
    height: FloatArray, reference: tuple[FloatArray, FloatArray] | None, log_scale: bool
) -> tuple[float, float]:
    highest = max(float(height.max()), float(reference[1].max()) if reference else 0.0)
    lowest = max(float(np.median(height)) / 30, highest * 1e-6) if log_scale else 0.0
    return lowest, highest * (4 if log_scale else 1.12)


def _draw_cursors(axes: Any, cursors: Sequence[Cursor], shaft_hz: float) -> None:
    """Harmonics with frequency and order; sidebands by name, at the foot of the picture."""
    blended = axes.get_xaxis_transform()
    first = next((cursor for cursor in cursors if not cursor.sideband), None)
    for cursor in cursors:
        if cursor.sideband:
            axes.axvline(cursor.frequency_hz, color=GREEN, lw=0.6, ls=":", alpha=0.8, zorder=2)
            axes.text(cursor.frequency_hz, 0.97, cursor.name, transform=blended, rotation=90, ha="right", va="top",
                      fontsize=5.5, color=GREEN, zorder=6)  # fmt: skip
            continue
        label = "expected" if cursor is first else None
        axes.axvline(cursor.frequency_hz, color=GREEN, lw=0.9, ls="--", zorder=2, label=label)
        place = f"{cursor.name}  {cursor.frequency_hz:.1f} Hz, {cursor.frequency_hz / shaft_hz:.2f}"
        axes.text(
            cursor.frequency_hz, 0.975, place,
            transform=blended, rotation=90, ha="right", va="top", fontsize=6.5, color=GREEN, zorder=6,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.4},
        )  # fmt: skip
    if any(cursor.sideband for cursor in cursors):
        axes.plot([], [], color=GREEN, lw=0.8, ls=":", label="sidebands")


def _draw_peaks(axes: Any, peaks: Sequence[tuple[float, float]], f_max_hz: float) -> None:
    shown = [(f, a) for f, a in peaks if f <= f_max_hz]
    if shown:
        axes.plot(*zip(*shown, strict=True), ls="none", marker="v", ms=4.5, mfc="white", mec=INK, mew=0.9,
                  label="found", zorder=7)  # fmt: skip


def _order_axis(axes: Any, shaft_hz: float) -> None:
    top = axes.secondary_xaxis("top", functions=(lambda f: f / shaft_hz, lambda order: order * shaft_hz))
    top.set_xlabel("Shaft orders", fontsize=7.5, labelpad=2, loc="left")
    top.tick_params(labelsize=7.5, pad=1)


def _columns(
    shown: tuple[FloatArray, FloatArray], healthy: tuple[ArrayLike, ArrayLike] | None, shaft_hz: float
) -> dict[str, FloatArray]:
    frequency, height = shown
    columns = {"frequency_hz": frequency, "shaft_order": frequency / shaft_hz, "amplitude": rounded(height)}
    if healthy is not None:
        known, below = (np.asarray(values, dtype=float) for values in healthy)
        columns["healthy_amplitude"] = rounded(np.interp(frequency, known, below))
    return columns
