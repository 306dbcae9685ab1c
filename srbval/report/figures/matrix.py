"""The validation matrix as a picture: speeds across, state and load down, empty where nothing was measured."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval.report.figures.files import PanelFiles, save_panel
from srbval.report.figures.style import INK, SOFT, figure_style, new_figure

CELL_INCHES = (0.56, 0.3)
FRAME_INCHES = (2.0, 1.5)


@dataclass(frozen=True, kw_only=True)
class HeatMap:
    """One map: `values`, shape [rows, columns], NaN where there is nothing; `texts` are written into the cells.

    `limits` are the ends of the colour scale, named by `label` (without one no scale is drawn);
    `colours` is a Matplotlib colour map, diverging
    about zero or rising.
    """

    values: NDArray[np.float64]
    texts: Sequence[Sequence[str]]
    label: str
    limits: tuple[float, float]
    colours: str

    def __post_init__(self) -> None:
        if self.values.shape != (len(self.texts), len(self.texts[0])):
            raise ValueError(f"heat map of {self.values.shape} values has other texts: they must match.")


def heat_map(
    folder: Path, name: str, *, shown: HeatMap, rows: Sequence[str], columns: Sequence[str], groups: int
) -> PanelFiles:
    """Draw the map with a rule after every `groups` rows; write picture and CSV. Empty cells stay blank."""
    with figure_style():
        figure, axes = _axes(len(rows), len(columns))
        masked = np.ma.masked_invalid(shown.values)
        image = axes.pcolormesh(
            masked, cmap=shown.colours, vmin=shown.limits[0], vmax=shown.limits[1], edgecolors="#c5ced8", linewidth=0.5
        )
        _write(axes, shown)
        for row in range(groups, len(rows), groups):
            axes.axhline(row, color=INK, lw=0.9)
        axes.set_xticks(np.arange(len(columns)) + 0.5, labels=columns)
        axes.set_yticks(np.arange(len(rows)) + 0.5, labels=rows)
        axes.set(xlabel="Nominal motor speed, rpm", ylim=(len(rows), 0))
        axes.tick_params(length=0)
        axes.grid(visible=False)
        if shown.label:
            figure.colorbar(image, ax=axes, label=shown.label, shrink=0.75, pad=0.02, extend="both")
        return save_panel(figure, folder, name, _table(shown, rows, columns))


def _axes(rows: int, columns: int) -> tuple[Any, Any]:
    size = (FRAME_INCHES[0] + CELL_INCHES[0] * columns, FRAME_INCHES[1] + CELL_INCHES[1] * rows)
    figure = new_figure(size)
    return figure, figure.add_subplot()


def _write(axes: Any, shown: HeatMap) -> None:
    """The values as text, dark on light and light on dark, so that the map reads without its colours."""
    from matplotlib import colormaps
    from matplotlib.colors import Normalize

    scale, colours = Normalize(*shown.limits, clip=True), colormaps[shown.colours]
    for row, texts in enumerate(shown.texts):
        for column, text in enumerate(texts):
            value = shown.values[row, column]
            red, green, blue, _ = colours(scale(value)) if np.isfinite(value) else (1, 1, 1, 1)
            dark = 0.3 * red + 0.59 * green + 0.11 * blue < 0.5
            axes.text(column + 0.5, row + 0.5, text, ha="center", va="center", fontsize=7,
                      color="white" if dark else INK if np.isfinite(value) else SOFT)  # fmt: skip


def _table(shown: HeatMap, rows: Sequence[str], columns: Sequence[str]) -> dict[str, Any]:
    return {"point": list(rows)} | {f"rpm_{c}": shown.values[:, i] for i, c in enumerate(columns)}
