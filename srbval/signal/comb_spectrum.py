"""Score of a comb (a line with its harmonics) for each fundamental frequency: how far a record's lines exceed noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d

from srbval.arrays import FloatArray
from srbval.signal.comb import HARMONICS
from srbval.signal.periodogram import MASK_BINS, Periodogram

_OVERSAMPLING = 2  # candidates per bin of the highest line
MASKED = 0.5963473623  # score of a masked line: the mean of log(1 + x) for an exponential variable x of mean one


@dataclass(frozen=True, kw_only=True, eq=False)
class CombSpectrum:
    """Score [n] of a comb of `HARMONICS` lines at each fundamental `frequency_hz` [n], `step` apart in the logarithm.

    The score is the sum of log(1 + power over local noise): one strong line does not outweigh all others. `lines` [m]
    are these logarithms at the frequencies `line_hz` [m]. `depth` [m] is the amplitude at `line_hz` over the mean
    of the squared envelope; if the record was demodulated in several frequency bands, the greatest of these values.
    """

    line_hz: FloatArray
    lines: FloatArray
    depth: FloatArray
    score: FloatArray
    step: float
    bin_hz: float

    @classmethod
    def of(cls, bands: Sequence[Sequence[Periodogram]], lowest_hz: float) -> CombSpectrum:
        """Score combs with fundamentals from `lowest_hz` up in the mean of the spectra `bands[record][band]`.

        Each record has the same number of bands. The mean of n records scatters less by the root of n, so the distances
        of log(1 + S/N) from their median are multiplied by this root, to be comparable with those of one record.
        `depth`, the modulation depth, is reduced by the part due to noise if there are several records.
        """
        first, count = bands[0], len(bands)
        limit_hz = min(one.limit_hz for record in bands for one in record)
        step = 1 / (_OVERSAMPLING * first[0].seconds * limit_hz)
        hz = np.exp(np.arange(math.log(lowest_hz), math.log(limit_hz), step))
        snr = np.array([[one.snr_at(hz) for one in record] for record in bands])
        lines = np.log1p(snr.mean(axis=(0, 1)))
        square = np.array([[one.power_at(hz) * (2 / one.samples.size / one.mean) ** 2 for one in r] for r in bands])
        if count > 1:
            lines = MASKED + math.sqrt(count) * (lines - np.median(lines))
            square *= np.maximum(0, 1 - 1 / np.maximum(snr.mean(axis=0), 1))
        depth = np.sqrt(square.mean(axis=0).max(axis=0))
        kept = {"line_hz": hz, "depth": depth, "step": step, "bin_hz": first[0].bin_hz}
        return cls(lines=lines, score=_summed(lines, step), **kept)

    @property
    def frequency_hz(self) -> FloatArray:
        """Fundamentals of the combs [Hz], [n]."""
        return self.line_hz[: self.score.size]

    def highest(self, centre_hz: float, half_hz: float) -> int | None:
        """Index of the highest score within `half_hz` of `centre_hz`; None if the spectrum does not reach there."""
        first, end = np.searchsorted(self.frequency_hz, (centre_hz - half_hz, centre_hz + half_hz))
        return int(first + np.argmax(self.score[first:end])) if end > first else None

    def typical(self, relative: float) -> float:
        """Score of a typical comb: median, over all fundamentals, of the highest score within +-`relative` of each."""
        if self.score.size == 0:
            return 0.0
        half = max(1, round(relative / self.step))
        return float(np.median(maximum_filter1d(self.score, 2 * half + 1)))

    def without(self, centre_hz: FloatArray, half_hz: FloatArray) -> CombSpectrum:
        """Comb spectrum in which lines up to `half_hz` [k] + 1.5 bins away from a `centre_hz` [k] count as noise."""
        reach = half_hz + MASK_BINS * self.bin_hz
        edges = np.zeros(self.line_hz.size + 1)
        np.add.at(edges, np.searchsorted(self.line_hz, centre_hz - reach), 1)
        np.add.at(edges, np.searchsorted(self.line_hz, centre_hz + reach), -1)
        lines = np.where(np.cumsum(edges[:-1]) > 0, MASKED, self.lines)
        return replace(self, lines=lines, score=_summed(lines, self.step))


def _summed(lines: FloatArray, step: float) -> FloatArray:
    """Sum the line scores [m], which are `step` apart in the log of frequency, over the harmonics of each comb, [n]."""
    shift = [round(math.log(number) / step) for number in range(1, HARMONICS + 1)]
    size = max(0, lines.size - shift[-1])
    return np.asarray(np.sum([lines[at : at + size] for at in shift], axis=0))
