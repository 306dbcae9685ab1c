"""Scalogram: modulus of the complex Morlet transform (PyWavelets) over time and frequency, at figure resolution."""

import math
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.errors import ConfigurationError

# Morlet wavelet exp(-x^2 / B) exp(2 i pi x), x in periods of its row: short enough to separate the impulses of a
# fault, at a relative bandwidth (one standard deviation) of 1 / (pi sqrt(2 B)), some 18 %.
BANDWIDTH = 1.5
# The wavelet is cut off this many periods from its middle, at 6e-8 of its peak.
REACH = 5
# pywt picks the nearest of 2^precision points of the wavelet; at its default of 12 the low rows get steps.
PRECISION = 18
# Above this share of the sampling rate a row's wavelet has too few samples.
LARGEST_SHARE = 0.1
ROWS, COLUMNS = 120, 800


@dataclass(frozen=True, kw_only=True, eq=False)
class Scalogram:
    """Amplitude, shape [rows, columns], in the unit of the signal; a sine of amplitude a reads a in its row.

    `time_s`, [columns], are the middles of the columns, each the mean of the samples in it; `frequency_hz`,
    [rows], rises in nearly equal ratios. Nearer than `edge_s`, [rows], to either end a row is affected by the ends.
    """

    time_s: FloatArray
    frequency_hz: FloatArray
    amplitude: FloatArray
    edge_s: FloatArray


def morlet_scalogram(
    samples: FloatArray, fs_hz: float, *, range_hz: tuple[float, float], rows: int = ROWS, columns: int = COLUMNS
) -> Scalogram:
    """Complex-Morlet scalogram of `samples` [n], as in the paper's Figure 14, with at most `rows` and `columns`.

    For a stretch of some thousand samples: ``pywt.cwt`` transforms it whole for every row. It draws a row half a sample
    off where its wavelet has an odd number of samples, and low by sin(x)/x, x = pi f / fs, since it differences an
    integrated wavelet: so rows stand at the nearest frequencies whose wavelet is sampled symmetrically, and are divided
    by that. Raises `ConfigurationError` where the record is too short or too coarsely sampled for `range_hz`.
    """
    import pywt

    low, high = range_hz
    lowest, highest = 2 * math.sqrt(BANDWIDTH) / (samples.size / fs_hz), LARGEST_SHARE * fs_hz
    if not lowest <= low < high <= highest:
        raise ConfigurationError(
            f"scalogram from {low:g} to {high:g} Hz: a record of {samples.size / fs_hz:.3g} s at {fs_hz:g} Hz allows "
            f"{lowest:.3g} to {highest:g} Hz; narrow the range or use a longer record."
        )
    # A wavelet of an odd number of sampling intervals has its middle between two samples of its integral.
    intervals = 2 * np.rint(REACH * fs_hz / np.geomspace(low, high, rows) - 0.5) + 1
    scales = np.unique(intervals)[::-1] / (2 * REACH)
    wavelet = pywt.ContinuousWavelet(f"cmor{BANDWIDTH}-1.0")
    wavelet.lower_bound, wavelet.upper_bound = -REACH, REACH
    lines, _ = pywt.cwt(samples, scales, wavelet, method="fft", precision=PRECISION)
    amplitude = np.abs(lines) * (2 / (np.sqrt(scales) * np.sinc(1 / scales)))[:, None]
    first = np.arange(0, samples.size, math.ceil(samples.size / columns))
    count = np.diff(np.append(first, samples.size))
    return Scalogram(
        time_s=(first + (count - 1) / 2) / fs_hz,
        frequency_hz=fs_hz / scales,
        amplitude=np.add.reduceat(amplitude, first, axis=1) / count,
        edge_s=math.sqrt(BANDWIDTH) * scales / fs_hz,
    )
