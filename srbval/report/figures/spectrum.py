"""Figures 12 and 13's kind: envelope spectrum with named fault lines."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from srbval.arrays import FloatArray
from srbval.report.figures.files import PanelFiles, extreme_indices, rounded, save_panel
from srbval.report.figures.style import (
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
# Where a narrow picture's labels begin, above all that is drawn: only names fit there.
NAMES_FROM = 0.75
# Peaks taller than this share of the tallest are named. Within this share of a frequency and two bins they are one;
# as a multiple of shaft, line or cage so many times at most: every frequency is near to some multiple.
TALL, SAME, MOST_TIMES = 1 / 3, 0.001, 6


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
    others: Sequence[tuple[str, float, float]] = (),
    letter: str = "",
    title: str = "",
    y_label: str = Y_LABEL,
    brief: bool = False,
) -> PanelFiles:
    """Draw an envelope spectrum up to `f_max_hz`, Hz below and shaft orders on top; write picture and CSV.

    `cursors` are the lines expected (see `fault_cursors`), `peaks` the (frequency [Hz], amplitude) found.
    `healthy` is the (frequency, amplitude) of the healthy bearing at the same speed, drawn dashed, None without one;
    `others` are further tall peaks by what they are: name, frequency, amplitude (see `tall_peaks`). Give both sides of
    a comparison the same `y_limits`. `brief`: for panels side by side, of half the width, lines by their names alone
    and no legend, whose part their common caption takes.
    """
    with figure_style():
        figure, axes = new_axes(BRIEF if brief else WIDE)
        draw_envelope_spectrum(
            axes, frequency_hz=frequency_hz, amplitude=amplitude, shaft_hz=shaft_hz, origin=origin, cursors=cursors,
            peaks=peaks, healthy=healthy, f_max_hz=f_max_hz, y_limits=y_limits, y_label=y_label, brief=brief,
        )  # fmt: skip
        _name_peaks(axes, others, [cursor.frequency_hz for cursor in cursors if not cursor.sideband])
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
    if brief:
        _draw_names(axes, cursors)
    else:
        _draw_cursors(axes, cursors, shaft_hz)
    _order_axis(axes, shaft_hz)


def tall_peaks(
    frequency_hz: ArrayLike,
    amplitude: ArrayLike,
    *,
    shaft_hz: float,
    orders: Mapping[str, float],
    marked_hz: Sequence[float],
    f_max_hz: float,
) -> list[tuple[str, float, float]]:
    """Tall peaks up to `f_max_hz` that are not marked already: what they are, frequency [Hz], amplitude.

    Named as a small multiple of one of `orders` (name: shaft orders), or by their distance from one within a shaft
    order, or else by their own order.
    """
    frequency, height = _plotted(frequency_hz, amplitude, f_max_hz, DATA_BINS)
    inner = np.flatnonzero((height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:])) + 1
    bin_hz = float(np.diff(np.asarray(frequency_hz, dtype=float)[:2])[0])
    inner = inner[height[inner] > TALL * height[inner].max(initial=0.0)]
    known = [(f"{n}x{name}" if n > 1 else name, n * one)
             for name, one in orders.items() for n in range(1, MOST_TIMES + 1)]  # fmt: skip
    found: list[tuple[str, float, float]] = []
    for at_hz, own in sorted(zip(frequency[inner].tolist(), height[inner].tolist(), strict=True), key=lambda x: -x[1]):
        same = SAME * at_hz + 2 * bin_hz
        if any(abs(at_hz - hz) < same for hz in (*marked_hz, *(hz for _, hz, _ in found))):
            continue
        order = at_hz / shaft_hz
        name, nearest = min(known, key=lambda one: (round(abs(order - one[1]) / (same / shaft_hz)), len(one[0])))
        if abs(order - nearest) * shaft_hz > same:
            lines = [one for one in known if "BP" in one[0] and abs(order - one[1]) < 1]
            name, nearest = min(lines, key=lambda one: abs(order - one[1]), default=("", 0.0))
            name += f"{order - nearest:+.2f}fr" if name else f"{order:.2f}fr"
        found.append((name, at_hz, own))
    return found


def _plotted(
    frequency_hz: ArrayLike, amplitude: ArrayLike, f_max_hz: float, bins: int = PLOTTED_BINS
) -> tuple[FloatArray, FloatArray]:
    frequency, height = np.asarray(frequency_hz, dtype=float), np.asarray(amplitude, dtype=float)
    inside = (frequency > 0) & (frequency <= f_max_hz)
    frequency, height = frequency[inside], height[inside]
    kept = extreme_indices(height, bins)
    return frequency[kept], height[kept]


def _draw_names(axes: Any, cursors: Sequence[Cursor]) -> None:
    """The cursors up to `NAMES_FROM`, above them the names of the harmonics and of the first one's sidebands."""
    blended = axes.get_xaxis_transform()
    for cursor in cursors:
        style = {"lw": 0.6, "ls": ":"} if cursor.sideband else {"lw": 0.9, "ls": "--"}
        axes.axvline(cursor.frequency_hz, ymax=NAMES_FROM - 0.01, color=GREEN, zorder=2, **style)
        if not cursor.sideband or not cursor.name[0].isdigit():
            axes.text(cursor.frequency_hz, NAMES_FROM, cursor.name, transform=blended, rotation=90, ha="center",
                      va="bottom", fontsize=5.5 if cursor.sideband else 6.5, color=GREEN, zorder=6)  # fmt: skip


