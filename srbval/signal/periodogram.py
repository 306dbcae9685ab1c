"""Periodogram on a fine grid, noise near a line, and Fourier sums of a record over short blocks."""

import functools
import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple, Self

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from srbval.arrays import ComplexArray, FloatArray, IntArray
from srbval.errors import DataError

PHASOR_BLOCKS = 96  # of a record for sums: a line within a bin of its frequency loses less than 2e-4 of its power
POINTS_PER_BIN = 8  # points per independent bin of the padded transform
NOISE_BINS, LEAST_NOISE_BINS = 65, 9  # independent bins for the estimate of the local noise; odd for the median
MASK_BINS = 1.5  # half width of the masked zone about a shaft harmonic, in independent bins
_RATE = 4.0  # reduced sampling rate in units of the highest frequency of interest: flat to there after the filter
_FLAT_SHARE = 0.4  # share of the reduced rate below which that filter does not colour the noise


@dataclass(frozen=True, kw_only=True, eq=False)
class Phasors:
    """Fourier sums `sums` [c, blocks] over short blocks of a record at c frequencies, for a fit of lines near these.

    `time_s` [blocks] are the middles of the blocks, from the record's middle, so frequency and phase do not correlate;
    `moments` [c, blocks] are Fourier sums in which each sample is multiplied by its time from the block's middle.
    """

    sums: ComplexArray
    moments: ComplexArray
    time_s: FloatArray
    seconds: float

    @classmethod
    def of(cls, samples: FloatArray, fs_hz: float, frequency_hz: FloatArray) -> Self:
        """Compute the Fourier sums of `samples` [n] at `frequency_hz` [c] over each of `PHASOR_BLOCKS` short blocks."""
        bounds = np.linspace(0, samples.size, min(PHASOR_BLOCKS, samples.size) + 1).astype(int)
        middle = (samples.size - 1) / 2
        longest = int(np.diff(bounds).max())
        # Phases start at a block's first sample, so that one short table serves all; real products, for speed.
        within = np.arange(longest)
        angle = 2 * np.pi * np.outer(frequency_hz / fs_hz, within)
        cosine, sine = np.cos(angle), np.sin(angle)
        padded = np.zeros((bounds.size - 1, longest))
        for row, (first, end) in enumerate(pairwise(bounds)):
            padded[row, : end - first] = samples[first:end]
        real, imaginary, real_moment, imaginary_moment = np.split(
            np.concatenate([cosine, -sine, cosine * within, -sine * within]) @ padded.T, 4
        )
        start = np.exp(-2j * np.pi * np.outer(frequency_hz / fs_hz, bounds[:-1] - middle))
        sums = (real + 1j * imaginary) * start
        half = (np.diff(bounds) - 1) / 2
        return cls(
            sums=sums,
            moments=((real_moment + 1j * imaginary_moment) * start - half * sums) / fs_hz,
            time_s=(bounds[:-1] + half - middle) / fs_hz,
            seconds=samples.size / fs_hz,
        )

    def shifted(self, by_hz: FloatArray) -> Self:
        """Fourier sums at frequencies `by_hz` [c] higher; a block of the record must last far less than 1 / `by_hz`."""
        rotation = np.exp(-2j * np.pi * by_hz[:, None] * self.time_s)
        return replace(self, sums=self.sums * rotation, moments=self.moments * rotation)

    def power(self) -> FloatArray:
        """Power at each of the c frequencies, [c]: squared modulus of the Fourier sum over all blocks of the record."""
        return np.abs(self.sums.sum(axis=1)) ** 2


