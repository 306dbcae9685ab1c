"""False-alarm probability of a line: from noise alone, and by its rank among placebos of the same record.

`neg_log_p` turns the power of a bin over its noise into an exponential variable; Rice's formula gives how often its sum
over harmonics rises above a level within a search window. Real noise contains lines of other machines, so a comb (line
with harmonics) is also ranked among placebos, combs at frequencies without a bearing line. The harmonics of a whole
placebo belong to one fundamental; in a mixed placebo each is taken from one of two fundamentals at random. There are
only some tens of whole placebos, but they can be real combs of other sources; `joint_false_alarm` weights both ranks.
"""

import math
from typing import NamedTuple

import numpy as np
import scipy.special
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.signal.periodogram import NOISE_BINS, Periodogram

MIN_PLACEBOS = 1000  # their least rank, times nine trials, stays below `comb.PLACEBO_FALSE_ALARM`
FUNDAMENTALS_PER_PLACEBO = 2  # number of fundamentals of the lines of one placebo
GRID_PER_HALF_WINDOW = 8  # fundamentals per half window
LEAST_WINDOWS = 4  # least number of whole windows among the placebos' fundamentals
# Assumed share of records with a comb of another source. Stated.
FOREIGN_COMB = 0.1
APART = 2.0  # windows this many half windows apart share no line
TAIL = 0.1  # upper share of the placebos to which the tail is fitted
_OVERSAMPLING = 2  # candidates per bin of the highest line
BLOCK = 4096  # placebos scored at a time


def neg_log_p(snr: FloatArray, bins: FloatArray) -> FloatArray:
    """-log of the probability that noise reaches `snr` at a given frequency; for noise, it is exponential with mean 1.

    `snr` [..., h] is power over the mean noise, estimated as M / ln 2 by the median M of `bins` [h] (odd) bins nearby.
    The k-th of n ordered exponential variables is a sum of independent ones of rates n, ... n - k + 1 (Renyi 1953, Acta
    Math. Hung. 4, 191), so the log of the mean of exp(-`snr` M / ln 2) is a difference of log gamma functions.
    """
    half, ratio = (bins + 1) / 2, np.asarray(snr) / math.log(2)
    rise = scipy.special.gammaln(bins + 1 + ratio) - scipy.special.gammaln(half + ratio)
    return np.asarray(rise - scipy.special.gammaln(bins + 1) + scipy.special.gammaln(half))


def true_noise_ratio(snr: FloatArray, bins: FloatArray) -> FloatArray:
    """Expected power of a noise peak over the true noise, if it is `snr` [..., h] times the estimate from `bins`.

    It is less than `snr`, because the estimated noise is probably too low beside so high a peak of noise. With S =
    `neg_log_p` it is `snr` dS/dsnr.
    """
    ratio = np.asarray(snr) / math.log(2)
    rise = scipy.special.digamma(bins + 1 + ratio) - scipy.special.digamma((bins + 1) / 2 + ratio)
    return np.asarray(ratio * rise)


def false_alarm(
    total_neg_log_p: float, total_ratio: float, share: FloatArray, half_window_hz: float, seconds: float
) -> float:
    """Probability that noise alone gives a comb a summed `neg_log_p` of `total_neg_log_p` or more in its window.

    The window is +-`half_window_hz` in a record of `seconds`. `total_ratio` is the sum of `true_noise_ratio` over the
    comb's lines. `share` [h + 1] contains the share of the window in which 0, 1, ... h of these lines are not masked.
    With N peaks on average (`upcrossings`) the probability is ``1 - exp(-N)`` (Davies 1987, Biometrika 74, 33, without
    the term for a window's start).
    """
    crossings = 0.0
    for lines in np.flatnonzero(share[1:]) + 1:
        crossings += share[lines] * upcrossings(total_neg_log_p, total_ratio, int(lines), half_window_hz, seconds)
    return -math.expm1(-crossings)


