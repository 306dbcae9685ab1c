"""Exact Morlet scalogram, each row computed no finer than it moves."""

from __future__ import annotations

import math

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from srbval.signal.scalogram import BANDWIDTH, COLUMNS, ROWS, Scalogram, check_range

FloatArray = NDArray[np.float64]

# The wavelet's spectrum is cut this many standard deviations from its middle: exp(-18) of its top.
_SIGMAS = 6.0
# Samples of a row's modulus a column's mean is taken from, at least.
_PER_COLUMN = 8


def morlet_scalogram(
    samples: FloatArray,
    fs_hz: float,
    *,
    range_hz: tuple[float, float],
    rows: int = ROWS,
    columns: int = COLUMNS,
) -> Scalogram:
    """Complex-Morlet scalogram of `samples` [n], the same transform as `scalogram` without its discretised wavelet.

    One real transform of the record; for each row the bins under the wavelet's spectrum, which is a Gaussian in
    closed form, are brought down to zero and transformed back at a rate just above their width. The modulus is that
    of the full-rate transform, sampled more sparsely; a column is the mean of the samples in it. Tones read their
    amplitude at every scale to rounding. The record's ends wrap round within `edge_s`. Raises `ConfigurationError`
    where `range_hz` leaves what the record allows.
    """
    check_range(range_hz, fs_hz, samples.size / fs_hz)
    frequency = np.geomspace(*range_hz, rows)
    # Zeros keep one end from wrapping into the other.
    pad = math.ceil(_SIGMAS * math.sqrt(BANDWIDTH) / range_hz[0] * fs_hz)
    length = scipy.fft.next_fast_len(samples.size + pad, real=True)
    lines = scipy.fft.rfft(samples, n=length)
    seconds = samples.size / fs_hz
    columns = min(columns, samples.size)
    image = np.empty((rows, columns))
    for row, centre_hz in enumerate(frequency):
        modulus, rate = _row(lines, length, fs_hz, float(centre_hz), _PER_COLUMN * columns / seconds)
        count = min(max(1, round(seconds * rate)), modulus.size)
        image[row] = _means(modulus[:count], columns)
    return Scalogram(
        time_s=(np.arange(columns) + 0.5) * seconds / columns - 0.5 / fs_hz,
        frequency_hz=frequency,
        amplitude=image,
        edge_s=math.sqrt(BANDWIDTH) / frequency,
    )


def _row(
    lines: NDArray[np.complex128], length: int, fs_hz: float, centre_hz: float, least_rate_hz: float
) -> tuple[FloatArray, float]:
    """Modulus of one row and its sampling rate [Hz]: twice the positive-frequency part under the Gaussian."""
    sigma_hz = centre_hz / (math.pi * math.sqrt(2 * BANDWIDTH))
    bin_hz = fs_hz / length
    first = max(0, math.ceil((centre_hz - _SIGMAS * sigma_hz) / bin_hz))
    last = min(lines.size - 1, math.floor((centre_hz + _SIGMAS * sigma_hz) / bin_hz))
    offset = (np.arange(first, last + 1) * bin_hz - centre_hz) / sigma_hz
    kept = lines[first : last + 1] * np.exp(-0.5 * offset**2)
    if first == 0:
        kept[0] = 0.0  # the mean is no vibration
    reduced = scipy.fft.next_fast_len(max(kept.size, math.ceil(least_rate_hz / bin_hz)))
    return np.abs(scipy.fft.ifft(kept, n=reduced)) * (2 * reduced / length), fs_hz * reduced / length


def _means(values: FloatArray, columns: int) -> FloatArray:
    bounds = np.linspace(0, values.size, columns + 1).astype(int)
    sums: FloatArray = np.add.reduceat(values, bounds[:-1]) / np.maximum(np.diff(bounds), 1)
    return sums