class Noise(NamedTuple):
    """Local mean noise power: the median power of an odd number of `bins`, divided by ln 2."""

    mean_power: float
    bins: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Periodogram:
    """Power of a record [n], its Fourier sum squared, without a window, at `POINTS_PER_BIN` frequencies per bin.

    `limit_hz` is the highest frequency of interest; `samples` are the record at the lower sampling rate `fs_hz` that
    suffices for it, with its `mean` removed. `masks_hz`, [m, 2], are zones counted neither as line nor as noise, such
    as the shaft's harmonics.
    """

    samples: FloatArray
    fs_hz: float
    mean: float
    power: FloatArray
    step_hz: float
    limit_hz: float
    masks_hz: FloatArray

    @classmethod
    def of(
        cls, samples: FloatArray, fs_hz: float, *, limit_hz: float, shaft_hz: float, shaft_ci_hz: float = 0.0
    ) -> Self:
        """Periodogram of `samples` up to `limit_hz`, with the harmonics of `shaft_hz` +- `shaft_ci_hz` masked."""
        down = max(1, math.floor(fs_hz / (_RATE * limit_hz)))
        mean = float(samples.mean())
        centred = samples - mean
        reduced = decimate(centred, down) if down > 1 else centred
        rate = fs_hz / down
        length = POINTS_PER_BIN * scipy.fft.next_fast_len(reduced.size, real=True)
        power, none = np.abs(scipy.fft.rfft(reduced, n=length)) ** 2, np.empty((0, 2))
        grid = {"step_hz": rate / length, "limit_hz": limit_hz}
        bare = cls(samples=reduced, fs_hz=rate, mean=mean, power=power, masks_hz=none, **grid)
        number = np.arange(1, math.floor(limit_hz / shaft_hz) + 2, dtype=np.float64)
        return bare.masking(number * shaft_hz, number * shaft_ci_hz)

    def masking(self, centre_hz: FloatArray, half_width_hz: FloatArray) -> Self:
        """Periodogram with further masked zones, `half_width_hz` plus `MASK_BINS` bins to either side of a centre."""
        half = MASK_BINS * self.bin_hz + half_width_hz
        zones = np.vstack((self.masks_hz, np.column_stack((centre_hz - half, centre_hz + half))))
        zones = zones[np.argsort(zones[:, 0])]
        zones[:, 1] = np.maximum.accumulate(zones[:, 1])  # so that the last zone to begin ends last
        return replace(self, masks_hz=zones)

    @property
    def seconds(self) -> float:
        """Duration of the record [s]."""
        return self.samples.size / self.fs_hz

    @property
    def bin_hz(self) -> float:
        """Spacing of independent bins, one over the duration [Hz]."""
        return 1 / self.seconds

    def masked(self, frequency_hz: FloatArray) -> NDArray[np.bool_]:
        """True for each frequency in a masked zone."""
        if self.masks_hz.size == 0:
            return np.zeros(np.shape(frequency_hz), dtype=bool)
        zone = np.searchsorted(self.masks_hz[:, 0], frequency_hz) - 1
        return (zone >= 0) & (frequency_hz <= self.masks_hz[np.maximum(zone, 0), 1])

    def power_at(self, frequency_hz: FloatArray) -> FloatArray:
        """Power at any frequency, interpolated on the fine grid (within two per cent at a line's top)."""
        return np.interp(frequency_hz, self._grid_hz, self.power)

    @functools.cached_property
    def _grid_hz(self) -> FloatArray:
        return np.arange(self.power.size, dtype=np.float64) * self.step_hz

    @functools.cached_property
    def _unmasked_bins(self) -> IntArray:
        """Numbers of the independent bins outside the masked zones, without the first two."""
        bins = np.arange(2, self.power.size // POINTS_PER_BIN)
        return bins[~self.masked(np.asarray(bins * (POINTS_PER_BIN * self.step_hz), dtype=np.float64))]

    def exact_power_at(self, frequency_hz: FloatArray) -> FloatArray:
        """Power from the Fourier sum itself, for a few frequencies."""
        return Phasors.of(self.samples, self.fs_hz, frequency_hz).power()

    def depth_at(self, frequency_hz: float) -> float:
        """Modulation depth of the record, an envelope, at a line: the line's amplitude divided by the record's mean."""
        power = float(self.exact_power_at(np.array([frequency_hz]))[0])
        return 2 * math.sqrt(power) / self.samples.size / abs(self.mean) if self.mean else math.inf

    def noise_near(self, centre_hz: float, half_window_hz: float) -> Noise:
        """Mean noise power near `centre_hz`: median, divided by ln 2, of the nearest bins outside window and masks.

        Raises `DataError` if fewer than `LEAST_NOISE_BINS` are left.
        """
        spacing, bins = POINTS_PER_BIN * self.step_hz, self._unmasked_bins
        bins = bins[: np.searchsorted(bins, math.ceil(_FLAT_SHARE * self.fs_hz / spacing))]
        low, high = ((centre_hz + side * (half_window_hz + self.bin_hz)) / spacing for side in (-1, 1))
        below, above = np.searchsorted(bins, (math.ceil(low), math.floor(high) + 1))
        sides = np.concatenate((bins[max(0, below - NOISE_BINS) : below], bins[above : above + NOISE_BINS]))
        nearest = sides[np.argsort(np.abs(sides * spacing - centre_hz), kind="stable")[:NOISE_BINS]]
        if nearest.size < LEAST_NOISE_BINS:
            raise DataError(f"too few bins near {centre_hz:.4g} Hz to estimate the noise; use a longer record.")
        power = self.power[nearest[: nearest.size - 1 + nearest.size % 2] * POINTS_PER_BIN]
        mean = float(np.median(power)) / math.log(2)
        return Noise(max(mean, float(np.finfo(float).tiny)), power.size)

    def snr_at(self, frequency_hz: FloatArray) -> FloatArray:
        """Power over the local noise, a running median of unmasked bins, at frequencies up to `limit_hz`."""
        spacing, bins = POINTS_PER_BIN * self.step_hz, self._unmasked_bins
        bins = bins[: np.searchsorted(bins, math.ceil(self.limit_hz / spacing) + NOISE_BINS)]
        if bins.size == 0:
            return np.zeros(frequency_hz.shape)
        noise = median_filter(self.power[bins * POINTS_PER_BIN], NOISE_BINS, mode="nearest") / math.log(2)
        local = np.maximum(np.interp(frequency_hz, bins * spacing, noise), np.finfo(float).tiny)
        return self.power_at(frequency_hz) / local


def decimate(samples: FloatArray, down: int) -> FloatArray:
    """Low-pass filter and keep one of `down` samples, as `scipy.signal.resample_poly` does, which is slow to import."""
    half = 10 * down
    low_pass = np.sinc(np.arange(-half, half + 1) / down) * np.kaiser(2 * half + 1, 5.0)
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(samples, half), low_pass.size)[::down]
    return np.asarray(np.einsum("nk,k->n", windows, low_pass / low_pass.sum()))
