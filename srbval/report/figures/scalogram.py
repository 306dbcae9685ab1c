"""Figure 14's kind: the magnitude of the continuous wavelet transform over time and frequency."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from srbval.arrays import FloatArray
from srbval.report.figures.files import PanelFiles, rounded, save_panel
from srbval.report.figures.style import HALF, INK, figure_style, new_axes, row_above, stamp_stand_in, title_panel

COLUMNS, ROWS, LEVELS = 320, 110, 64
CSV_COLUMNS, CSV_ROWS = 180, 40


def scalogram_panel(
    folder: Path,
    name: str,
    *,
    time_s: ArrayLike,
    frequency_hz: ArrayLike,
    magnitude: ArrayLike,
    limits: tuple[float, float],
    origin: str,
    window_s: tuple[float, float],
    edge_s: FloatArray,
    letter: str = "",
    title: str = "",
    period_s: float | None = None,
    period_name: str = "",
    line_hz: float | None = None,
    line_name: str = "",
) -> PanelFiles:
    """Draw |CWT| as an image over time and logarithmic frequency; write picture and CSV.

    `magnitude` has shape [frequencies, times], `frequency_hz` [frequencies] is positive and monotonic,
    `time_s` [times] uniform. `limits` is the colour scale, shared by all panels of a figure. `period_s`
    (named `period_name`) puts ticks of that spacing along the top; `line_hz` marks one frequency. What lies
    nearer than `edge_s`, [frequencies], to either end of `window_s`, the cone of influence, is hatched.
    """
    time = np.asarray(time_s, dtype=float)
    start, stop = window_s
    inside = (time >= start) & (time <= stop)
    frequency, image = _on_log_grid(frequency_hz, np.asarray(magnitude, dtype=float)[:, inside])
    span = (0.0, (stop - start) * 1e3)
    with figure_style():
        figure, axes = new_axes(HALF)
        shown = _draw_image(axes, image, frequency, span, limits)
        axes.set(xlabel="Time, ms", ylabel="Frequency, Hz")
        _log_ticks(axes, frequency)
        _hatch_cone(axes, np.asarray(frequency_hz, dtype=float), edge_s, span)
        if line_hz:
            _mark_line(axes, line_hz, line_name, span)
        if period_s:
            _mark_periods(axes, period_s * 1e3, period_name, span)
        bar = figure.colorbar(shown, ax=axes, pad=0.02, aspect=18, extend="max")
        bar.set_label("|CWT|, std. dev.", fontsize=7.5)
        bar.ax.tick_params(labelsize=7.5)
        title_panel(axes, origin, letter, title, pad=20.0)
        stamp_stand_in(axes, origin)
        return save_panel(figure, folder, name, _columns(image, frequency, span))


def _on_log_grid(frequency_hz: ArrayLike, magnitude: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rows at equal ratios, low to high, and columns averaged to what the picture can show."""
    frequency = np.asarray(frequency_hz, dtype=float)
    order = np.argsort(frequency)
    logs = np.log(frequency[order])
    wanted = np.linspace(logs[0], logs[-1], min(ROWS, max(len(logs), 2)))
    columns = block_means(magnitude[order], COLUMNS)
    above = np.clip(np.searchsorted(logs, wanted), 1, len(logs) - 1)
    weight = ((wanted - logs[above - 1]) / (logs[above] - logs[above - 1]))[:, None]
    return np.exp(wanted), (1 - weight) * columns[above - 1] + weight * columns[above]


def _draw_image(
    axes: Any,
    image: FloatArray,
    frequency: FloatArray,
    span: tuple[float, float],
    limits: tuple[float, float],
) -> Any:
    from matplotlib import colormaps

    axes.grid(False)
    extent = (*span, float(np.log10(frequency[0])), float(np.log10(frequency[-1])))
    return axes.imshow(
        image, origin="lower", aspect="auto", extent=extent, vmin=limits[0], vmax=limits[1],
        cmap=colormaps["viridis"].resampled(LEVELS), interpolation="none",
    )  # fmt: skip


def _log_ticks(axes: Any, frequency: FloatArray) -> None:
    """Ticks at 1, 2, 5 of each decade, labelled in Hz, on an axis that is linear in log10."""
    candidates = [m * 10.0**k for k in range(-1, 6) for m in (1, 2, 5)]
    shown = [f for f in candidates if frequency[0] <= f <= frequency[-1]]
    axes.set_yticks(np.log10(shown), labels=[f"{f:g}" for f in shown])
    axes.tick_params(direction="out")


def _hatch_cone(axes: Any, frequency: FloatArray, edge_s: FloatArray, span: tuple[float, float]) -> None:
    """Hatch where a row also sees the ends of what was transformed; times [s] count from the picture's left edge."""
    level = np.log10(frequency)
    inner = (np.clip(edge_s * 1e3, *span), np.clip(span[1] - edge_s * 1e3, *span))
    for border, outer in zip(inner, span, strict=True):
        axes.fill_betweenx(level, border, outer, facecolor="none", edgecolor="white", hatch="////", lw=0.0)
        axes.plot(border, level, color="white", lw=0.8, scalex=False, scaley=False)


def _mark_line(axes: Any, line_hz: float, line_name: str, span: tuple[float, float]) -> None:
    level = float(np.log10(line_hz))
    axes.axhline(level, color="white", lw=0.8, ls="--")
    axes.text(span[1] / 2, level, line_name, color="white", fontsize=7.5, ha="center", va="bottom")  # clear of the cone


def _mark_periods(axes: Any, period_ms: float, period_name: str, span: tuple[float, float]) -> None:
    """Ticks of one period's spacing above the top edge, and what they mean above them."""
    at = np.arange(0.0, span[1], period_ms)
    blended = axes.get_xaxis_transform()
    axes.vlines(at, 1.012, 1.05, transform=blended, color=INK, lw=0.9, clip_on=False)
    label = f"ticks: {period_name} = {period_ms:.2f} ms"
    axes.text(1.0, 1.0, label, transform=row_above(axes, 8.0), fontsize=7.5, ha="right", va="baseline")


def _columns(image: FloatArray, frequency: FloatArray, span: tuple[float, float]) -> dict[str, FloatArray]:
    """The picture's values at a coarser grid: one row a time, one column a frequency, named by it [Hz]."""
    rows = np.linspace(0, len(frequency) - 1, min(CSV_ROWS, len(frequency))).round().astype(int)
    coarse = block_means(image[rows], CSV_COLUMNS)
    n = coarse.shape[1]
    time = (np.arange(n) + 0.5) / n * span[1] / 1e3
    lines = {f"magnitude_at_{f:.4g}_hz": rounded(row) for f, row in zip(frequency[rows], coarse, strict=True)}
    return {"time_s": time} | lines


def block_means(values: FloatArray, columns: int) -> FloatArray:
    """Means over `columns` equal stretches of the last axis; values unchanged when there are no more."""
    n = values.shape[-1]
    if n <= columns:
        return values
    edges = np.linspace(0, n, columns + 1).astype(int)
    widths = np.diff(edges)
    return np.add.reduceat(values, edges[:-1], axis=-1) / widths
