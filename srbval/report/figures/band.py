"""Spectra before demodulation, with the band that is demodulated shaded."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from srbval.report.figures.files import PanelFiles, rounded, save_panel
from srbval.report.figures.style import (
    BLUE,
    GREEN,
    HEALTHY,
    VERMILION,
    WIDE,
    figure_style,
    legend_above,
    new_axes,
    origin_style,
    stamp_stand_in,
    title_panel,
)

COLOURS = (BLUE, VERMILION)
HEALTHY_LOOK = {"color": HEALTHY, "ls": (0, (3, 1.2))}
Y_LABEL = "Power density, dB re 1/Hz"


def band_panel(
    folder: Path,
    name: str,
    *,
    frequency_hz: ArrayLike,
    levels_db: Mapping[str, ArrayLike],
    band_hz: tuple[float, float],
    limits_db: tuple[float, float],
    f_max_hz: float,
    origin: str,
    letter: str = "",
    y_label: str = Y_LABEL,
) -> PanelFiles:
    """Draw one level [dB] for each state over frequency; shade `band_hz`; write picture and CSV.

    At most two besides the healthy one, whose name begins so; one alone in the colour of its origin.

    Give both sides of a comparison the same `limits_db` and `f_max_hz`.
    """
    frequency = np.asarray(frequency_hz, dtype=float)
    with figure_style():
        figure, axes = new_axes(WIDE)
        axes.axvspan(band_hz[0] / 1e3, band_hz[1] / 1e3, color=GREEN, alpha=0.16, lw=0, zorder=0)
        right = band_hz[0] > f_max_hz / 2
        axes.text(
            band_hz[right] / 1e3, limits_db[1], f" demodulated: {band_hz[0]:g} to {band_hz[1]:g} Hz ", color=GREEN,
            fontsize=8, va="top", ha="right" if right else "left", zorder=9,
        )  # fmt: skip
        alone = sum(not state.startswith("healthy") for state in levels_db) == 1
        colours = iter((origin_style(origin).colour,) if alone else COLOURS)
        for state, level in levels_db.items():
            look = HEALTHY_LOOK if state.startswith("healthy") else {"color": next(colours)}
            axes.plot(frequency / 1e3, np.asarray(level), **look, lw=0.9, label=state)
        axes.set(xlabel="Frequency, kHz", ylabel=y_label, ylim=limits_db, xlim=(0, f_max_hz / 1e3))
        title_panel(axes, origin, letter, "spectra before demodulation", pad=9.0)
        legend_above(axes)
        stamp_stand_in(axes, origin)
        columns = {state.replace(" ", "_") + "_db": rounded(np.asarray(v)) for state, v in levels_db.items()}
        return save_panel(figure, folder, name, {"frequency_hz": frequency} | columns)
