"""One picture of a record: the signal with its envelope in time, above its envelope spectrum with the lines marked."""

from collections.abc import Sequence
from typing import Any

from srbval.arrays import FloatArray
from srbval.report.figures.acceleration import draw_acceleration
from srbval.report.figures.spectrum import ORDER_LABEL_POINTS, Cursor, draw_envelope_spectrum
from srbval.report.figures.style import figure_style, legend_above, new_figure, stamp_stand_in, title_panel

INCHES = (7.6, 5.4)
HEAD_ROOM, LABEL_ROOM, LEAST_HZ = 1.12, 2.0, 1.0


def highest_shown(frequency_hz: FloatArray, amplitude: FloatArray, f_max_hz: float) -> float:
    """The highest amplitude above the slow trend at the very start of a spectrum."""
    return float(amplitude[(frequency_hz > LEAST_HZ) & (frequency_hz <= f_max_hz)].max())


def record_picture(
    *,
    time: tuple[FloatArray, FloatArray, FloatArray],
    spectrum: tuple[FloatArray, FloatArray],
    healthy: tuple[FloatArray, FloatArray] | None,
    cursors: Sequence[Cursor],
    peaks: Sequence[tuple[float, float]],
    shaft_hz: float,
    f_max_hz: float,
    origin: str,
    title: str,
    unit: str,
) -> Any:
    """The figure: `time` is (time [s], acceleration, envelope), the spectra (frequency [Hz], amplitude), all [n]."""
    shown = (spectrum,) if healthy is None else (spectrum, healthy)
    top = LABEL_ROOM * max(highest_shown(*one, f_max_hz) for one in shown)
    with figure_style():
        figure = new_figure(INCHES)
        upper, lower = figure.subplots(2, 1, height_ratios=(1.0, 1.5))
        draw_acceleration(upper, *time, origin=origin, y_label=f"Acceleration, {unit}")
        limit = HEAD_ROOM * float(max(abs(time[1]).max(), time[2].max()))
        upper.set(xlim=(0, 1e3 * float(time[0][-1])), ylim=(-limit, limit))
        draw_envelope_spectrum(
            lower, frequency_hz=spectrum[0], amplitude=spectrum[1], shaft_hz=shaft_hz, origin=origin, cursors=cursors,
            peaks=peaks, healthy=healthy, f_max_hz=f_max_hz, y_limits=(0.0, top), y_label=f"Envelope, {unit}",
        )  # fmt: skip
        title_panel(upper, origin, "", title)
        title_panel(lower, origin, "", "envelope spectrum", pad=9.0)
        legend_above(upper)
        legend_above(lower, points=ORDER_LABEL_POINTS)
        for axes in (upper, lower):
            stamp_stand_in(axes, origin)
    return figure
