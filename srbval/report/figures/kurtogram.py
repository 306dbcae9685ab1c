"""A kurtogram: how impulsive each band is, with the band that is used drawn into it."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from srbval.arrays import FloatArray
from srbval.report.figures.style import HALF, new_axes, panel, stamp_stand_in, title_panel
from srbval.report.findings.records import RecordKurtogram
from srbval.signal import Kurtogram

USED, BEST = "#ffffff", "#d62728"


@panel()
def kurtogram_panel(
    shown: RecordKurtogram, *, letter: str, title: str, top_hz: float
) -> tuple[Any, Mapping[str, ArrayLike]]:
    """Kurtosis over level and frequency, up to `top_hz`; the band used outlined white, the most impulsive one red."""
    picture, recording, band_hz = shown.kurtogram, shown.analysis.recording, shown.analysis.processed.band_hz
    rows = np.unique(picture.level)
    figure, axes = new_axes(HALF)
    axes.grid(False)
    drawn = _draw(axes, picture, rows)
    widths = [float(np.diff(picture.band_hz[picture.level == level]).max()) for level in rows]
    top_khz = min(top_hz, recording.fs_hz / 2) / 1e3
    axes.set(xlim=(0, top_khz), ylim=(len(rows) - 0.5, -0.5), xlabel="Frequency, kHz", ylabel="Band width, Hz")
    axes.set_yticks(range(len(rows)), labels=[f"{width:.0f}" for width in widths])
    axes.tick_params(axis="y", labelsize=6.5)
    _outline(axes, picture.best_hz, _row(rows, widths, picture.best_hz), BEST, ":")
    _outline(axes, band_hz, _row(rows, widths, band_hz), USED, "-")
    bar = figure.colorbar(drawn, ax=axes, pad=0.02, aspect=18)
    bar.set_label("Kurtosis less 2", fontsize=7.5)
    bar.ax.tick_params(labelsize=7.5)
    title_panel(axes, recording.origin, letter, title, pad=6.0)
    stamp_stand_in(axes, recording.origin)
    return figure, {
        "low_hz": picture.band_hz[:, 0],
        "high_hz": picture.band_hz[:, 1],
        "kurtosis_less_2": picture.kurtosis,
        "scatter_of_noise": picture.scatter,
    }


def _draw(axes: Any, picture: Kurtogram, rows: FloatArray) -> Any:
    from matplotlib.collections import PolyCollection

    at = np.searchsorted(rows, picture.level)
    corners = [
        [(low / 1e3, y - 0.5), (high / 1e3, y - 0.5), (high / 1e3, y + 0.5), (low / 1e3, y + 0.5)]
        for (low, high), y in zip(picture.band_hz, at, strict=True)
    ]
    cells = PolyCollection(corners, array=picture.kurtosis, cmap="viridis", edgecolors="face", linewidths=0.2)
    cells.set_clim(min(0.0, float(picture.kurtosis.min())), max(float(picture.kurtosis.max()), 1e-3))
    axes.set_facecolor("#d5d8dc")  # not computed: bands that begin at zero
    return axes.add_collection(cells)


def _row(rows: FloatArray, widths: list[float], band_hz: tuple[float, float]) -> float:
    """Where a band of any width belongs, between the rows of the widths above and below its own."""
    ratio = np.log2(np.array(widths))
    return float(np.interp(-math.log2(band_hz[1] - band_hz[0]), -ratio, np.arange(rows.size)))


def _outline(axes: Any, band_hz: tuple[float, float], row: float, colour: str, style: str) -> None:
    from matplotlib.patches import Rectangle

    low, high = (edge / 1e3 for edge in band_hz)
    look: dict[str, Any] = {"fill": False, "zorder": 6, "clip_on": False}
    axes.add_patch(Rectangle((low, row - 0.5), high - low, 1.0, edgecolor="black", lw=2.4, **look))
    axes.add_patch(Rectangle((low, row - 0.5), high - low, 1.0, edgecolor=colour, lw=1.3, ls=style, **look))
