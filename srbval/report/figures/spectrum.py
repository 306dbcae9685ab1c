"""Figures 12 and 13's kind: envelope spectrum with named fault lines."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from srbval.report.figures.files import BINS_SHOWN, plotted, rounded
from srbval.report.figures.style import (
    GREEN,
    HALF,
    HEALTHY,
    INK,
    WIDE,
    legend_above,
    new_axes,
    origin_style,
    panel,
    stamp_stand_in,
    title_panel,
)
from srbval.report.findings.records import Cursor, SpectrumView

BRIEF = (HALF[0], 1.2 * HALF[1])  # inches of a panel beside another one
PLOTTED_BINS = 600
HEALTHY_DASHES = (0, (3, 1.2))
LABEL_INCHES = 0.13  # width of a line's upright label
LABEL_TOPS = (0.975, 0.62, 0.3)
ORDER_LABEL_POINTS = 15.0  # height of the row of the order axis' label above the axes
NAMES_FROM = 0.75  # where a narrow picture's labels begin, above all that is drawn: only names fit there


@panel()
def spectrum_panel(
    view: SpectrumView, *, top: float, letter: str = "", title: str = "", brief: bool = False
) -> tuple[Any, Mapping[str, ArrayLike]]:
    """An envelope spectrum from zero to `top`, Hz below and shaft orders above.

    Give both sides of a comparison the same `top`. `brief`: for panels side by side, of half the width, lines by their
    names alone and no legend, whose part their common caption takes.
    """
    record, healthy = view.record, view.healthy
    figure, axes = new_axes(BRIEF if brief else WIDE)
    draw_spectrum(axes, view, top, brief=brief)
    _name_peaks(axes, view.others, [cursor.frequency_hz for cursor in view.cursors if not cursor.sideband])
    title_panel(axes, record.origin, letter, title, pad=9.0)
    if not brief:
        legend_above(axes, points=ORDER_LABEL_POINTS)
    stamp_stand_in(axes, record.origin)
    frequency, height = plotted(record.frequency_hz, record.amplitude, view.end_hz, BINS_SHOWN)
    columns = {"frequency_hz": frequency, "shaft_order": frequency / record.shaft_hz, "amplitude": rounded(height)}
    if healthy is not None:
        columns["healthy_amplitude"] = rounded(np.interp(frequency, healthy.frequency_hz, healthy.amplitude))
    return figure, columns


def draw_spectrum(axes: Any, view: SpectrumView, top: float, *, brief: bool = False) -> None:
    """Draw what `spectrum_panel` writes onto given axes, without title and legend."""
    record, healthy, end_hz = view.record, view.healthy, view.end_hz
    style = origin_style(record.origin)
    label = f"Envelope{' (modulus)' if brief else ''}, {record.unit}"
    axes.set(xlim=(0, end_hz), ylim=(0.0, top), xlabel="Frequency, Hz", ylabel=label)
    axes.plot(*plotted(record.frequency_hz, record.amplitude, end_hz, PLOTTED_BINS), color=style.colour, lw=1.0,
              label=style.word.lower(), zorder=4)  # fmt: skip
    if healthy is not None:
        axes.plot(*plotted(healthy.frequency_hz, healthy.amplitude, end_hz, PLOTTED_BINS), color=HEALTHY, lw=0.8,
                  ls=HEALTHY_DASHES, label="healthy", zorder=5)  # fmt: skip
    if found := [peak for peak in view.peaks if peak[0] <= end_hz]:
        axes.plot(*zip(*found, strict=True), ls="none", marker="v", ms=4.5, mfc="white", mec=INK, mew=0.9,
                  label="found", zorder=7)  # fmt: skip
    (_draw_names if brief else _draw_cursors)(axes, view)
    hz = record.shaft_hz
    orders = axes.secondary_xaxis("top", functions=(lambda f: f / hz, lambda order: order * hz))
    orders.set_xlabel("Shaft orders", fontsize=7.5, labelpad=2, loc="left")
    orders.tick_params(labelsize=7.5, pad=1)


def _draw_names(axes: Any, view: SpectrumView) -> None:
    """The cursors up to `NAMES_FROM`, above them the names of the harmonics and of the first one's sidebands."""
    blended = axes.get_xaxis_transform()
    for cursor in view.cursors:
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


def _draw_cursors(axes: Any, view: SpectrumView) -> None:
    """Harmonics with frequency and order, sidebands by name; a label that would lie on another stands below it."""
    cursors, blended = view.cursors, axes.get_xaxis_transform()
    first = next((cursor for cursor in cursors if not cursor.sideband), None)
    room = LABEL_INCHES / axes.figure.get_figwidth() * axes.get_xlim()[1]  # beside the axis, whose numbers stand there
    for cursor, top in zip(cursors, _label_tops(axes, cursors), strict=True):
        at_hz, look = cursor.frequency_hz, {"transform": blended, "rotation": 90, "va": "top", "color": GREEN}
        if cursor.sideband:
            axes.axvline(at_hz, color=GREEN, lw=0.6, ls=":", alpha=0.8, zorder=2)
            axes.text(at_hz, top, cursor.name, ha="right", fontsize=5.5, zorder=6, **look)
            continue
        axes.axvline(at_hz, color=GREEN, lw=0.9, ls="--", zorder=2, label="expected" if cursor is first else None)
        axes.text(
            at_hz, top, f"{cursor.name}  {at_hz:.1f} Hz, {at_hz / view.record.shaft_hz:.2f}",
            ha="right" if at_hz > room else "left", fontsize=6.5, zorder=6,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.4}, **look,
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
