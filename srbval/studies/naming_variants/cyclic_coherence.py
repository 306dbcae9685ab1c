"""Squared cyclic spectral coherence of a record, and its mean over bands: the improved envelope spectrum.

Measured against the evidence that faults are named by (`srbval.studies.naming_variants.study`), and not adopted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.fft
import scipy.signal
import scipy.stats
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from srbval.arrays import FloatArray
from srbval.signal.periodogram import NOISE_BINS, PADDING

# Blocks overlap by all but this part of their length; the window is as wide in frequency as this part of the limit.
HOP, WIDTH = 8, 4
# Carrier frequencies left out at either end, as shares of the sampling rate.
ENDS = 0.01, 0.015


@dataclass(frozen=True, kw_only=True, eq=False)
class CyclicCoherence:
    """`squared` [carriers, n]: |coherence|^2 of components a cyclic frequency apart, n multiples of `step_hz`."""

    squared: FloatArray
    step_hz: float

    def improved_envelope_spectrum(self, low: float = 0.0, high: float = 1.0) -> FloatArray:
        """Mean over the carriers from share `low` to share `high` of all, [n]."""
        edges = [round(share * len(self.squared)) for share in (low, high)]
        return np.asarray(self.squared[edges[0] : max(edges[0] + 1, edges[1])].mean(axis=0))


def cyclic_coherence(samples: FloatArray, fs_hz: float, limit_hz: float) -> CyclicCoherence:
    """Coherence of `samples` [m] for cyclic frequencies up to `limit_hz`, on a grid `PADDING` finer than 1 / duration.

    The fast estimator of Antoni, Xin & Hamzaoui (2017, Mech. Syst. Signal Process. 92, 248; idea quoted from memory,
    not checked): the short-time transform X(t, f), whitened by its own mean power, and for each cyclic frequency the
    transform over time of X(t, f) X*(t, f - p df) with the shift p that comes nearest. The mean product is removed, so
    that at cyclic frequency zero there is nothing.
    """
    block = 2 ** int(np.clip(round(math.log2(fs_hz * WIDTH / limit_hz)), 4, 10))
    hop = max(1, block // HOP)
    count = scipy.fft.prev_fast_len((samples.size - block) // hop + 1)
    blocks = np.lib.stride_tricks.sliding_window_view(samples, block)[::hop][:count]
    short = scipy.fft.rfft(blocks * scipy.signal.get_window("hann", block), axis=1)
    # Phases as of one time origin, not of each block's own.
    short = short * np.exp(-2j * math.pi * np.outer(np.arange(count) * hop / block, np.arange(short.shape[1])))
    short = (short / np.sqrt(np.mean(np.abs(short) ** 2, axis=0))).astype(np.complex64)
    rate, length = fs_hz / hop, count * PADDING
    step_hz, spacing_hz = rate / length, fs_hz / block
    cyclic_hz = np.arange(math.floor(limit_hz / step_hz) + 1) * step_hz
    shift = np.rint(cyclic_hz / spacing_hz).astype(np.int64)
    first, last = max(1, round(ENDS[0] * block)), short.shape[1] - 1 - round(ENDS[1] * block)
    squared = np.zeros((last - first, cyclic_hz.size), dtype=np.float32)
    for p in np.unique(shift):
        own = np.flatnonzero(shift == p)
        at = np.rint((cyclic_hz[own] - p * spacing_hz) / step_hz).astype(np.int64) % length
        for carrier in range(max(first, int(p)), last):
            product = short[:, carrier] * np.conj(short[:, carrier - p])
            lines = scipy.fft.fft(product - product.mean(), n=length)
            squared[carrier - first, own] = np.abs(lines[at] / count) ** 2
    return CyclicCoherence(squared=squared, step_hz=step_hz)


def exponential_ratio(spectrum: FloatArray, masked: NDArray[np.bool_]) -> FloatArray:
    """`spectrum` [n] over its local noise, as a variable that noise makes exponential of mean one, [n].

    The mean over K independent carriers follows a gamma distribution of shape K in noise; K is read from the spread of
    the bins outside `masked` [n], and each value becomes the exponential one of the same probability.
    """
    bins = np.arange(2, spectrum.size // PADDING) * PADDING
    bins = bins[~masked[bins]]
    median = median_filter(spectrum[bins].astype(np.float64), NOISE_BINS, mode="nearest")
    if bins.size == 0 or not np.all(median > 0):
        return np.zeros(spectrum.size)
    shapes = np.geomspace(0.5, 200, 200)
    quartiles = scipy.stats.gamma.ppf(np.array([[0.25], [0.5], [0.75]]), shapes)
    low, high = np.quantile(spectrum[bins] / median, (0.25, 0.75))
    shape = shapes[np.argmin(np.abs((quartiles[2] - quartiles[0]) / quartiles[1] - (high - low)))]
    value = spectrum / np.interp(np.arange(spectrum.size), bins, median) * scipy.stats.gamma.ppf(0.5, shape)
    surprise = -scipy.stats.gamma.logsf(value, shape)
    return np.where(np.isfinite(surprise), surprise, value)
