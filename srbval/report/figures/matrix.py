"""The validation matrix as a picture: speeds across, state and load down, empty where nothing was measured."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.report.figures.files import PanelFiles, save_panel
from srbval.report.figures.style import INK, SOFT, figure_style, new_axes

CELL_INCHES = (0.56, 0.2)
FRAME_INCHES = (2.0, 1.0)


def heat_map(
    folder: Path,
    name: str,
    *,
    values: FloatArray,
    texts: Sequence[Sequence[str]],
    label: str,
    limits: tuple[float, float],
    colours: str,
    rows: Sequence[str],
    columns: Sequence[str],
    groups: int,
) -> PanelFiles:
    """Draw `values`, shape [rows, columns], NaN where there is nothing, with a rule after every `groups` rows.

    `texts`, of the same shape, are written into the cells. `limits` are the ends of the colour scale, named by `label`
    (without one no scale is drawn); `colours` is a Matplotlib colour map, diverging about zero or rising. Writes
    picture and CSV.
    """
    size = (FRAME_INCHES[0] + CELL_INCHES[0] * len(columns), FRAME_INCHES[1] + CELL_INCHES[1] * len(rows))
    with figure_style():
        figure, axes = new_axes(size)
        image = axes.pcolormesh(
            np.ma.masked_invalid(values), cmap=colours, vmin=limits[0], vmax=limits[1], edgecolors="#c5ced8",
            linewidth=0.5,
        )  # fmt: skip
        _write(axes, values, texts, image)
        for row in range(groups, len(rows), groups):
            axes.axhline(row, color=INK, lw=0.9)
        axes.set_xticks(np.arange(len(columns)) + 0.5, labels=columns)
        axes.set_yticks(np.arange(len(rows)) + 0.5, labels=rows)
        axes.set(xlabel="Nominal motor speed, rpm", ylim=(len(rows), 0))
        axes.tick_params(length=0)
        axes.grid(visible=False)
        if label:
            figure.colorbar(image, ax=axes, label=label, shrink=0.75, pad=0.02, extend="both")
        return save_panel(
            figure, folder, name, {"point": rows} | {f"rpm_{c}": values[:, i] for i, c in enumerate(columns)}
        )


def _write(axes: Any, values: FloatArray, texts: Sequence[Sequence[str]], image: Any) -> None:
    """The values as text, dark on light and light on dark, so that the map reads without its colours."""
    for (row, column), value in np.ndenumerate(values):
        red, green, blue, _ = image.to_rgba(value) if np.isfinite(value) else (1, 1, 1, 1)
        dark = 0.3 * red + 0.59 * green + 0.11 * blue < 0.5
        axes.text(column + 0.5, row + 0.5, texts[row][column], ha="center", va="center", fontsize=7,
                  color="white" if dark else INK if np.isfinite(value) else SOFT)  # fmt: skip