def _name_peaks(axes: Any, others: Sequence[tuple[str, float, float]], marked_hz: Sequence[float]) -> None:
    """What tall peaks are, upright above them, a little away from what is close: another, a line, the axis."""
    places = [0.0, *marked_hz, *(at_hz for _, at_hz, _ in others)]
    near = LABEL_INCHES / axes.figure.get_figwidth() * axes.get_xlim()[1]
    for label, at_hz, height in others:
        close = [place for place in places if 0 < abs(place - at_hz) < near]
        shift = 0 if not close else 3.5 if close[0] < at_hz else -3.5
        axes.annotate(label, (at_hz, height), xytext=(shift, 2), textcoords="offset points", ha="center", va="bottom",
                      rotation=90, fontsize=6, color=INK, zorder=8)  # fmt: skip


def _draw_cursors(axes: Any, cursors: Sequence[Cursor], shaft_hz: float) -> None:
    """Harmonics with frequency and order, sidebands by name; a label that would lie on another stands below it."""
    blended = axes.get_xaxis_transform()
    first = next((cursor for cursor in cursors if not cursor.sideband), None)
    room = LABEL_INCHES / axes.figure.get_figwidth() * axes.get_xlim()[1]  # beside the axis, whose numbers stand there
    for cursor, top in zip(cursors, _label_tops(axes, cursors), strict=True):
        if cursor.sideband:
            axes.axvline(cursor.frequency_hz, color=GREEN, lw=0.6, ls=":", alpha=0.8, zorder=2)
            axes.text(cursor.frequency_hz, top, cursor.name, transform=blended, rotation=90, ha="right", va="top",
                      fontsize=5.5, color=GREEN, zorder=6)  # fmt: skip
            continue
        label = "expected" if cursor is first else None
        axes.axvline(cursor.frequency_hz, color=GREEN, lw=0.9, ls="--", zorder=2, label=label)
        place = f"{cursor.name}  {cursor.frequency_hz:.1f} Hz, {cursor.frequency_hz / shaft_hz:.2f}"
        axes.text(
            cursor.frequency_hz, top, place,
            transform=blended, rotation=90, ha="right" if cursor.frequency_hz > room else "left", va="top",
            fontsize=6.5, color=GREEN, zorder=6,
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
