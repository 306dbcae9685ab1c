"""Scores of combs at any fundamental of a record, and of their placebos."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from srbval.arrays import FloatArray
from srbval.signal.periodogram import Periodogram

_OVERSAMPLING = 2  # candidates per bin of the highest line
MASKED = 0.5963473623  # score of a masked line: the mean of log(1 + x) for an exponential variable x of mean one
# Placebos are whole combs, and this many sets of combs with some lines from another fundamental, drawn at random.
MIXED, FARTHEST = 12, 0.35
REACH, LEAST = 2.0, 8  # placebos are taken from an octave to either side, and from at least so many fundamentals


@dataclass(frozen=True, kw_only=True, eq=False)
class CombSpectrum:
    """`score` [n] of a comb of `harmonics` lines at each `frequency_hz` [n], evenly over the logarithm by `step`.

    The score is the sum of log(1 + power over local noise), `lines`: one strong line does not outweigh all others.
    """

    frequency_hz: FloatArray
    score: FloatArray
    lines: FloatArray
    harmonics: int
    step: float

    @classmethod
    def of(
        cls, records: Sequence[Periodogram], lowest_hz: float, harmonics: int, highest_hz: float = math.inf
    ) -> CombSpectrum:
        """Combs from `lowest_hz` to `highest_hz` over the mean of `records`; masked lines score as noise does."""
        limit_hz = min(record.limit_hz for record in records)
        step = 1 / (_OVERSAMPLING * records[0].seconds * limit_hz)
        log_hz = np.arange(math.log(lowest_hz), math.log(min(limit_hz, harmonics * highest_hz)), step)
        hz = np.exp(log_hz)
        snr = np.mean([record.snr_at(hz) for record in records], axis=0)
        lines = np.where(records[0].masked(hz), MASKED, np.log1p(snr))
        score = _summed(np.tile(lines, (harmonics, 1)), step)
        return cls(frequency_hz=hz[: score.size], score=score, lines=lines, harmonics=harmonics, step=step)

    @functools.cached_property
    def mixed(self) -> FloatArray:
        """Scores of combs whose lines are harmonics of two fundamentals, a random distance apart, [MIXED, n]."""
        rng, found = np.random.default_rng(0), []
        for _ in range(MIXED):
            apart = rng.uniform(FARTHEST / 5, FARTHEST) * rng.choice((-1, 1))
            of_other = rng.permutation(self.harmonics) < rng.integers(1, self.harmonics)
            elsewhere = np.roll(self.lines, round(apart / self.step))
            found.append(_summed([elsewhere if other else self.lines for other in of_other], self.step))
        return np.array(found)

    def highest(self, centre_hz: float, relative: float) -> tuple[float, float]:
        """Highest score within the share `relative` of `centre_hz`, and its frequency [Hz]; nan if out of reach."""
        inside = np.flatnonzero(np.abs(self.frequency_hz / centre_hz - 1) <= relative)
        if inside.size == 0:
            return math.nan, math.nan
        best = inside[np.argmax(self.score[inside])]
        return float(self.score[best]), float(self.frequency_hz[best])

    def typical(self, relative: float) -> float:
        """Median over all fundamentals of the highest score within `relative` of them."""
        if self.score.size == 0:
            return 0.0
        half = max(1, round(relative / self.step))
        return float(np.median(maximum_filter1d(self.score, 2 * half + 1)))

    def placebos(self, allowed: NDArray[np.bool_], centre_hz: float, relative: float) -> FloatArray:
        """Highest scores within windows about `allowed` fundamentals, as wide in Hz as `relative` of `centre_hz`, [k].

        The fundamentals are within a factor of `REACH`. Empty if fewer than `LEAST` half a window apart are left.
        """
        if self.frequency_hz.size == 0:
            return np.empty(0)
        ends = max(centre_hz / REACH, self.frequency_hz[0]), min(centre_hz * REACH, self.frequency_hz[-1])
        even = np.log(np.arange(*ends, self.step * centre_hz) / self.frequency_hz[0]) / self.step
        at, half = np.rint(even).astype(np.int64), max(1, round(relative / self.step))
        if at.size == 0:
            return np.empty(0)
        wanted = np.flatnonzero(allowed[at])[::half]
        every = maximum_filter1d(np.vstack((self.score, self.mixed))[:, at], 2 * half + 1)
        return np.asarray(every[:, wanted if wanted.size >= LEAST else []].ravel())


def _summed(lines: Sequence[FloatArray] | FloatArray, step: float) -> FloatArray:
    """Sum over harmonics 1, 2, ... of line scores [k], one array each, by the fundamental, [n]."""
    shift = [round(math.log(number) / step) for number in range(1, len(lines) + 1)]
    size = max(0, lines[0].size - shift[-1])
    return np.asarray(np.sum([one[at : at + size] for one, at in zip(lines, shift, strict=True)], axis=0))
