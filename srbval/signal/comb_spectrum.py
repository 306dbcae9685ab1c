"""How strongly a record shows a comb, over the comb's fundamental, and how strong combs are that mean nothing."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, median_filter

from srbval.arrays import FloatArray
from srbval.signal.periodogram import NOISE_BINS, PADDING, Periodogram

# Candidates per bin of the highest line.
_OVERSAMPLING = 2
# The log of one plus an exponential variable of mean one is this on average: what a masked line counts.
MASKED = 0.5963473623
# Upper part of the placebos that the tail is fitted to.
TAIL = 0.1
# Placebos are whole combs, and combs of which some lines are taken from so many other fundamentals, drawn at random.
MIXED, FARTHEST = 12, 0.35
# Placebos are taken from an octave to either side, and from at least so many fundamentals.
REACH, LEAST = 2.0, 8


@dataclass(frozen=True, kw_only=True, eq=False)
class CombSpectrum:
    """`evidence` [n] of a comb at each `frequency_hz` [n], evenly over the logarithm by `step`, all lines in reach.

    The sum over the lines of log(1 + power over local noise): every line counts, none outweighs all others, as one
    strong line of another source would if its power were summed. `mixed` [MIXED, n] are the same of combs whose lines
    are harmonics of two fundamentals, the second one off by a random share.
    """

    frequency_hz: FloatArray
    evidence: FloatArray
    mixed: FloatArray
    step: float

    @classmethod
    def of(cls, record: Periodogram, lowest_hz: float, harmonics: int) -> CombSpectrum:
        """Combs of `harmonics` lines from `lowest_hz` up; masked lines count as noise does on average."""
        step = 1 / (_OVERSAMPLING * record.seconds * record.limit_hz)
        log_hz = np.arange(math.log(lowest_hz), math.log(record.limit_hz), step)
        score = scores(record, np.exp(log_hz))
        shift = [round(math.log(number) / step) for number in range(1, harmonics + 1)]
        size = max(0, log_hz.size - shift[-1])
        rng = np.random.default_rng(0)

        def summed(elsewhere: FloatArray, of_other: NDArray[np.bool_]) -> FloatArray:
            return np.sum([(elsewhere if of_other[n] else score)[at : at + size] for n, at in enumerate(shift)], axis=0)

        mixed = []
        for _ in range(MIXED):
            apart = rng.uniform(FARTHEST / 5, FARTHEST) * rng.choice((-1, 1))
            of_other = rng.permutation(harmonics) < rng.integers(1, harmonics)
            mixed.append(summed(np.roll(score, round(apart / step)), of_other))
        return cls(
            frequency_hz=np.exp(log_hz[:size]),
            evidence=summed(score, np.zeros(harmonics, dtype=np.bool_)),
            mixed=np.array(mixed),
            step=step,
        )

    def highest(self, centre_hz: float, relative: float) -> tuple[float, float]:
        """The highest evidence within `relative` of `centre_hz`, and its frequency [Hz]; nan where out of reach."""
        inside = np.flatnonzero(np.abs(self.frequency_hz / centre_hz - 1) <= relative)
        if inside.size == 0:
            return math.nan, math.nan
        best = inside[np.argmax(self.evidence[inside])]
        return float(self.evidence[best]), float(self.frequency_hz[best])

    def typical(self, relative: float) -> float:
        """Median over all fundamentals of the highest evidence within `relative` of them."""
        if self.evidence.size == 0:
            return 0.0
        half = max(1, round(relative / self.step))
        return float(np.median(maximum_filter1d(self.evidence, 2 * half + 1)))

    def placebos(self, meaningless: NDArray[np.bool_], centre_hz: float, relative: float) -> FloatArray:
        """Highest evidence in windows as wide as that of half width `relative` about `centre_hz`, [k].

        About `meaningless` fundamentals [n] within a factor of `REACH`; as wide in Hz, so that each holds as many
        independent values. None where less than `LEAST` fundamentals half a window apart are left, no sample.
        """
        if self.frequency_hz.size == 0:
            return np.empty(0)
        ends = max(centre_hz / REACH, self.frequency_hz[0]), min(centre_hz * REACH, self.frequency_hz[-1])
        even = np.log(np.arange(*ends, self.step * centre_hz) / self.frequency_hz[0]) / self.step
        at, half = np.rint(even).astype(np.int64), max(1, round(relative / self.step))
        if at.size == 0:
            return np.empty(0)
        wanted = np.flatnonzero(meaningless[at])[::half]
        every = maximum_filter1d(np.vstack((self.evidence, self.mixed))[:, at], 2 * half + 1)
        return np.asarray(every[:, wanted if wanted.size >= LEAST else []].ravel())


def neg_log_rank(evidence: float, placebos: FloatArray) -> float:
    """-log of the probability that a placebo is as strong, beyond most of them by an exponential tail.

    The mean excess over the upper tenth's threshold is the tail's (a generalised Pareto tail of shape zero).
    """
    if math.isnan(evidence) or placebos.size < round(1 / TAIL):
        return math.nan
    threshold = float(np.quantile(placebos, 1 - TAIL))
    if evidence <= threshold:
        return -math.log(float(1 + np.count_nonzero(placebos >= evidence)) / (placebos.size + 1))
    excess = float(np.mean(placebos[placebos > threshold] - threshold))
    return (evidence - threshold) / excess - math.log(TAIL)


def scores(record: Periodogram, frequency_hz: FloatArray) -> FloatArray:
    """log(1 + power over a running median of the unmasked bins / ln 2) [n]."""
    spacing = PADDING * record.step_hz
    bins = np.arange(2, record.power.size // PADDING)
    bins = bins[~record.masked(np.asarray(bins * spacing, dtype=np.float64))]
    if bins.size == 0:
        return np.full(frequency_hz.shape, MASKED)
    noise = median_filter(record.power[bins * PADDING], NOISE_BINS, mode="nearest") / math.log(2)
    noise = np.maximum(noise, np.finfo(float).tiny)
    ratio = record.power_at(frequency_hz) / np.interp(frequency_hz, bins * spacing, noise)
    return np.where(record.masked(frequency_hz), MASKED, np.log1p(ratio))
