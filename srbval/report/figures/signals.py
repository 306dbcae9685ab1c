"""Figures of one record: signal and envelope over time, spectra before and after demodulation."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from srbval.recordings import Origin
from srbval.report.figures import style
from srbval.report.figures.style import GREEN, HALF, INK, ORIGINS, WIDE, PanelData, legend_above, new_axes, panel
from srbval.report.findings.records import NORMALISED, Cursor, RecordView, SpectrumView

SIGNAL_BINS = 700
HEALTHY_LOOK = {"color": style.HEALTHY_COLOUR, "ls": (0, (3, 1.2))}
FOUND_LOOK = {"ls": "none", "marker": "v", "ms": 4.5, "mfc": "white", "mec": INK, "mew": 0.9, "zorder": 7}
UPRIGHT = {"rotation": 90, "va": "bottom", "ha": "center"}
ON_WHITE = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.7}


def draw_acceleration(
    record: RecordView,
    *,
    limit: float,
    letter: str = "",
    title: str = "",
    period: tuple[str, float] | None = None,
    inches: tuple[float, float] = HALF,
    axes: Any = None,
) -> PanelData:
    """Draw signal and envelope over time, amplitude axis ±`limit`; a bar shows `period` (name, length [s]).

    They are drawn onto `axes` or, without `axes`, onto a new figure of the size `inches`.
    """
    axes = axes or new_axes(inches)
    (_, colour, light), (start, stop) = ORIGINS[record.origin], record.window_s
    kept = style.extreme_indices(record.acceleration, SIGNAL_BINS)
    time_s, signal, envelope = (values[kept] for values in (record.time_s, record.acceleration, record.envelope))
    quantity = QUANTITY_NAMES.get(record.unit, "acceleration")
    axes.plot((time_s - start) * 1e3, signal, color=light, lw=0.6, label=quantity)
    axes.plot((time_s - start) * 1e3, envelope, color=colour, lw=1.2, label="its envelope")
    axes.set(xlabel="Time, ms", ylabel=f"{quantity.capitalize()}, {record.unit}")
    axes.set(xlim=(0, (stop - start) * 1e3), ylim=(-limit, limit))
    if period:
        _mark_period(axes, *period)
    style.title_panel(axes, record.origin, letter, title)
    legend_above(axes)
    columns = {"acceleration_std": style.round_digits(signal), "envelope_std": style.round_digits(envelope)}
    return axes.figure, {"time_s": time_s - start} | columns


acceleration_panel = panel(draw_acceleration)


def _mark_period(axes: Any, name: str, period_s: float) -> None:
    """Draw a bar of one period at the lower left, with its name and length."""
    low, high = axes.get_ylim()
    level, start, period_ms = low + 0.07 * (high - low), 0.03 * axes.get_xlim()[1], 1e3 * period_s
    axes.errorbar(start + period_ms / 2, level, xerr=period_ms / 2, color=INK, lw=1.3, capsize=3, zorder=40)
    place, text = start + period_ms + 0.015 * axes.get_xlim()[1], f"{name} = {period_ms:.2f} ms"
    axes.text(place, level, text, va="center", fontsize=7.5, zorder=40, bbox=ON_WHITE)


@panel
def band_panel(records: Mapping[str, RecordView], *, limits_db: tuple[float, float], end_hz: float) -> PanelData:
    """Draw Welch spectra up to `end_hz`, levels within `limits_db`; shade the demodulation band of the last record."""
    last = list(records.values())[-1]
    origins = [record.origin for record in records.values()]
    origin = Origin.STAND_IN if Origin.STAND_IN in origins else last.origin
    band_hz, right = last.analysis.processed.band_hz, last.analysis.processed.band_hz[0] > end_hz / 2
    axes = new_axes(WIDE)
    axes.axvspan(band_hz[0] / 1e3, band_hz[1] / 1e3, color=GREEN, alpha=0.16, lw=0, zorder=0)
    place, text = (band_hz[right] / 1e3, limits_db[1]), f" demodulated: {band_hz[0]:g} to {band_hz[1]:g} Hz "
    axes.text(*place, text, color=GREEN, fontsize=8, va="top", ha="right" if right else "left", zorder=9)
    for name, record in records.items():
        look = HEALTHY_LOOK if name.startswith("healthy") else {"color": ORIGINS[origin][1]}
        axes.plot(last.power_hz / 1e3, record.power_db, **look, lw=0.9, label=name)
    density = "1/Hz" if last.unit == NORMALISED else f"1 ({last.unit})²/Hz"
    axes.set(xlabel="Frequency, kHz", ylabel=f"Power density, dB re {density}", ylim=limits_db, xlim=(0, end_hz / 1e3))
    style.title_panel(axes, origin, "", "spectra before demodulation", pad=9.0)
    legend_above(axes)
    levels = {name.replace(" ", "_") + "_db": style.round_digits(np.asarray(r.power_db)) for name, r in records.items()}
    return axes.figure, {"frequency_hz": last.power_hz} | levels


QUANTITY_NAMES = {"mm/s": "velocity", "µm": "displacement"}
NARROW_PANEL_INCHES = (HALF[0], 1.2 * HALF[1])  # width and height
SPECTRUM_BINS = 600
SPECTRUM_LABEL_ROOM = 2.0  # end of the axis over the highest value of a spectrum with labelled lines
LABEL_INCHES = 0.13  # width of a line's upright label
LABEL_TOPS = (0.975, 0.62, 0.3)
ORDER_LABEL_POINTS = 15.0  # height of the label of the order axis above the axes
NAME_HEIGHT = 0.75  # of the axes: start of the labels in a narrow panel, above its curves


def draw_spectrum(
    view: SpectrumView, *, top: float = 0.0, letter: str = "", title: str = "", brief: bool = False, axes: Any = None
) -> PanelData:
    """Draw an envelope spectrum onto `axes` or a new figure; if `brief`, in half the width and without a legend.

    The amplitude axis ends at `top`, by default so far above the highest value that the lines' names fit.
    """
    record, healthy, end_hz = view.record, view.healthy, view.end_hz
    axes = axes or new_axes(NARROW_PANEL_INCHES if brief else WIDE)
    word, colour, _ = ORIGINS[record.origin]
    label = f"Envelope{' (modulus)' if brief else ''}, {record.unit}"
    top = top or SPECTRUM_LABEL_ROOM * view.highest
    axes.set(xlim=(0, end_hz), ylim=(0.0, top), xlabel="Frequency, Hz", ylabel=label)
    curve = style.thin_spectrum(record.frequency_hz, record.amplitude, end_hz, SPECTRUM_BINS)
    axes.plot(*curve, color=colour, lw=1.0, label=word.lower(), zorder=4)
    if healthy is not None:
        curve = style.thin_spectrum(healthy.frequency_hz, healthy.amplitude, end_hz, SPECTRUM_BINS)
        axes.plot(*curve, **HEALTHY_LOOK, lw=0.8, label="healthy", zorder=5)
    if found := [peak for peak in view.peaks if peak[0] <= end_hz]:
        axes.plot(*zip(*found, strict=True), **FOUND_LOOK, label="found")
    (_draw_names if brief else _draw_cursors)(axes, view)
    hz = record.shaft_hz
    orders = axes.secondary_xaxis("top", functions=(lambda f: f / hz, lambda order: order * hz))
    orders.set_xlabel("Shaft orders", fontsize=7.5, labelpad=2, loc="left")
    orders.tick_params(labelsize=7.5, pad=1)
    style.title_panel(axes, record.origin, letter, title, pad=9.0)
    if not brief:
        legend_above(axes, points=ORDER_LABEL_POINTS)
    frequency, height = style.thin_spectrum(record.frequency_hz, record.amplitude, end_hz, style.BINS_SHOWN)
    columns = {"frequency_hz": frequency, "shaft_order": frequency / hz, "amplitude": style.round_digits(height)}
    if healthy is not None:
        columns["healthy_amplitude"] = style.round_digits(np.interp(frequency, healthy.frequency_hz, healthy.amplitude))
    return axes.figure, columns


spectrum_panel = panel(draw_spectrum)


def _draw_names(axes: Any, view: SpectrumView) -> None:
    """Draw a vertical line at each expected frequency; name harmonics and the first harmonic's sidebands."""
    blended = axes.get_xaxis_transform()
    for cursor in view.cursors:
        look: dict[str, Any] = {"lw": 0.6, "ls": ":"} if cursor.sideband else {"lw": 0.9, "ls": "--"}
        axes.axvline(cursor.frequency_hz, ymax=NAME_HEIGHT - 0.01, color=GREEN, zorder=2, **look)
        if not cursor.sideband or not cursor.name[0].isdigit():
            look = {"fontsize": 5.5 if cursor.sideband else 6.5, "color": GREEN, "zorder": 6}
            axes.text(cursor.frequency_hz, NAME_HEIGHT, cursor.name, transform=blended, **UPRIGHT, **look)


