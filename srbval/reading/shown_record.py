"""The arrays of one record that figures draw: a stretch in time, the envelope spectrum, the spectrum of the signal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.reading.analyse import Analysis
from srbval.signal import power_density

WINDOW_S = (0.3, 0.5)  # shown in Figures 11 and 14: two to three shaft turns, clear of the filter's ends
SEGMENT_HZ = 20.0  # resolution of the Welch spectra: fine enough for resonances, coarse enough to smooth the rest


@dataclass(frozen=True, kw_only=True, eq=False)
class ShownRecord:
    """One record's arrays for figures; amplitudes in standard deviations of the band-passed signal, or in its unit.

    `time_s`, `acceleration` and `envelope` lie within the window shown; `frequency_hz` and `amplitude` are the whole
    envelope spectrum, `peaks` the name, frequency [Hz] and amplitude of its detected lines; `power_hz` and `power_db`
    [dB re 1/Hz] a Welch spectrum of the acceleration before demodulation, normalised or in its unit.
    """

    analysis: Analysis
    time_s: FloatArray
    acceleration: FloatArray
    envelope: FloatArray
    frequency_hz: FloatArray
    amplitude: FloatArray
    peaks: tuple[tuple[str, float, float], ...]
    power_hz: FloatArray
    power_db: FloatArray


def shown_record(
    analysis: Analysis, *, window_s: tuple[float, float] = WINDOW_S, own_unit: bool = False
) -> ShownRecord:
    """The arrays of one record; with `own_unit` in the recording's unit instead of standard deviations."""
    shown = analysis.processed
    spread = 1 / shown.scale if own_unit else float(np.std(shown.filtered))
    time = np.arange(len(shown.filtered)) / shown.fs_hz
    inside = (time >= window_s[0]) & (time <= window_s[1])
    scale = shown.scale if own_unit else 1.0
    power_hz, power = power_density(shown.samples * scale, shown.fs_hz, 1 / SEGMENT_HZ)
    return ShownRecord(
        analysis=analysis,
        time_s=time[inside],
        acceleration=shown.filtered[inside] / spread,
        envelope=shown.envelope[inside] / spread,
        frequency_hz=shown.spectrum.frequency_hz,
        amplitude=shown.spectrum.amplitude / spread,
        peaks=tuple(
            (line.name, line.found_hz, shown.spectrum.height_at(line.found_hz) / spread)
            for line in analysis.lines
            if line.detected and line.found_hz is not None
        ),
        power_hz=power_hz[1:],
        power_db=10 * np.log10(np.maximum(power[1:], np.finfo(float).tiny)),
    )
