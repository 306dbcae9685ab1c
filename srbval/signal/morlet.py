"""Exact Morlet scalogram, each row computed no finer than it moves."""

from __future__ import annotations

import math

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from srbval.signal.scalogram import BANDWIDTH, COLUMNS, ROWS, Scalogram, check_range, column_width

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# The wavelet's spectrum is cut this many standard deviations from its middle: exp(-18) of its top.
_SIGMAS = 6.0
# A row's modulus is sampled at least so often in a column, and in the time one over the width of what is kept.
_PER_COLUMN, _PER_WIDTH = 8, 1.5


def morlet_scalogram(
    samples: FloatArray,
    fs_hz: float,
    *,
    range_hz: tuple[float, float],
    rows: int = ROWS,
    columns: int = COLUMNS,
) -> Scalogram:
    """Complex-Morlet scalogram of `samples` [n], the same transform as `scalogram` without its discretised wavelet.

    One real transform of the record; for each row the bins under the wavelet's spectrum, which is a Gaussian in closed
    form, are brought down to zero and transformed back no finer than the row moves. The modulus is that of the
    direct sum of samples times wavelet to 1e-7 of its largest; a column is its mean over the column's time, exactly
    that of its samples where a row needs them all; the last one may reach beyond the record. The record's ends wrap
    round within `edge_s`. Raises `ConfigurationError` where `range_hz` leaves what the record allows.
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
        kept, first = _under_wavelet(lines, padded * width, float(centre_hz) * padded * width / fs_hz)
        image[row] = _columns(kept, first, padded, width)[:shown]
    return Scalogram(
        time_s=((np.arange(shown, dtype=np.float64) + 0.5) * width - 0.5) / fs_hz,
        frequency_hz=frequency,
        amplitude=image,
        edge_s=math.sqrt(BANDWIDTH) / frequency,
    )


def _under_wavelet(lines: ComplexArray, length: int, centre: float) -> tuple[ComplexArray, int]:
    """The bins under one row's Gaussian, weighted, and the number of the first; `centre` in bins.

    Beyond the Nyquist frequency a sampled record repeats itself, mirrored; a sampled wavelet sees that too.
    """
    sigma = centre / (math.pi * math.sqrt(2 * BANDWIDTH))
    first = max(1, math.ceil(centre - _SIGMAS * sigma))  # the mean, bin 0, is no vibration
    number = np.arange(first, min(length - 1, math.floor(centre + _SIGMAS * sigma)) + 1)
    mirrored = number >= lines.size
    kept = lines[np.where(mirrored, length - number, number)]
    kept[mirrored] = np.conj(kept[mirrored])
    gain = np.exp(-0.5 * ((number - centre) / sigma) ** 2)
    return kept * (gain * 2 / length), first


def _columns(kept: ComplexArray, first: int, padded: int, width: int) -> FloatArray:
    """Means of the modulus over all `padded` columns of `width` samples, from enough moments spread evenly in each."""
    moments = min(width, max(_PER_COLUMN, math.ceil(_PER_WIDTH * kept.size / padded)))
    count = moments * padded
    # The moments lie in the middles of equal parts of the column's time, which begins half a sample before it.
    start = 0.5 / moments - 0.5 / width
    turned = kept * np.exp((2j * np.pi * start / padded) * (first + np.arange(kept.size)))
    modulus = np.abs(scipy.fft.ifft(turned, n=count)) * count
    means: FloatArray = modulus.reshape(padded, moments).mean(axis=1)
    return means
