"""What Figures 11 to 14 show of each record: signal and envelope, spectra and scalogram, ready to be drawn."""

from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.signal import Scalogram, morlet_scalogram
from srbval.signal.scalogram import COLUMNS, ROWS
from srbval.validation.analyse import Analysis

WINDOW_S = (0.3, 0.5)  # shown in Figures 11 and 14: two to three shaft turns, clear of the filter's ends
SCALOGRAM_HZ = (40.0, 1000.0)  # shown in Figure 14
# What draws it, of the transforms that `tests/calibrators/scalogram_check.py` tries; the largest error allowed there.
SCALOGRAM_TRANSFORM, SCALOGRAM_ERROR = "closed-form Morlet", 0.005
SEGMENT_HZ = 20.0  # resolution of the Welch spectra: fine enough for resonances, coarse enough to smooth the rest


@dataclass(frozen=True, kw_only=True, eq=False)
class ShownRecord:
    """One record's arrays for figures; amplitudes in standard deviations of the band-passed signal.

    `time_s`, `acceleration` and `envelope` lie within `WINDOW_S`; `frequency_hz` and `amplitude` are the whole envelope
    spectrum, `peaks` the name, frequency [Hz] and amplitude of its detected lines; `power_hz` and `power_db`
    [dB re 1/Hz] a Welch spectrum of the normalised acceleration before demodulation.
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


@dataclass(frozen=True, kw_only=True)
class SidebandShares:
    """Sidebands of the inner-race line at one and two shaft speeds, mean of both sides, as shares of the line."""

    at_one: float
    at_two: float


def envelope_scalogram(shown: ShownRecord) -> Scalogram:
    """The wavelet transform of the envelope shown."""
    envelope, fs_hz = shown.envelope - shown.envelope.mean(), shown.analysis.processed.fs_hz
    return morlet_scalogram(envelope, fs_hz, range_hz=SCALOGRAM_HZ, rows=ROWS, columns=COLUMNS)


def sideband_shares(analysis: Analysis) -> SidebandShares | None:
    """None where the inner-race line was not read."""
    line_hz, shaft_hz = analysis.line("BPFI").found_hz, analysis.speed.value_hz
    if line_hz is None:
        return None
    spectrum = analysis.processed.spectrum
    line, *sides = (
        _height_at(line_hz + times * shaft_hz, spectrum.frequency_hz, spectrum.amplitude) for times in (0, -1, 1, -2, 2)
    )
    return SidebandShares(at_one=(sides[0] + sides[1]) / 2 / line, at_two=(sides[2] + sides[3]) / 2 / line)


def shown_record(analysis: Analysis) -> ShownRecord:
    """The arrays of one record."""
    from scipy.signal import welch

    shown = analysis.processed
    spread = float(np.std(shown.filtered))
    time = np.arange(len(shown.filtered)) / shown.fs_hz
    inside = (time >= WINDOW_S[0]) & (time <= WINDOW_S[1])
    envelope = shown.envelope[inside] / spread
    frequency, amplitude = shown.spectrum.frequency_hz, shown.spectrum.amplitude / spread
    power_hz, power = welch(shown.samples, shown.fs_hz, nperseg=round(shown.fs_hz / SEGMENT_HZ))
    return ShownRecord(
        analysis=analysis,
        time_s=time[inside],
        acceleration=shown.filtered[inside] / spread,
        envelope=envelope,
        frequency_hz=frequency,
        amplitude=amplitude,
        peaks=tuple(
            (line.name, line.found_hz, _height_at(line.found_hz, frequency, amplitude))
            for line in analysis.lines
            if line.detected and line.found_hz is not None
        ),
        power_hz=power_hz[1:],
        power_db=10 * np.log10(np.maximum(power[1:], np.finfo(float).tiny)),
    )


def _height_at(line_hz: float, frequency: FloatArray, amplitude: FloatArray) -> float:
    """Height of a line: the larger of the two bins it lies between."""
    return float(amplitude[np.argsort(np.abs(frequency - line_hz))[:2]].max())
