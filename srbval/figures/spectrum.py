"""Figures 12 and 13's kind: envelope spectrum with named fault lines."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from srbval.arrays import FloatArray
from srbval.figures.files import PanelFiles, extreme_indices, rounded, save_panel
from srbval.figures.style import (
    GREEN,
    HALF,
    HEALTHY,
    INK,
    WIDE,
    figure_style,
    legend_above,
    new_axes,
    origin_style,
    stamp_stand_in,
    title_panel,
)

BRIEF = (HALF[0], 1.2 * HALF[1])  # inches of a panel beside another one
PLOTTED_BINS = 600
DATA_BINS = 1500  # of the data file: all of a short record, the least and greatest of each stretch of a long one
HEALTHY_DASHES = (0, (3, 1.2))
Y_LABEL = "Envelope (modulus), std. dev."
LABEL_INCHES = 0.13  # width of a line's upright label
LABEL_TOPS = (0.975, 0.62, 0.3)
ORDER_LABEL_POINTS = 15.0  # height of the row of the order axis' label above the axes


@dataclass(frozen=True)
class Cursor:
    """One named frequency [Hz]; a sideband is drawn fainter than a harmonic."""

    name: str
    frequency_hz: float
    sideband: bool = False


def fault_cursors(
    line: str,
    frequency_hz: float,
    *,
    f_max_hz: float,
    sideband_hz: float = 0.0,
    sideband_name: str = "fr",
    sidebands: int = 0,
) -> tuple[Cursor, ...]:
    """Cursors of all harmonics of `line` up to `f_max_hz`, each with `sidebands` on either side.

    Named as the field does: ``BPFI``, ``2xBPFI``, ``BPFI-fr``, ``2xBPFI+2fr``.
    """
    found = []
    for harmonic in range(1, int(f_max_hz // frequency_hz) + 1):
        name = line if harmonic == 1 else f"{harmonic}x{line}"
        found.append(Cursor(name, harmonic * frequency_hz))
        for k in range(-sidebands, sidebands + 1):
            at = harmonic * frequency_hz + k * sideband_hz
            if k and 0 < at <= f_max_hz:
                times = "" if abs(k) == 1 else str(abs(k))
                found.append(Cursor(f"{name}{'+' if k > 0 else '-'}{times}{sideband_name}", at, sideband=True))
    return tuple(sorted(found, key=lambda cursor: cursor.frequency_hz))


def envelope_spectrum_panel(
    folder: Path,
    name: str,
    *,
    frequency_hz: ArrayLike,
    amplitude: ArrayLike,
    shaft_hz: float,
    origin: str,
    cursors: Sequence[Cursor],
    peaks: Sequence[tuple[float, float]],
    healthy: tuple[FloatArray, FloatArray] | None,
    f_max_hz: float,
    y_limits: tuple[float, float],
    letter: str = "",
    title: str = "",
    y_label: str = Y_LABEL,
    brief: bool = False,
) -> PanelFiles:
    """Draw an envelope spectrum up to `f_max_hz`, Hz below and shaft orders on top; write picture and CSV.

    `cursors` are the lines expected (see `fault_cursors`), `peaks` the (frequency [Hz], amplitude) found.
    `healthy` is the (frequency, amplitude) of the healthy bearing at the same speed, drawn dashed, None without one.
    Give both sides of a comparison the same `y_limits`. `brief`: for panels side by side, of half the width, lines by
    their names alone and no legend, whose part their common caption takes.
    """
    with figure_style():
        figure, axes = new_axes(BRIEF if brief else WIDE)
        draw_envelope_spectrum(
            axes, frequency_hz=frequency_hz, amplitude=amplitude, shaft_hz=shaft_hz, origin=origin, cursors=cursors,
            peaks=peaks, healthy=healthy, f_max_hz=f_max_hz, y_limits=y_limits, y_label=y_label, brief=brief,
        )  # fmt: skip
        title_panel(axes, origin, letter, title, pad=9.0)
        if not brief:
            legend_above(axes, points=ORDER_LABEL_POINTS)
        stamp_stand_in(axes, origin)
        data = _columns(_plotted(frequency_hz, amplitude, f_max_hz, DATA_BINS), healthy, shaft_hz)
        return save_panel(figure, folder, name, data)


def draw_envelope_spectrum(
    axes: Any,
    *,
    frequency_hz: ArrayLike,
    amplitude: ArrayLike,
    shaft_hz: float,
    origin: str,
    cursors: Sequence[Cursor],
    peaks: Sequence[tuple[float, float]],
    healthy: tuple[FloatArray, FloatArray] | None,
    f_max_hz: float,
    y_limits: tuple[float, float],
    y_label: str = Y_LABEL,
    brief: bool = False,
) -> None:
    """Draw what `envelope_spectrum_panel` writes onto given axes, without title and legend."""
    frequency, height = _plotted(frequency_hz, amplitude, f_max_hz)
    style = origin_style(origin)
    axes.set(xlim=(0, f_max_hz), ylim=y_limits, xlabel="Frequency, Hz", ylabel=y_label)
    axes.plot(frequency, height, color=style.colour, lw=1.0, label=style.word.lower(), zorder=4)
    dashed = {"color": HEALTHY, "lw": 0.8, "ls": HEALTHY_DASHES, "label": "healthy", "zorder": 5}
    if healthy is not None:
        axes.plot(*_plotted(*healthy, f_max_hz), **dashed)
    _draw_peaks(axes, peaks, f_max_hz)
    _draw_cursors(axes, cursors, None if brief else shaft_hz)
    _order_axis(axes, shaft_hz)


def _plotted(
    frequency_hz: ArrayLike, amplitude: ArrayLike, f_max_hz: float, bins: int = PLOTTED_BINS
) -> tuple[FloatArray, FloatArray]:
    frequency, height = np.asarray(frequency_hz, dtype=float), np.asarray(amplitude, dtype=float)
    inside = (frequency > 0) & (frequency <= f_max_hz)
    frequency, height = frequency[inside], height[inside]
    kept = extreme_indices(height, bins)
    return frequency[kept], height[kept]


def _draw_cursors(axes: Any, cursors: Sequence[Cursor], shaft_hz: float | None) -> None:
    """Harmonics with frequency and order (where `shaft_hz` is given), sidebands by name; labels keep off each other."""
    blended = axes.get_xaxis_transform()
    first = next((cursor for cursor in cursors if not cursor.sideband), None)
    for cursor, top in zip(cursors, _label_tops(axes, cursors), strict=True):
        if cursor.sideband:
            axes.axvline(cursor.frequency_hz, color=GREEN, lw=0.6, ls=":", alpha=0.8, zorder=2)
            axes.text(cursor.frequency_hz, top, cursor.name, transform=blended, rotation=90, ha="right", va="top",
                      fontsize=5.5, color=GREEN, zorder=6)  # fmt: skip
            continue
        label = "expected" if cursor is first else None
        axes.axvline(cursor.frequency_hz, color=GREEN, lw=0.9, ls="--", zorder=2, label=label)
        place = (
            f"{cursor.name}  {cursor.frequency_hz:.1f} Hz, {cursor.frequency_hz / shaft_hz:.2f}"
            if shaft_hz
            else cursor.name
        )
        axes.text(
            cursor.frequency_hz, top, place,
            transform=blended, rotation=90, ha="right", va="top", fontsize=6.5, color=GREEN, zorder=6,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.4},
        )  # fmt: skip
    if any(cursor.sideband for cursor in cursors):
        axes.plot([], [], color=GREEN, lw=0.8, ls=":", label="sidebands")


def _label_tops(axes: Any, cursors: Sequence[Cursor]) -> list[float]:
    """Where each cursor's label begins, in heights of the axes: the highest of `LABEL_TOPS` with room beside it."""
    low, high = axes.get_xlim()
    width = LABEL_INCHES / axes.figure.get_figwidth()
    last = dict.fromkeys(LABEL_TOPS, -np.inf)
    tops = []
    for cursor in cursors:
        place = (cursor.frequency_hz - low) / (high - low)
        top = next((top for top, taken in last.items() if place - taken >= width), LABEL_TOPS[0])
        last[top] = place
        tops.append(top)
    return tops


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
    shown: tuple[FloatArray, FloatArray], healthy: tuple[FloatArray, FloatArray] | None, shaft_hz: float
) -> dict[str, FloatArray]:
    frequency, height = shown
    columns = {"frequency_hz": frequency, "shaft_order": frequency / shaft_hz, "amplitude": rounded(height)}
    return columns if healthy is None else columns | {"healthy_amplitude": rounded(np.interp(frequency, *healthy))}
