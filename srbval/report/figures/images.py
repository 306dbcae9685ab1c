"""Images of wavelet transforms over time and frequency, as in the paper's Figure 14, and thumbnails of figures."""

from collections import defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.report.figures import style
from srbval.report.figures.style import ORIGINS, PanelData, panel
from srbval.report.findings.records import RecordView

IMAGE_COLUMNS, IMAGE_ROWS, COLOUR_LEVELS = 320, 110, 64
SCALOGRAM_CSV_TIMES, SCALOGRAM_CSV_FREQUENCIES = 180, 40
THUMBNAIL_INCHES, THUMBNAIL_BINS = (3.4, 1.45), 220  # size [inch]; stretches of a curve


@panel
def thumbnail(sides: Sequence[RecordView], kind: str, end_hz: float, top: float) -> PanelData:
    """Draw a thumbnail of a figure without axis labels: model left, rig right (`sides`), on the same axes.

    `kind` is ``scalogram``, ``spectrum`` (up to `end_hz`) or ``acceleration``. `top` is the end of a scalogram's colour
    scale, otherwise of the amplitude axis.
    """
    figure, columns = style.new_figure(THUMBNAIL_INCHES), defaultdict[str, list[Any]](list)
    for axes, record in zip(figure.subplots(1, 2), sides, strict=True):
        word, colour, light = ORIGINS[record.origin]
        if kind == "scalogram":
            x, shown = _on_log_grid(record.scalogram.frequency_hz, record.scalogram.amplitude)
            axes.imshow(shown, origin="lower", aspect="auto", vmin=0.0, vmax=top, cmap="viridis")
            y = shown.mean(axis=1)
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


@panel
def scalogram_panel(record: RecordView, state: Fault, *, top: float, letter: str = "", title: str = "") -> PanelData:
    """Draw the wavelet magnitude of a record's envelope over time and logarithmic frequency, coloured from 0 to `top`.

    The fault frequency of the bearing state `state` is marked. The regions that the ends of the record distort (cone of
    influence) are hatched.
    """
    from matplotlib import colormaps

    image, (start, stop) = record.scalogram, record.window_s
    time = image.time_s + start
    inside = (time >= start) & (time <= stop)
    frequency, shown = _on_log_grid(image.frequency_hz, image.amplitude[:, inside])
    span = (0.0, (stop - start) * 1e3)
    axes = style.new_axes(style.HALF)
    axes.grid(False)
    extent = (*span, *np.log10(frequency[[0, -1]]))
    look = {"cmap": colormaps["viridis"].resampled(COLOUR_LEVELS), "interpolation": "none", "aspect": "auto"}
    drawn = axes.imshow(shown, origin="lower", extent=extent, vmin=0.0, vmax=top, **look)
    axes.set(xlabel="Time, ms", ylabel="Frequency, Hz")
    ticks = [hz for k in range(-1, 6) for m in (1, 2, 5) if frequency[0] <= (hz := m * 10.0**k) <= frequency[-1]]
    axes.set_yticks(np.log10(ticks), labels=[f"{hz:g}" for hz in ticks])
    axes.tick_params(direction="out")
    level, edge_ms = np.log10(image.frequency_hz), image.edge_s * 1e3
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
    return axes.figure, _scalogram_csv(shown, frequency, span)


def _on_log_grid(frequency: FloatArray, magnitude: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Resample a scalogram for drawing: frequencies with equal ratios, and averages over neighbouring times."""
    order = np.argsort(frequency)
    logs = np.log(frequency[order])
    wanted = np.linspace(logs[0], logs[-1], min(IMAGE_ROWS, max(len(logs), 2)))
    columns = average_columns(magnitude[order], IMAGE_COLUMNS)
    return np.exp(wanted), np.apply_along_axis(lambda column: np.interp(wanted, logs, column), 0, columns)


def _scalogram_csv(image: FloatArray, frequency: FloatArray, span: tuple[float, float]) -> dict[str, FloatArray]:
    """Return a scalogram's CSV columns: time, and magnitude at every few frequencies; `span` is start and end [ms]."""
    rows = np.linspace(0, len(frequency) - 1, min(SCALOGRAM_CSV_FREQUENCIES, len(frequency))).round().astype(int)
    coarse = average_columns(image[rows], SCALOGRAM_CSV_TIMES)
    n = coarse.shape[1]
    names = [f"magnitude_at_{hz:.4g}_hz" for hz in frequency[rows]]
    return {"time_s": (np.arange(n) + 0.5) / n * span[1] / 1e3} | dict(zip(names, coarse, strict=True))


def average_columns(values: FloatArray, columns: int) -> FloatArray:
    """Average an array along its last axis in `columns` segments; an array with fewer columns is not changed."""
    n = values.shape[-1]
    if n <= columns:
        return values
    edges = np.linspace(0, n, columns + 1).astype(int)
    widths = np.diff(edges)
    return np.add.reduceat(values, edges[:-1], axis=-1) / widths
