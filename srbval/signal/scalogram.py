"""Scalogram: modulus of the continuous wavelet transform over time and frequency, at figure resolution."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from srbval.errors import ConfigurationError

FloatArray = NDArray[np.float64]

# Morlet wavelet exp(-t^2 / B) exp(2 i pi t), in periods of its row: short enough to part the impulses of a
# fault, at a relative bandwidth (one standard deviation) of 1 / (pi sqrt(2 B)), some 18 %.
BANDWIDTH = 1.5
# pywt samples the integrated wavelet at 2^precision points and picks the nearest. At its default of 10 the
# low rows of an impulsive signal are wrong by more than their own size.
PRECISION = 18
# Above this share of the sampling rate a row has fewer than three samples a period and even tones fail.
LARGEST_SHARE = 0.35
ROWS, COLUMNS = 120, 800
_ROWS_AT_ONCE = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class Scalogram:
    """Amplitude, shape [rows, columns], in the unit of the signal; a sine of amplitude a reads a in its row.

    `time_s`, [columns], are the middles of the columns, each the mean of the samples in it; `frequency_hz`,
    [rows], rises in equal ratios. Nearer than `edge_s`, [rows], to either end a row also sees the ends.
    """

    time_s: FloatArray
    frequency_hz: FloatArray
    amplitude: FloatArray
    edge_s: FloatArray


def scalogram(
    samples: FloatArray,
    fs_hz: float,
    *,
    range_hz: tuple[float, float],
    rows: int = ROWS,
    columns: int = COLUMNS,
    precision: int = PRECISION,
    corrected: bool = True,
) -> Scalogram:
    """Complex-Morlet scalogram of `samples` [n] with PyWavelets (``pywt.cwt``), as the paper's Figure 14.

    pywt differences an integrated wavelet, which lowers each row by sin(x)/x, x = pi f / fs; that is divided out, and
    tones then read right to parts in a million. A single impulse is drawn within about two per cent of its row's
    peak below 0.15 of the sampling rate, six above. With pywt's own `precision` of 10, and not `corrected`, it is
    what pywt draws by itself. Raises `ConfigurationError` where `range_hz` leaves what the record's length and rate
    allow.
    """
    check_range(range_hz, fs_hz, samples.size / fs_hz)
    frequency = np.geomspace(*range_hz, rows)
    width = column_width(samples.size, columns)
    bounds = np.minimum(np.arange(0, samples.size + width, width), samples.size)
    parts = [
        _column_means(
            _transform(samples, fs_hz, frequency[first : first + _ROWS_AT_ONCE], precision, corrected), bounds
        )
        for first in range(0, rows, _ROWS_AT_ONCE)
    ]
    return Scalogram(
        time_s=(bounds[:-1] + bounds[1:] - 1) / 2 / fs_hz,
        frequency_hz=frequency,
        amplitude=np.concatenate(parts),
        edge_s=math.sqrt(BANDWIDTH) / frequency,
    )


def column_width(samples: int, columns: int) -> int:
    """Samples a column, so that `samples` make at most `columns` of them; a length that transforms fast."""
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


def _transform(
    samples: FloatArray, fs_hz: float, frequency_hz: FloatArray, precision: int, corrected: bool
) -> FloatArray:
    import pywt

    scales = fs_hz / frequency_hz
    wavelet = pywt.ContinuousWavelet(f"cmor{BANDWIDTH}-1.0")
    rows, _ = pywt.cwt(samples, scales, wavelet, 1 / fs_hz, method="fft", precision=precision)
    gain = np.sqrt(scales) / 2 * (np.sinc(frequency_hz / fs_hz) if corrected else 1.0)
    return np.abs(rows) / gain[:, None]


def _column_means(rows: FloatArray, bounds: NDArray[np.int_]) -> FloatArray:
    return np.add.reduceat(rows, bounds[:-1], axis=1) / np.diff(bounds)
