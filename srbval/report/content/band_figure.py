"""Spectra of all states before demodulation, model above rig, with the bands that are demodulated."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import Fault
from srbval.recordings import Origin
from srbval.report.blocks import Explore, Figure, FigureGrid
from srbval.report.content.names import BADGE
from srbval.report.figures.band import band_panel
from srbval.validation.analyse import Analysis

FloatArray = NDArray[np.float64]
SEGMENT_HZ = 20.0  # resolution: fine enough for resonances, coarse enough to smooth the rest
RANGE_DB = 75.0  # shown below the highest level
Levels = tuple[FloatArray, dict[str, FloatArray]]


def band_figure(model: Mapping[Fault, Analysis], rig: Mapping[Fault, Analysis], folder: Path) -> FigureGrid:
    """Two panels on the same axes."""
    sides = {"model": model, "rig": rig}
    levels = {name: _levels(side) for name, side in sides.items()}
    top = max(float(level.max()) for _, states in levels.values() for level in states.values()) + 8.0
    reach = max(float(frequency[-1]) for frequency, _ in levels.values())
    panels = [
        _panel(name, letter, sides[name], levels[name], (top - RANGE_DB, top), reach, folder)
        for name, letter in (("model", "a"), ("rig", "b"))
    ]
    return FigureGrid(
        figures=tuple(panels), columns=1, label="Before demodulation",
        caption=f"Welch spectra ({SEGMENT_HZ:g} Hz resolution) of the normalised acceleration of all three states. "
        "Shaded: the band whose envelope the figures below show, the paper's choice for either side.",
    )  # fmt: skip


def _levels(side: Mapping[Fault, Analysis]) -> Levels:
    from scipy.signal import welch

    found: dict[str, FloatArray] = {}
    frequency = np.zeros(0)
    for state, analysis in side.items():
        shown = analysis.processed
        frequency, power = welch(shown.samples, shown.fs_hz, nperseg=round(shown.fs_hz / SEGMENT_HZ))
        found[state.label] = 10 * np.log10(np.maximum(power[1:], np.finfo(float).tiny))
    return frequency[1:], found


def _panel(
    name: str,
    letter: str,
    side: Mapping[Fault, Analysis],
    levels: Levels,
    limits_db: tuple[float, float],
    reach_hz: float,
    folder: Path,
) -> Figure:
    analysis = side[Fault.OUTER]
    frequency, states = levels
    synthetic = [s.label for s, a in side.items() if a.recording.origin is Origin.STAND_IN]
    origin = Origin.STAND_IN if synthetic else analysis.recording.origin
    band = analysis.processed.band_hz
    files = band_panel(
        folder, f"band-{name}", frequency_hz=frequency, levels_db=states, band_hz=band, limits_db=limits_db,
        f_max_hz=reach_hz, origin=origin.value, letter=letter,
    )  # fmt: skip
    remark = f" Synthetic stand-in: {', '.join(synthetic)}." if synthetic else ""
    return Figure(
        id=f"band-{name}", label=f"Spectra, {name}", file=files.picture, data=files.data, badge=BADGE[origin],
        synthetic=bool(synthetic), caption=f"Band {band[0]:g} to {band[1]:g} Hz.{remark}",
        alt=f"Power density over frequency of the {name}'s {', '.join(states)} records, the band from {band[0]:g} to "
        f"{band[1]:g} Hz shaded.",
        explore=Explore(
            x="frequency_hz", x_label="Frequency, Hz", y_label="Power density, dB re 1/Hz",
            curves={state.replace(" ", "_") + "_db": state for state in states},
        ),
    )  # fmt: skip
