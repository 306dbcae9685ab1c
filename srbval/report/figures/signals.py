"""Figures of one record: signal and envelope over time, spectra before and after demodulation, wavelet transform."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from srbval.bearing import Fault
from srbval.report.figures import style
from srbval.report.figures.style import GREEN, HALF, INK, ORIGINS, WIDE, PanelData, legend_above, new_axes
from srbval.report.findings.records import NORMALISED, RecordView, SpectrumView
from srbval.signal import Scalogram

SIGNAL_BINS = 700
IMAGE_COLUMNS, IMAGE_ROWS, SCALOGRAM_CSV_ROWS, COLOUR_LEVELS = 280, 110, 40, 64
THUMBNAIL_INCHES, THUMBNAIL_BINS = (3.4, 1.45), 220  # size [inch]; stretches of a curve
BAND_RANGE_DB, BAND_HEAD_DB = 75.0, 8.0
HEALTHY_LOOK = {"color": style.HEALTHY_COLOUR, "ls": (0, (3, 1.2))}
FOUND_LOOK = {"ls": "none", "marker": "v", "ms": 4.5, "mfc": "white", "mec": INK, "mew": 0.9, "zorder": 7}
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
    return axes.figure, {"time_s": time_s - start, "acceleration_std": signal, "envelope_std": envelope}


def _mark_period(axes: Any, name: str, period_s: float) -> None:
    """Draw a bar of one period at the lower left, with its name and length."""
    low, high = axes.get_ylim()
    level, start, period_ms = low + 0.07 * (high - low), 0.03 * axes.get_xlim()[1], 1e3 * period_s
    axes.errorbar(start + period_ms / 2, level, xerr=period_ms / 2, color=INK, lw=1.3, capsize=3, zorder=40)
    place, text = start + period_ms + 0.015 * axes.get_xlim()[1], f"{name} = {period_ms:.2f} ms"
    axes.text(place, level, text, va="center", fontsize=7.5, zorder=40, bbox=ON_WHITE)


def draw_band(records: Mapping[str, RecordView]) -> PanelData:
    """Draw Welch spectra by name of the record; shade the demodulation band of the last record."""
    last, axes = list(records.values())[-1], new_axes(WIDE)
    band_hz, end_hz = last.analysis.processed.band_hz, float(last.power_hz[-1])
    every_db, right = np.concatenate([one.power_db for one in records.values()]), band_hz[0] > end_hz / 2
    top = float(np.nanmax(every_db)) + BAND_HEAD_DB
    limits_db = max(float(np.nanmin(every_db)) - BAND_HEAD_DB, top - BAND_RANGE_DB), top
    axes.axvspan(band_hz[0] / 1e3, band_hz[1] / 1e3, color=GREEN, alpha=0.16, lw=0, zorder=0)
    place, text = (band_hz[right] / 1e3, limits_db[1]), f" demodulated: {band_hz[0]:g} to {band_hz[1]:g} Hz "
    axes.text(*place, text, color=GREEN, fontsize=8, va="top", ha="right" if right else "left", zorder=9)
    for name, record in records.items():
        look = HEALTHY_LOOK if name.startswith("healthy") else {"color": ORIGINS[last.origin][1]}
        axes.plot(last.power_hz / 1e3, record.power_db, **look, lw=0.9, label=name)
    density = "1/Hz" if last.unit == NORMALISED else f"1 ({last.unit})²/Hz"
    axes.set(xlabel="Frequency, kHz", ylabel=f"Power density, dB re {density}", ylim=limits_db, xlim=(0, end_hz / 1e3))
    style.title_panel(axes, last.origin, "", "spectra before demodulation", pad=9.0)
    legend_above(axes)
    levels = {name.replace(" ", "_") + "_db": record.power_db for name, record in records.items()}
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
    _draw_cursors(axes, view, brief)
    hz = record.shaft_hz
    orders = axes.secondary_xaxis("top", functions=(lambda f: f / hz, lambda order: order * hz))
    orders.set_xlabel("Shaft orders", fontsize=7.5, labelpad=2, loc="left")
    orders.tick_params(labelsize=7.5, pad=1)
    style.title_panel(axes, record.origin, letter, title, pad=9.0)
    if not brief:
        legend_above(axes, points=ORDER_LABEL_POINTS)
    frequency, height = style.thin_spectrum(record.frequency_hz, record.amplitude, end_hz, style.BINS_SHOWN)
    columns = {"frequency_hz": frequency, "shaft_order": frequency / hz, "amplitude": height}
    if healthy is not None:
        columns["healthy_amplitude"] = np.interp(frequency, healthy.frequency_hz, healthy.amplitude)
    return axes.figure, columns


def _draw_cursors(axes: Any, view: SpectrumView, brief: bool) -> None:
    """Draw a vertical line with its name at each expected frequency; unless `brief`, harmonics have Hz and order too.

    In a brief panel, only sidebands of the first harmonic are named. In others, names are staggered in height so that
    they do not overlap.
    """
    width, last = LABEL_INCHES / axes.figure.get_figwidth(), dict.fromkeys(LABEL_TOPS, -np.inf)
    for cursor in view.cursors:
        at_hz, side, place = cursor.frequency_hz, cursor.sideband, cursor.frequency_hz / view.end_hz
        line: dict[str, Any] = {"lw": 0.6, "ls": ":"} if side else {"lw": 0.9, "ls": "--"}
        label, end = "sidebands" if side else "expected", NAME_HEIGHT - 0.01 if brief else 1.0
        axes.axvline(at_hz, ymax=end, color=GREEN, zorder=2, label=label, **line)
        look: dict[str, Any] = {"fontsize": 5.5 if side else 6.5, "color": GREEN, "zorder": 6, "rotation": 90}
        if brief and not (side and cursor.name[0].isdigit()):
            look |= {"va": "bottom", "ha": "center", "transform": axes.get_xaxis_transform()}
            axes.text(at_hz, NAME_HEIGHT, cursor.name, **look)
        elif not brief:
            top = next((top for top, taken in last.items() if place - taken >= width), LABEL_TOPS[0])
            last[top] = place
            text = cursor.name if side else f"{cursor.name}  {at_hz:.1f} Hz, {at_hz / view.record.shaft_hz:.2f}"
            look |= {"va": "top", "ha": "right" if place > width else "left", "bbox": None if side else ON_WHITE}
            axes.text(at_hz, top, text, transform=axes.get_xaxis_transform(), **look)


def draw_thumbnail(sides: Sequence[RecordView], kind: str, end_hz: float, top: float) -> PanelData:
    """Draw a thumbnail of a figure without axis labels: model left, rig right (`sides`), on the same axes.

    `kind` is ``scalogram``, ``spectrum`` (up to `end_hz`) or ``acceleration``. `top` is the end of a scalogram's colour
    scale, otherwise of the amplitude axis.
    """
    figure, columns = style.new_figure(THUMBNAIL_INCHES), defaultdict[str, list[Any]](list)
    for axes, record in zip(figure.subplots(1, 2), sides, strict=True):
        word, colour, light = ORIGINS[record.origin]
        if kind == "scalogram":
            x, y = record.scalogram.frequency_hz, record.scalogram.amplitude.mean(axis=1)
            _draw_image(axes, record.scalogram, top, record.window_s)
        elif kind == "spectrum":
            x, y = style.thin_spectrum(record.frequency_hz, record.amplitude, end_hz, THUMBNAIL_BINS)
            axes.plot(x, y, color=colour, lw=0.7)
            axes.set(xlim=(0, end_hz), ylim=(0, top))
        else:
            kept = style.extreme_indices(record.acceleration, THUMBNAIL_BINS)
            x, y = record.time_s[kept], record.envelope[kept]
            axes.plot(x, record.acceleration[kept], color=light, lw=0.5)
            axes.plot(x, y, color=colour, lw=0.9)
            axes.set(ylim=(-top, top))
        axes.grid(False)
        axes.set(xticks=[], yticks=[])
        axes.set_title("model" if word == "Simulated" else "rig", color=colour, fontsize=10)
        columns["side"] += [word.lower()] * len(x)
        columns["x"] += x.tolist()
        columns["y"] += y.tolist()
    return figure, columns


def draw_scalogram(record: RecordView, state: Fault, *, top: float, letter: str = "", title: str = "") -> PanelData:
    """Draw the wavelet magnitude of a record's envelope over time and logarithmic frequency, coloured from 0 to `top`.

    The fault frequency of the bearing state `state` is marked. The regions that the ends of the record distort (cone of
    influence) are hatched.
    """
    image, (start, stop) = record.scalogram, record.window_s
    level, span = np.log10(image.frequency_hz), (0.0, 1e3 * (stop - start))
    axes = style.new_axes(style.HALF)
    drawn = _draw_image(axes, image, top, span)
    axes.set(xlabel="Time, ms", ylabel="Frequency, Hz")
    ticks = [hz for k in range(-1, 6) for m in (1, 2, 5) if level[0] <= np.log10(hz := m * 10.0**k) <= level[-1]]
    axes.set_yticks(np.log10(ticks), labels=[f"{hz:g}" for hz in ticks])
    axes.tick_params(direction="out")
    edge_ms = image.edge_s * 1e3
    inner = (np.clip(edge_ms, *span), np.clip(span[1] - edge_ms, *span))
    for border, outer in zip(inner, span, strict=True):
        axes.fill_betweenx(level, border, outer, facecolor="none", edgecolor="white", hatch="////", lw=0.0)
        axes.plot(border, level, color="white", lw=0.8, scalex=False, scaley=False)
    if state.line:
        at = float(np.log10(record.analysis.line(state.line).kinematic_hz))
        axes.axhline(at, color="white", lw=0.8, ls="--")
        axes.text(span[1] / 2, at, state.line, color="white", fontsize=7.5, ha="center", va="bottom")
    bar = axes.figure.colorbar(drawn, ax=axes, pad=0.02, aspect=18, extend="max")
    bar.set_label("|CWT|, std. dev.", fontsize=7.5)
    bar.ax.tick_params(labelsize=7.5)
    style.title_panel(axes, record.origin, letter, title, pad=6.0)
    rows = np.linspace(0, len(level) - 1, min(SCALOGRAM_CSV_ROWS, len(level))).round().astype(int)
    times = slice(None, None, 2 * _every(image))
    columns = {f"magnitude_at_{image.frequency_hz[row]:.4g}_hz": image.amplitude[row, times] for row in rows}
    return axes.figure, {"time_s": image.time_s[times]} | columns


def _draw_image(axes: Any, image: Scalogram, top: float, span: tuple[float, float]) -> Any:
    """Draw a scalogram over time from start to end (`span`) and log10 of frequency, coloured from 0 to `top`."""
    from matplotlib import colormaps

    level = np.log10(image.frequency_hz)
    wanted = np.linspace(level[0], level[-1], IMAGE_ROWS)
    nearest, every = np.abs(wanted[:, None] - level).argmin(axis=1), _every(image)
    shown = image.amplitude[nearest, : image.time_s.size // every * every].reshape(IMAGE_ROWS, -1, every).mean(axis=2)
    look = {"cmap": colormaps["viridis"].resampled(COLOUR_LEVELS), "interpolation": "none", "aspect": "auto"}
    axes.grid(False)
    return axes.imshow(shown, origin="lower", extent=(*span, level[0], level[-1]), vmin=0.0, vmax=top, **look)


def _every(image: Scalogram) -> int:
    """Return the number of columns of a scalogram that are averaged for drawing."""
    return max(1, image.time_s.size // IMAGE_COLUMNS)
