"""A record over time with its envelope (Figure 11's kind), and the spectra before demodulation with the band used."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from srbval.recordings import Origin
from srbval.report.figures.files import extreme_indices, rounded
from srbval.report.figures.style import (
    BLUE,
    GREEN,
    HALF,
    HEALTHY,
    INK,
    VERMILION,
    WIDE,
    legend_above,
    new_axes,
    origin_style,
    panel,
    stamp_stand_in,
    title_panel,
)
from srbval.report.findings.records import OWN_UNIT, RecordView

PLOTTED_BINS = 700
HEALTHY_LOOK = {"color": HEALTHY, "ls": (0, (3, 1.2))}


@panel()
def acceleration_panel(
    record: RecordView,
    *,
    limit: float,
    letter: str = "",
    title: str = "",
    period: tuple[str, float] | None = None,
    inches: tuple[float, float] = HALF,
) -> tuple[Any, Mapping[str, ArrayLike]]:
    """Acceleration (light) and envelope (strong) in the record's window, from -`limit` to `limit` in its unit.

    Give every panel of a figure the same `limit`. `period`, a name and its length [s], is drawn as a bar, to be
    compared with the spacing of the bursts.
    """
    figure, axes = new_axes(inches)
    kept = extreme_indices(record.acceleration, PLOTTED_BINS)
    draw_acceleration(axes, record, limit, kept)
    if period:
        _mark_period(axes, *period)
    title_panel(axes, record.origin, letter, title)
    legend_above(axes)
    stamp_stand_in(axes, record.origin)
    return figure, {
        "time_s": record.time_s[kept] - record.window_s[0],
        "acceleration_std": rounded(record.acceleration[kept]),
        "envelope_std": rounded(record.envelope[kept]),
    }


def draw_acceleration(axes: Any, record: RecordView, limit: float, kept: Any = slice(None)) -> None:
    """Draw acceleration and envelope of the samples `kept` onto given axes."""
    style, (start, stop) = origin_style(record.origin), record.window_s
    time_ms = (record.time_s[kept] - start) * 1e3
    axes.plot(time_ms, record.acceleration[kept], color=style.light, lw=0.6, label="acceleration")
    axes.plot(time_ms, record.envelope[kept], color=style.colour, lw=1.2, label="its envelope")
    axes.set(xlabel="Time, ms", ylabel=f"Acceleration, {record.unit}", xlim=(0, (stop - start) * 1e3),
             ylim=(-limit, limit))  # fmt: skip


def _mark_period(axes: Any, name: str, period_s: float) -> None:
    """A bar of one period at the lower left, with its name and length."""
    low, high = axes.get_ylim()
    level, start, period_ms = low + 0.07 * (high - low), 0.03 * axes.get_xlim()[1], 1e3 * period_s
    axes.errorbar(start + period_ms / 2, level, xerr=period_ms / 2, color=INK, lw=1.3, capsize=3, zorder=40)
    axes.text(
        start + period_ms + 0.015 * axes.get_xlim()[1], level, f"{name} = {period_ms:.2f} ms",
        va="center", fontsize=7.5, zorder=40,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1},
    )  # fmt: skip


@panel()
def band_panel(
    records: Mapping[str, RecordView], *, limits_db: tuple[float, float], end_hz: float, letter: str = ""
) -> tuple[Any, Mapping[str, ArrayLike]]:
    """One Welch spectrum for each of `records`, by what they are called; the last one's band is shaded.

    At most two besides the healthy one, whose name begins so; one alone in the colour of its origin. All are given at
    the same frequencies. Give both sides of a comparison the same `limits_db` and `end_hz`.
    """
    last = list(records.values())[-1]
    origins = [record.origin for record in records.values()]
    origin = Origin.STAND_IN if Origin.STAND_IN in origins else last.origin
    band_hz, right = last.analysis.processed.band_hz, last.analysis.processed.band_hz[0] > end_hz / 2
    figure, axes = new_axes(WIDE)
    axes.axvspan(band_hz[0] / 1e3, band_hz[1] / 1e3, color=GREEN, alpha=0.16, lw=0, zorder=0)
    axes.text(
        band_hz[right] / 1e3, limits_db[1], f" demodulated: {band_hz[0]:g} to {band_hz[1]:g} Hz ", color=GREEN,
        fontsize=8, va="top", ha="right" if right else "left", zorder=9,
    )  # fmt: skip
    alone = sum(not name.startswith("healthy") for name in records) == 1
    colours = iter((origin_style(origin).colour,) if alone else (BLUE, VERMILION))
    for name, record in records.items():
        look = HEALTHY_LOOK if name.startswith("healthy") else {"color": next(colours)}
        axes.plot(last.power_hz / 1e3, record.power_db, **look, lw=0.9, label=name)
    density = "1 (m/s²)²/Hz" if last.unit == OWN_UNIT else "1/Hz"
    axes.set(xlabel="Frequency, kHz", ylabel=f"Power density, dB re {density}", ylim=limits_db, xlim=(0, end_hz / 1e3))
    title_panel(axes, origin, letter, "spectra before demodulation", pad=9.0)
    legend_above(axes)
    stamp_stand_in(axes, origin)
    levels = {name.replace(" ", "_") + "_db": rounded(np.asarray(r.power_db)) for name, r in records.items()}
    return figure, {"frequency_hz": last.power_hz} | levels
