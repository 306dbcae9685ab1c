"""How strongly a record shows combs and groups of lines, wherever they stand, and placebos of either.

A defect on a rolling element strikes while the element passes the load zone, once per revolution of the cage. Its line
is therefore a group of lines the cage frequency apart, with its centre at the rate of strikes in the load zone. Outside
of it the element may turn more slowly, so that the strikes of one passage are shifted in phase against those of the
one before. That moves all lines of the group, by up to half the spacing, and leaves the centre where it is: pulses that
recur after T with their phase advanced by phi have lines at (n + phi / 2 pi) / T, under the spectrum of one passage.
That is the geometric series of the passages' spectra, exp(i k (phi - 2 pi f T)) summed over k (derived here).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from srbval.arrays import FloatArray
from srbval.signal.periodogram import Periodogram

# Candidates per bin of the highest line.
_OVERSAMPLING = 2
# The log of one plus an exponential variable of mean one is this on average: what a masked line counts.
MASKED = 0.5963473623
# Placebos are whole combs, and combs of which some lines are taken from so many other fundamentals, drawn at random.
MIXED, FARTHEST = 12, 0.35
# Placebos are taken from an octave to either side, and from at least so many fundamentals.
REACH, LEAST = 2.0, 8
# Lines to either side of a group's middle one, and harmonics of the group; grid points per bin.
SIDE_LINES, GROUP_HARMONICS, _GROUP_OVERSAMPLING = 2, 2, 4
# Spacings of a group's placebos, as shares of its own: only the middle lines coincide with any of its lines.
OTHER_SPACINGS = 0.83, 1.17


@dataclass(frozen=True, kw_only=True, eq=False)
class CombSpectrum:
    """`score` [n] of a comb at each `frequency_hz` [n], evenly over the logarithm by `step`, all lines in reach.

    The sum over the lines of log(1 + power over local noise): every line counts, none outweighs all others, as one
    strong line of another source would if its power were summed. `mixed` [MIXED, n] are the same of combs whose lines
    are harmonics of two fundamentals, the second one off by a random share.
    """

    frequency_hz: FloatArray
    score: FloatArray
    mixed: FloatArray
    step: float

    @classmethod
    def of(cls, record: Periodogram, lowest_hz: float, harmonics: int) -> CombSpectrum:
        """Combs of `harmonics` lines from `lowest_hz` up; masked lines count as noise does on average."""
        step = 1 / (_OVERSAMPLING * record.seconds * record.limit_hz)
        log_hz = np.arange(math.log(lowest_hz), math.log(record.limit_hz), step)
        score = _line_scores(record, np.exp(log_hz))
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
            score=summed(score, np.zeros(harmonics, dtype=np.bool_)),
            mixed=np.array(mixed),
            step=step,
        )

    def highest(self, centre_hz: float, relative: float) -> tuple[float, float]:
        """The highest score within `relative` of `centre_hz`, and its frequency [Hz]; nan where out of reach."""
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
        """Highest scores in windows as wide as that of half width `relative` about `centre_hz`, [k].

        About fundamentals that are `allowed` [n] within a factor of `REACH`; as wide in Hz, so that each holds as many
        independent values. None where less than `LEAST` fundamentals half a window apart are left, no sample.
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


@dataclass(frozen=True, kw_only=True)
class Group:
    """The strongest group about a centre: its `score`, the line nearest to the centre and the spacing [Hz]."""

    score: float
    found_hz: float
    spacing_hz: float


def strongest_group(
    record: Periodogram, centre_hz: float, spacing_hz: float, relative: float
) -> tuple[Group | None, FloatArray]:
    """The strongest group about `centre_hz`, and the scores of others [k], about other centres or of other spacing.

    The score is the sum of log(1 + power over local noise) of a line within half a spacing of the centre and of
    `SIDE_LINES` to either side of it, and of as many about twice the centre; the highest of all places and of all
    spacings within `relative` of `spacing_hz`. Other groups have their centres within an octave, no nearer than a
    group is wide. None, and no others, where a group reaches below zero or beyond the record's limit.
    """
    half_width_hz = (SIDE_LINES + 1) * spacing_hz
    if centre_hz <= half_width_hz or GROUP_HARMONICS * centre_hz + half_width_hz > record.limit_hz:
        return None, np.empty(0)
    step_hz = record.bin_hz / _GROUP_OVERSAMPLING
    score = _line_scores(record, np.arange(0.0, record.limit_hz, step_hz))
    lowest_hz = max(centre_hz / 2, half_width_hz)
    centres = np.arange(lowest_hz, min(2 * centre_hz, record.limit_hz / GROUP_HARMONICS), spacing_hz)
    apart = np.abs(centres - centre_hz) > SIDE_LINES * spacing_hz
    own, *others = _groups(score, step_hz, np.concatenate(([centre_hz], centres[apart])), spacing_hz, relative)
    for share in OTHER_SPACINGS:
        others += _groups(score, step_hz, centres, share * spacing_hz, relative)
    return own, np.array([group.score for group in others])


def _groups(
    score: FloatArray, step_hz: float, centres_hz: FloatArray, spacing_hz: float, relative: float
) -> list[Group]:
    """The strongest group about each centre [c]; `score` [n] is of multiples of `step_hz`."""
    finest = step_hz / (SIDE_LINES + 1)  # the outermost lines are then off by a third of a step at most
    half = math.ceil(relative * spacing_hz / finest)
    best = [Group(score=-math.inf, found_hz=math.nan, spacing_hz=spacing_hz)] * centres_hz.size
    for spacing in spacing_hz + finest * np.arange(-half, half + 1):
        steps = spacing / step_hz
        ends = round(SIDE_LINES * steps)
        padded = np.pad(score, ends, constant_values=MASKED)
        shifts = [ends + round(m * steps) for m in range(-SIDE_LINES, SIDE_LINES + 1)]
        summed = np.sum([padded[at : at + score.size] for at in shifts], axis=0)  # each line with its neighbours
        line = np.arange(-spacing / 2, spacing / 2, step_hz)  # from the centre
        total = np.zeros((centres_hz.size, line.size))
        for harmonic in range(1, GROUP_HARMONICS + 1):
            nearest = harmonic * line - spacing * np.rint(harmonic * line / spacing)
            at = np.rint((harmonic * centres_hz[:, None] + nearest) / step_hz).astype(np.int64)
            total += summed[np.minimum(at, summed.size - 1)]
        top = np.argmax(total, axis=1)
        for number, highest in enumerate(total[np.arange(top.size), top]):
            if highest > best[number].score:
                found_hz = float(centres_hz[number] + line[top[number]])
                best[number] = Group(score=float(highest), found_hz=found_hz, spacing_hz=float(spacing))
    return best


def _line_scores(record: Periodogram, frequency_hz: FloatArray) -> FloatArray:
    """log(1 + power over local noise) of single lines [n]; of masked ones what noise has on average."""
    return np.where(record.masked(frequency_hz), MASKED, np.log1p(record.snr_at(frequency_hz)))
