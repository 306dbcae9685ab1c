"""Scalogram: modulus of the complex Morlet transform over time and frequency, at figure resolution.

The wavelet's spectrum is a Gaussian in closed form, so each row is one inverse transform, sampled no finer than the row
needs.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy.fft

from srbval.arrays import ComplexArray, FloatArray
from srbval.errors import ConfigurationError

# Morlet wavelet exp(-t^2 / B) exp(2 i pi t), in periods of its row: short enough to separate the impulses of a
# fault, at a relative bandwidth (one standard deviation) of 1 / (pi sqrt(2 B)), some 18 %.
BANDWIDTH = 1.5
# Above this share of the sampling rate a row has fewer than three samples per period and even tones fail.
LARGEST_SHARE = 0.35
ROWS, COLUMNS = 120, 800
# The wavelet's spectrum is cut this many standard deviations from its middle: exp(-18) of its peak.
_SIGMAS = 6.0
# A row's modulus is sampled at least this often per column, and per reciprocal width of the lines that it keeps.
_PER_COLUMN, _PER_WIDTH = 8, 1.5


@dataclass(frozen=True, kw_only=True, eq=False)
class Scalogram:
    """Amplitude, shape [rows, columns], in the unit of the signal; a sine of amplitude a reads a in its row.

    `time_s`, [columns], are the middles of the columns, each the mean of the samples in it; `frequency_hz`,
    [rows], rises in equal ratios. Nearer than `edge_s`, [rows], to either end a row is affected by the ends.
    """

    time_s: FloatArray
    frequency_hz: FloatArray
    amplitude: FloatArray
    edge_s: FloatArray


def column_width(samples: int, columns: int) -> int:
    """Samples per column, so that `samples` make at most `columns` of them; a length that transforms fast."""
    return int(scipy.fft.next_fast_len(math.ceil(samples / columns), real=True))


def check_range(range_hz: tuple[float, float], fs_hz: float, seconds: float) -> None:
    """Refuse rows that the record is too short or too coarsely sampled for (`ConfigurationError`)."""
    low, high = range_hz
    lowest, highest = 2 * math.sqrt(BANDWIDTH) / seconds, LARGEST_SHARE * fs_hz
    if not lowest <= low < high <= highest:
        raise ConfigurationError(
            f"scalogram from {low:g} to {high:g} Hz: a record of {seconds:.3g} s at {fs_hz:g} Hz allows "
            f"{lowest:.3g} to {highest:g} Hz; narrow the range or use a longer record."
        )


def morlet_scalogram(
    samples: FloatArray,
    fs_hz: float,
    *,
    range_hz: tuple[float, float],
    rows: int = ROWS,
    columns: int = COLUMNS,
) -> Scalogram:
    """Complex-Morlet scalogram of `samples` [n], the transform of the paper's Figure 14 in closed form.

    One real transform of the record; for each row the bins under the wavelet's spectrum are shifted down to zero and
    transformed back. The modulus is that of the direct sum of samples times wavelet to 1e-7 of its largest value. A
    column is the mean over the column's time, exactly that of its samples where a row needs them all; the last one may
    reach beyond the record. The record's ends wrap round within `edge_s`. Raises `ConfigurationError` where `range_hz`
    leaves what the record allows.
    """
    check_range(range_hz, fs_hz, samples.size / fs_hz)
    frequency = np.geomspace(*range_hz, rows)
    width = column_width(samples.size, columns)
    shown = math.ceil(samples.size / width)
    # Zeros keep one end from wrapping into the other; the padded record is a whole number of columns.
    pad = math.ceil(_SIGMAS * math.sqrt(BANDWIDTH) / range_hz[0] * fs_hz)
    padded = scipy.fft.next_fast_len(math.ceil((samples.size + pad) / width))
    lines = scipy.fft.rfft(samples, n=padded * width)
    image = np.empty((rows, shown))
    for row, centre_hz in enumerate(frequency):
        inside, first = _under_wavelet(lines, padded * width, float(centre_hz) * padded * width / fs_hz)
        image[row] = _columns(inside, first, padded, width)[:shown]
    return Scalogram(
        time_s=((np.arange(shown, dtype=np.float64) + 0.5) * width - 0.5) / fs_hz,
        frequency_hz=frequency,
        amplitude=image,
        edge_s=math.sqrt(BANDWIDTH) / frequency,
    )


def _under_wavelet(lines: ComplexArray, length: int, centre: float) -> tuple[ComplexArray, int]:
    """The bins under one row's Gaussian, weighted, and the number of the first; `centre` in bins.

    Beyond the Nyquist frequency the spectrum of a sampled record is mirrored; a sampled wavelet sees that too.
    """
    sigma = centre / (math.pi * math.sqrt(2 * BANDWIDTH))
    first = max(1, math.ceil(centre - _SIGMAS * sigma))  # the mean, bin 0, is no vibration
    number = np.arange(first, min(length - 1, math.floor(centre + _SIGMAS * sigma)) + 1)
    mirrored = number >= lines.size
    inside = lines[np.where(mirrored, length - number, number)]
    inside[mirrored] = np.conj(inside[mirrored])
    gain = np.exp(-0.5 * ((number - centre) / sigma) ** 2)
    return inside * (gain * 2 / length), first


def _columns(lines: ComplexArray, first: int, padded: int, width: int) -> FloatArray:
    """Means of the modulus over all `padded` columns of `width` samples, from instants spread evenly in each."""
    instants = min(width, max(_PER_COLUMN, math.ceil(_PER_WIDTH * lines.size / padded)))
    count = instants * padded
    # The instants lie in the middles of equal parts of the column's time, which begins half a sample before it.
    start = 0.5 / instants - 0.5 / width
    rotated = lines * np.exp((2j * np.pi * start / padded) * (first + np.arange(lines.size)))
    modulus = np.abs(scipy.fft.ifft(rotated, n=count)) * count
    means: FloatArray = modulus.reshape(padded, instants).mean(axis=1)
    return means