def _draw_cursors(axes: Any, view: SpectrumView) -> None:
    """Draw a vertical line at each expected frequency; label harmonics with frequency and order, sidebands by name."""
    cursors, blended = view.cursors, axes.get_xaxis_transform()
    first = next((cursor for cursor in cursors if not cursor.sideband), None)
    room = LABEL_INCHES / axes.figure.get_figwidth() * axes.get_xlim()[1]  # width of the numbers beside the axis
    for cursor, top in zip(cursors, _label_tops(axes, cursors), strict=True):
        at_hz, look = cursor.frequency_hz, {"transform": blended, "rotation": 90, "va": "top", "color": GREEN}
        if cursor.sideband:
            axes.axvline(at_hz, color=GREEN, lw=0.6, ls=":", alpha=0.8, zorder=2)
            axes.text(at_hz, top, cursor.name, ha="right", fontsize=5.5, zorder=6, **look)
            continue
        axes.axvline(at_hz, color=GREEN, lw=0.9, ls="--", zorder=2, label="expected" if cursor is first else None)
        text = f"{cursor.name}  {at_hz:.1f} Hz, {at_hz / view.record.shaft_hz:.2f}"
        side = "right" if at_hz > room else "left"
        axes.text(at_hz, top, text, ha=side, fontsize=6.5, zorder=6, bbox=ON_WHITE, **look)
    if any(cursor.sideband for cursor in cursors):
        axes.plot([], [], color=GREEN, lw=0.8, ls=":", label="sidebands")


def _label_tops(axes: Any, cursors: Sequence[Cursor]) -> list[float]:
    """Choose the height of each cursor's label, as a fraction of the axes' height, so that labels do not overlap."""
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