def upcrossings(level: float, ratio: float, harmonics: int, half_window_hz: float, seconds: float) -> float:
    """Mean number of rises of a comb's summed `neg_log_p` above `level` within +-`half_window_hz`, on noise alone.

    Rice's formula (1945, Bell Syst. Tech. J. 24, 46) for a sum of squared moduli of Gaussian spectra. The spectrum of a
    record of T = `seconds`, without a window, has the mean square derivative (pi T)^2 / 3; if the fundamental moves by
    1 Hz, harmonic h moves by h Hz. S is the `level`, p its gamma density, R the `ratio` (sum of `true_noise_ratio`; S
    if the noise is known), d_h the random share of harmonic h in R, all shares with sum one being equally likely, E the
    mean over these shares::

        N = 2 w T sqrt(pi R / 3) E[sqrt(sum h^2 d_h)] p(S)

    w is the half window. The mean E is sqrt(mean h^2) minus a term in the spread of h^2. N is set to infinity for
    a level that noise is likely to exceed (below the number of harmonics minus 1/2).
    """
    if level < harmonics - 0.5:
        return math.inf
    number = np.arange(1, harmonics + 1, dtype=np.float64)
    mean = float(np.mean(number**2))
    variance = (float(np.mean(number**4)) - mean**2) / (harmonics + 1)
    rate = math.sqrt(mean) * (1 - variance / (8 * mean**2))
    log_density = (harmonics - 1) * math.log(level) - level - math.lgamma(harmonics)
    return 2 * half_window_hz * seconds * math.sqrt(math.pi * ratio / 3) * rate * math.exp(log_density)


def neg_log_rank(score: float, placebos: FloatArray) -> float:
    """-log of the probability that a comb without a bearing line scores as high; nan for too few `placebos` [n].

    `placebos` are the scores of such combs. The probability is the `rank` of the `score` or, if it is in the upper
    tenth of the placebos, follows from an exponential tail (a generalised Pareto tail of shape zero; Knijnenburg et al.
    2009, Bioinformatics 25, i161, quoted from memory, not checked). Placebos share lines, so some are equal: those
    equal to the threshold of the tail belong to it; if the whole tail has this value, the rank is used.
    """
    if math.isnan(score) or placebos.size < round(1 / TAIL):
        return math.nan
    ordered, count = np.sort(placebos), int(TAIL * placebos.size)
    threshold, upper = float(ordered[-count - 1]), ordered[-count:]
    if score <= threshold or math.isinf(threshold) or not (upper > threshold).any():
        return -math.log(rank(score, placebos))
    return (score - threshold) / float(np.mean(upper - threshold)) - math.log(TAIL)


def rank(score: float, placebos: FloatArray) -> float:
    """Rank of a score, (1 + number of `placebos` [n] at least as strong) / (n + 1)."""
    return float(1 + np.count_nonzero(placebos >= score)) / (placebos.size + 1)


def joint_false_alarm(noise: float, mixed: float, whole: float) -> float:
    """Larger of `noise` and the weighted mean of a comb's ranks among `mixed` and `whole` placebos (see the module)."""
    return max(noise, (1 - FOREIGN_COMB) * mixed + FOREIGN_COMB * whole)


class PlaceboRank(NamedTuple):
    """Ranks of a comb: among mixed placebos, the same with a fitted tail (`neg_log_rank`), among whole placebos."""

    false_alarm: float
    tail_false_alarm: float
    whole_false_alarm: float


def fundamentals(lowest_hz: float, highest_hz: float, relative: float) -> FloatArray:
    """Frequencies [Hz], [n], at equal ratios, `GRID_PER_HALF_WINDOW` of them from f to f (1 + `relative`)."""
    return np.asarray(np.exp(np.arange(math.log(lowest_hz), math.log(highest_hz), relative / GRID_PER_HALF_WINDOW)))


