"""False-alarm probability of a line: from noise alone, and by its rank among placebos of the same record.

`neg_log_p` turns the power of a bin over its noise into an exponential variable; Rice's formula gives how often its sum
over harmonics rises above a level within a search window. Real noise contains lines of other machines, so a comb (line
with harmonics) is also ranked among placebos, combs at frequencies without a bearing line. The harmonics of a whole
placebo belong to one fundamental; in a mixed placebo each is taken from one of two fundamentals at random. There are
only some tens of whole placebos, but they can be real combs of other sources; `joint_false_alarm` weights both ranks.
"""

import math

import numpy as np
import scipy.special
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.signal.periodogram import NOISE_BINS, Periodogram

MIN_PLACEBOS = 1000  # their least rank, times nine trials, stays below `comb.PLACEBO_FALSE_ALARM`
FUNDAMENTALS_PER_PLACEBO = 2  # number of fundamentals of the lines of one placebo
GRID_PER_HALF_WINDOW = 8  # fundamentals per half window
LEAST_WINDOWS = 4  # least number of whole windows among the placebos' fundamentals
FOREIGN_COMB = 0.1  # assumed share of records with a comb of another source; stated
APART = 2.0  # windows this many half windows apart share no line
_OVERSAMPLING = 2  # candidates per bin of the highest line
BLOCK = 4096  # placebos scored at a time


def neg_log_p(snr: FloatArray, bins: FloatArray) -> FloatArray:
    """Compute -log of the probability that noise alone reaches `snr` [..., h] at one frequency, for each of h lines.

    `snr` is power over the mean noise, estimated as M / ln 2 from the median M of `bins` [h] (odd) nearby bins. For
    noise, the result is exponential with mean 1. The k-th smallest of n exponential variables is a sum of such
    variables of rates n, ... n - k + 1 (Renyi 1953, Acta Math. Hung. 4, 191), so the log of the mean of exp(-`snr` M /
    ln 2) is a difference of log gamma functions.
    """
    half, ratio = (bins + 1) / 2, np.asarray(snr) / math.log(2)
    rise = scipy.special.gammaln(bins + 1 + ratio) - scipy.special.gammaln(half + ratio)
    return np.asarray(rise - scipy.special.gammaln(bins + 1) + scipy.special.gammaln(half))


def true_noise_ratio(snr: FloatArray, bins: FloatArray) -> FloatArray:
    """Expected power of a noise peak over the true mean noise, if the peak is `snr` [..., h] times the estimated noise.

    The result is less than `snr`, because the noise estimated from `bins` [h] nearby bins is probably too low beside so
    high a peak of noise. With S = `neg_log_p` it is `snr` dS/dsnr.
    """
    ratio = np.asarray(snr) / math.log(2)
    rise = scipy.special.digamma(bins + 1 + ratio) - scipy.special.digamma((bins + 1) / 2 + ratio)
    return np.asarray(ratio * rise)


def false_alarm(
    total_neg_log_p: float, total_ratio: float, share: FloatArray, half_window_hz: float, seconds: float
) -> float:
    """Probability that on noise alone a comb's summed `neg_log_p` reaches `total_neg_log_p` within a search window.

    The window is +-`half_window_hz` in a record of `seconds`, `total_ratio` the sum of `true_noise_ratio` over the h
    lines. In the share `share[k]` of the window, k lines are outside the spectrum's masked (ignored) zones. With N
    upward crossings on average (`upcrossings`) the probability is ``1 - exp(-N)`` (Davies 1987, Biometrika 74, 33).
    """
    crossings = 0.0
    for lines in np.flatnonzero(share[1:]) + 1:
        crossings += share[lines] * upcrossings(total_neg_log_p, total_ratio, int(lines), half_window_hz, seconds)
    return -math.expm1(-crossings)


def upcrossings(level: float, ratio: float, harmonics: int, half_window_hz: float, seconds: float) -> float:
    """Mean number N of rises of a comb's summed `neg_log_p` above `level` within +-`half_window_hz`, on noise alone.

    A comb is a line with its harmonics. N follows from Rice's formula (1945, Bell Syst. Tech. J. 24, 46) for a sum of
    squared moduli of Gaussian spectra, if the record is not multiplied by a window function::

        N = 2 w T sqrt(pi R / 3) E[sqrt(sum h^2 d_h)] p(S)

    w is `half_window_hz`, T is `seconds`, S is `level`, and p is the gamma density of the sum of `neg_log_p`. R is
    `ratio`, the summed power of the lines over the true mean noise (`true_noise_ratio`). Harmonic h has the random
    share d_h of R and moves h times as far as the fundamental. E is the mean over the d_h, if all shares with sum one
    are equally likely: sqrt(mean h^2) minus a term in the spread of h^2. N is infinite if noise is likely to exceed S
    (S < `harmonics` - 1/2).
    """
    if level < harmonics - 0.5:
        return math.inf
    number = np.arange(1, harmonics + 1, dtype=np.float64)
    mean = float(np.mean(number**2))
    variance = (float(np.mean(number**4)) - mean**2) / (harmonics + 1)
    rate = math.sqrt(mean) * (1 - variance / (8 * mean**2))
    log_density = (harmonics - 1) * math.log(level) - level - math.lgamma(harmonics)
    return 2 * half_window_hz * seconds * math.sqrt(math.pi * ratio / 3) * rate * math.exp(log_density)


def joint_false_alarm(noise: float, mixed: float, whole: float) -> float:
    """False-alarm probability of a comb (line with harmonics): the larger of `noise` and a mean of two ranks.

    `whole` (weight `FOREIGN_COMB`) is the rank among other combs, `mixed` among combs with lines of two fundamentals.
    """
    return max(noise, (1 - FOREIGN_COMB) * mixed + FOREIGN_COMB * whole)


def fundamentals(lowest_hz: float, highest_hz: float, relative: float) -> FloatArray:
    """Frequencies [Hz], [n], at equal ratios; `GRID_PER_HALF_WINDOW` of them cover f to f (1 + `relative`)."""
    return np.asarray(np.exp(np.arange(math.log(lowest_hz), math.log(highest_hz), relative / GRID_PER_HALF_WINDOW)))


def rank_among_placebos(
    record: Periodogram,
    expected_hz: float,
    half_window_hz: float,
    harmonics: int,
    placebo_hz: FloatArray,
    *,
    combs: int = MIN_PLACEBOS,
) -> tuple[float, float] | None:
    """Rank the comb (line with harmonics) at `expected_hz` among `combs` mixed placebos, and among whole placebos.

    A rank is the share of combs that are at least as strong. Placebos are combs without a bearing line.
    A comb's score is the highest sum in its search window of its lines' `neg_log_p`, -log of the probability on noise.
    `placebo_hz` [n] are `fundamentals` more than two half windows away from the comb. A placebo has the comb's number
    of lines, relative window and masked (ignored) points. None if `placebo_hz` covers under `LEAST_WINDOWS` windows.
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
    mixed = (1 + np.count_nonzero(placebos >= score)) / (combs + 1)
    return mixed, (1 + apart * stronger) / (apart + 1)


def _highest(total: NDArray[np.float32]) -> NDArray[np.float32]:
    """Highest interior maximum of each row (one per comb) of `total`; minus infinity if the row has no such maximum."""
    top = np.max(total, axis=1)
    edge = (total[:, 0] == top) | (total[:, -1] == top)  # a line outside the window: few rows
    left, middle, right = (total[edge, first : total.shape[1] - 2 + first] for first in range(3))
    top[edge] = np.max(middle, axis=1, where=(middle >= left) & (middle > right), initial=-np.inf)
    return np.asarray(top)
