"""Which rollers carry the load: contact force against the angle from the load's direction."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from srbval.arrays import FloatArray
from srbval.report.figures.files import PanelFiles, save_panel
from srbval.report.figures.style import BLUE, SOFT, VERMILION, figure_style, legend_above, new_axes

STRETCH_DEG = 12.0
LIGHT = "#a9cfe6"


def _means(angle: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Middles of stretches of `STRETCH_DEG` and the mean force in each."""
    edges = np.arange(-180.0, 180.0 + STRETCH_DEG, STRETCH_DEG)
    count, _ = np.histogram(angle, edges)
    total, _ = np.histogram(angle, edges, weights=force)
    return (edges[:-1] + edges[1:]) / 2, total / np.maximum(count, 1)


def load_zone(folder: Path, name: str, *, angle_deg: ArrayLike, outer_n: ArrayLike, inner_n: ArrayLike) -> PanelFiles:
    """Draw the force of every roller on either race at every moment kept, arrays [n]; write picture and CSV.

    `angle_deg` counts from the middle of the load zone, -180 to 180.
    """
    angle, outer, inner = (np.asarray(values, dtype=float) for values in (angle_deg, outer_n, inner_n))
    order = np.argsort(angle)
    angle, outer, inner = angle[order], outer[order] / 1e3, inner[order] / 1e3
    with figure_style():
        figure, axes = new_axes("wide")
        middles, means = _means(angle, outer)
        axes.plot(angle, outer, ".", color=LIGHT, ms=1.5, label="one roller, one moment", rasterized=True)
        axes.plot(middles, means, "-o", color=BLUE, ms=3, label="mean, outer race")
        axes.plot(middles, _means(angle, inner)[1], "--", color=VERMILION, label="mean, inner race")
        axes.axvline(0, color=SOFT, lw=0.8, ls="--")
        axes.set(xlabel="Roller's angle from the middle of the load zone, degrees", ylabel="Contact force, kN",
                 xlim=(-180, 180), xticks=range(-180, 181, 60))  # fmt: skip
        axes.set_ylim(0, 1.1 * float(np.quantile(outer, 0.995)))
        legend_above(axes)
        columns = {"angle_deg": angle, "outer_race_n": 1e3 * outer, "inner_race_n": 1e3 * inner}
        return save_panel(figure, folder, name, columns)
