"""How strong a comb stands beside combs of the same record that mean nothing: its placebo probability.

Real noise is not what `false_alarm` assumes: it holds lines of other machines, whose share no formula knows. So the
comb is ranked among placebos. The lines of a placebo come from `ORDERS` meaningless fundamentals, each harmonic from
one of them at random. Whole combs at one meaningless fundamental would be too few: a record holds only some tens whose
windows do not overlap, and the strongest of tens is no event of one in a thousand. Lines drawn from a fundamental
each would lose what lines of other sources have in common, being harmonics of each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.signal.false_alarm import neg_log_p
from srbval.signal.periodogram import NOISE_BINS, PADDING, Periodogram

# So many that nine speeds tried leave the least rank, times nine, below `PLACEBO_FALSE_ALARM`.
COMBS = 1000
# Different fundamentals that the lines of one placebo come from.
ORDERS = 2
# Fundamentals to choose from per half window.
GRID = 8
# Fewer whole windows among the meaningless fundamentals are no sample of the record.
LEAST_WINDOWS = 4
# A window this many half windows from another shares no line with it.
APART = 2.0
# The upper part of the placebos that the tail is fitted to: one in ten.
TAIL = 10
# Candidates per bin of the highest line.
_OVERSAMPLING = 2


def fundamentals(lowest_hz: float, highest_hz: float, relative: float) -> FloatArray:
    """Frequencies [n] evenly over the logarithm, `GRID` per half window of a comb (`relative`, a share of it)."""
    return np.asarray(np.exp(np.arange(math.log(lowest_hz), math.log(highest_hz), relative / GRID)))


@dataclass(frozen=True, kw_only=True, eq=False)
class PlaceboRank:
    """`evidence` of a comb, the highest sum of `neg_log_p` in its window, and that `of_placebos`, [combs]."""

    evidence: float
    of_placebos: FloatArray

    @property
    def false_alarm(self) -> float:
        """(1 + number of placebos at least as strong) / (their number + 1)."""
        return float(1 + np.count_nonzero(self.of_placebos >= self.evidence)) / (self.of_placebos.size + 1)

    @property
    def tail_false_alarm(self) -> float:
        """The same, continued beyond the strongest placebos by an exponential tail through the upper tenth of them.

        The mean excess over the tenth's threshold is that of the tail (a generalised Pareto tail of shape zero;
        Knijnenburg et al. 2009, Bioinformatics 25, i161, quoted from memory, not checked). An extrapolation: it grades
        strong lines, it is no rate.
        """
        ordered = np.sort(self.of_placebos)
        upper = ordered[-(ordered.size // TAIL) :]
        threshold = ordered[-(ordered.size // TAIL) - 1]
        excess = float(np.mean(upper - threshold))
        if self.evidence <= threshold or excess <= 0 or not math.isfinite(excess):
            return self.false_alarm
        return math.exp(-(self.evidence - threshold) / excess) / TAIL


def rank_among_placebos(
    record: Periodogram, expected_hz: float, half_window_hz: float, harmonics: int, meaningless_hz: FloatArray, *,
    combs: int = COMBS, orders: int = ORDERS,
) -> PlaceboRank | None:  # fmt: skip
    """The comb at `expected_hz` among `combs` placebos.

    `meaningless_hz` [n] are of `fundamentals`, more than two half windows from `expected_hz`. A placebo has the same
    number of lines, in windows of the same relative width, visible wherever the comb's own lines are. One of its
    fundamentals may lie in the comb's own window, as that of any other may: left out, the strongest line of the record
    would never be among the placebos of a comb that holds it by chance. The draw is the same for every record. None
    where `meaningless_hz` holds less than `LEAST_WINDOWS` windows.
    """
    relative = half_window_hz / expected_hz
    if meaningless_hz.size < 2 * GRID * LEAST_WINDOWS:
        return None
    lowest = min(float(meaningless_hz[0]), expected_hz) * (1 - APART * relative)
    step = 1 / (_OVERSAMPLING * record.seconds * record.limit_hz)
    log_hz = np.arange(math.log(lowest), math.log(record.limit_hz), step)
    scores, visible = _scores(record, np.exp(log_hz))
    width = 2 * max(1, round(math.log1p(relative) / step)) + 1

    def first(fundamental_hz: FloatArray | float, number: int) -> NDArray[np.int64]:
        index = np.rint((np.log(np.multiply(number, fundamental_hz)) - log_hz[0]) / step).astype(np.int64) - width // 2
        return np.asarray(np.clip(index, 0, log_hz.size - width))

    at_own = [slice(at := int(first(expected_hz, number)), at + width) for number in range(1, harmonics + 1)]
    seen, own = (np.array([values[at] for at in at_own]) for values in (visible, scores))
    # Windows of the placebos are cut from what is visible, so that each shows as much as the comb's own.
    rank = np.cumsum(visible) - 1
    windows = np.lib.stride_tricks.sliding_window_view(scores[visible], width)
    total = np.zeros((combs, width), dtype=np.float32)
    drawn_hz = _drawn(expected_hz, relative, meaningless_hz, harmonics, combs, orders)
    for number, drawn in enumerate(drawn_hz, 1):
        at = np.clip(rank[first(drawn, number)], 0, windows.shape[0] - 1)
        lines = windows[at]
        lines[:, ~seen[number - 1]] = 1.0
        total += lines
    evidence = _highest(np.where(seen, own, np.float32(1.0)).sum(axis=0)[None])[0]
    return PlaceboRank(evidence=float(evidence), of_placebos=_highest(total).astype(np.float64))


def _drawn(
    expected_hz: float, relative: float, meaningless_hz: FloatArray, harmonics: int, combs: int, orders: int
) -> FloatArray:
    """The fundamental that each line of each placebo is a harmonic of [Hz], [harmonics, combs]."""
    rng = np.random.default_rng(0)
    near = fundamentals(expected_hz * math.exp(-APART * relative), expected_hz * math.exp(APART * relative), relative)
    choice = rng.choice(meaningless_hz, (orders, combs))
    if orders == 1:
        return np.tile(choice, (harmonics, 1))
    # The first of its fundamentals may be one near the comb's own, but not all lines come from that one.
    choice[0] = rng.choice(np.concatenate((near, meaningless_hz)), combs)
    group = rng.integers(0, orders, (harmonics, combs))
    group[rng.integers(0, harmonics, combs), np.arange(combs)] = rng.integers(1, orders, combs)
    return np.take_along_axis(choice, group, axis=0)


def _scores(record: Periodogram, frequency_hz: FloatArray) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """`neg_log_p` over a running median of the unmasked bins, and what is not masked, each [n]."""
    from scipy.ndimage import median_filter

    spacing = PADDING * record.step_hz
    bins = np.arange(2, min(record.power.size // PADDING, math.ceil(record.limit_hz / spacing) + NOISE_BINS))
    bins = bins[~record.masked(np.asarray(bins * spacing, dtype=np.float64))]
    noise = median_filter(record.power[bins * PADDING], NOISE_BINS, mode="nearest") / math.log(2)
    local = np.maximum(np.interp(frequency_hz, bins * spacing, noise), np.finfo(float).tiny)
    ratio = record.power_at(frequency_hz) / local
    scores = neg_log_p(ratio[:, None], np.array([NOISE_BINS]))[:, 0]
    return scores.astype(np.float32), ~record.masked(frequency_hz)  # half the memory to move, digits enough to rank


def _highest(total: NDArray[np.float32]) -> NDArray[np.float32]:
    """The highest interior maximum of each row, [combs]; minus infinity where there is none."""
    top = np.max(total, axis=1)
    edge = (total[:, 0] == top) | (total[:, -1] == top)  # of what stands outside: few rows, looked at closely
    left, middle, right = (total[edge, first : total.shape[1] - 2 + first] for first in range(3))
    top[edge] = np.max(middle, axis=1, where=(middle >= left) & (middle > right), initial=-np.inf)
    return np.asarray(top)
