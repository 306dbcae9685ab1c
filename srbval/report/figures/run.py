"""One picture of a run: acceleration in time, its spectrum, and the cage's speed over the shaft's."""

from typing import Any

import numpy as np
import scipy.signal

from srbval.arrays import FloatArray
from srbval.report.figures.files import extreme_indices
from srbval.report.figures.style import BLUE, figure_style, new_figure, origin_style, title_panel

INCHES = (7.6, 6.0)
PLOTTED_BINS = 900
SEGMENT_HZ = 10.0  # resolution of the spectrum
LEAST_REACH = 1e-3  # of the cage speed's axis, as a share of its mean: rounding is not drawn as a movement


def run_picture(time_s: FloatArray, acceleration_m_s2: FloatArray, cage_ratio: FloatArray, *, title: str) -> Any:
    """The figure of time [s], acceleration and cage speed over shaft speed, all [n] and evenly spaced."""
    rate = 1 / float(time_s[1] - time_s[0])
    hz, power = scipy.signal.welch(acceleration_m_s2, rate, nperseg=min(round(rate / SEGMENT_HZ), time_s.size))
    level = 10 * np.log10(np.maximum(power[1:], np.finfo(float).tiny))
    kept = extreme_indices(acceleration_m_s2, PLOTTED_BINS)
    look = {"color": origin_style("simulated").colour, "lw": 0.8}
    with figure_style():
        figure = new_figure(INCHES)
        upper, middle, lower = figure.subplots(3, 1, height_ratios=(1.2, 1.2, 0.7))
        upper.plot(time_s[kept], acceleration_m_s2[kept], **look)
        upper.set(xlabel="Time, s", ylabel="Acceleration, m/s²", xlim=(time_s[0], time_s[-1]))
        middle.plot(hz[1:] / 1e3, level, **look)
        middle.set(xlabel="Frequency, kHz", ylabel="dB re 1 (m/s²)²/Hz", xlim=(0, rate / 2e3))
        middle_ratio = float(np.mean(cage_ratio))
        reach = max(LEAST_REACH * middle_ratio, 1.1 * float(np.abs(cage_ratio - middle_ratio).max()))
        lower.plot(time_s, cage_ratio, color=BLUE, lw=0.9)
        lower.set(xlabel="Time, s", ylabel="Cage over shaft", xlim=(time_s[0], time_s[-1]))
        lower.set_ylim(middle_ratio - reach, middle_ratio + reach)
        lower.ticklabel_format(useOffset=False)
        title_panel(upper, "simulated", "", title, pad=6.0)
    return figure