def rank_among_placebos(
    record: Periodogram,
    expected_hz: float,
    half_window_hz: float,
    harmonics: int,
    placebo_hz: FloatArray,
    *,
    combs: int = MIN_PLACEBOS,
) -> PlaceboRank | None:
    """Rank the comb at `expected_hz` among `combs` placebos, which are combs at frequencies without a bearing line.

    The score of a comb is the highest sum of `neg_log_p` in its window. `placebo_hz` [n] are `fundamentals` more than
    two half windows from `expected_hz`. A placebo has the comb's number of lines, relative window and mask. None if
    `placebo_hz` covers fewer than `LEAST_WINDOWS` windows.
    """
    relative = half_window_hz / expected_hz
    if placebo_hz.size < 2 * GRID_PER_HALF_WINDOW * LEAST_WINDOWS:
        return None
    lowest = min(float(placebo_hz[0]), expected_hz) * (1 - APART * relative)
    step = 1 / (_OVERSAMPLING * record.seconds * record.limit_hz)
    log_hz = np.arange(math.log(lowest), math.log(record.limit_hz), step)
    hz = np.exp(log_hz)
    visible, snr = ~record.masked(hz), record.snr_at(hz)
    # Single precision halves the memory and is enough to rank.
    scores = neg_log_p(snr[:, None], np.array([NOISE_BINS]))[:, 0].astype(np.float32)
    width = 2 * max(1, round(math.log1p(relative) / step)) + 1

    def first(fundamental_hz: FloatArray | float, number: int) -> NDArray[np.int64]:
        index = np.rint((np.log(np.multiply(number, fundamental_hz)) - log_hz[0]) / step).astype(np.int64) - width // 2
        return np.asarray(np.clip(index, 0, log_hz.size - width))

    at_own = [slice(at := int(first(expected_hz, number)), at + width) for number in range(1, harmonics + 1)]
    seen, own = (np.array([values[at] for at in at_own]) for values in (visible, scores))
    # Windows of the placebos are cut from the visible part, so that all have as many visible points as the comb's.
    place = np.cumsum(visible) - 1
    windows = np.lib.stride_tricks.sliding_window_view(scores[visible], width)

    def scores_of(fundamental_hz: FloatArray) -> FloatArray:
        total = np.zeros((fundamental_hz.shape[1], width), dtype=np.float32)
        for number, drawn in enumerate(fundamental_hz, 1):
            lines = windows[np.clip(place[first(drawn, number)], 0, windows.shape[0] - 1)]
            lines[:, ~seen[number - 1]] = 1.0
            total += lines
        return _highest(total).astype(np.float64)

    score = float(_highest(np.where(seen, own, np.float32(1.0)).sum(axis=0)[None])[0])
    rng = np.random.default_rng(0)
    near = fundamentals(expected_hz * math.exp(-APART * relative), expected_hz * math.exp(APART * relative), relative)
    choice = rng.choice(placebo_hz, (FUNDAMENTALS_PER_PLACEBO, combs))
    # The first of its fundamentals may be near the comb's own, but not all lines come from it.
    choice[0] = rng.choice(np.concatenate((near, placebo_hz)), combs)
    group = rng.integers(0, FUNDAMENTALS_PER_PLACEBO, (harmonics, combs))
    group[rng.integers(0, harmonics, combs), np.arange(combs)] = rng.integers(1, FUNDAMENTALS_PER_PLACEBO, combs)
    drawn_hz = np.take_along_axis(choice, group, axis=0)
    blocks = [drawn_hz[:, first : first + BLOCK] for first in range(0, combs, BLOCK)]
    placebos = np.concatenate([scores_of(block) for block in blocks])
    stronger = float(np.mean(scores_of(np.tile(placebo_hz, (harmonics, 1))) >= score))
    apart = placebo_hz.size / (2 * GRID_PER_HALF_WINDOW)
    return PlaceboRank(
        rank(score, placebos), math.exp(-neg_log_rank(score, placebos)), (1 + apart * stronger) / (apart + 1)
    )


def _highest(total: NDArray[np.float32]) -> NDArray[np.float32]:
    """Highest interior maximum of each row, [combs]; minus infinity for a row without an interior maximum."""
    top = np.max(total, axis=1)
    edge = (total[:, 0] == top) | (total[:, -1] == top)  # a line outside the window: few rows
    left, middle, right = (total[edge, first : total.shape[1] - 2 + first] for first in range(3))
    top[edge] = np.max(middle, axis=1, where=(middle >= left) & (middle > right), initial=-np.inf)
    return np.asarray(top)
