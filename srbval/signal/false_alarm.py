"""Probability that noise alone shows a line.

Every bin of a noise periodogram is exponentially distributed about the local mean, and that mean is itself estimated:
it is the median of n neighbours over ln 2. ``neg_log_p`` turns the ratio of the two into the exponential variable of
equal tail probability, exactly; summed over harmonics it is a gamma variable. How often that sum rises above a level
somewhere in the window searched is given by Rice's formula.
"""

import math

import numpy as np
import scipy.special

from srbval.arrays import FloatArray


def neg_log_p(snr: FloatArray, bins: FloatArray) -> FloatArray:
    """-log of the probability that noise reaches `snr` at one given frequency; exponential of mean 1 on noise.

    `snr` [..., h] is power over a noise mean estimated as median / ln 2 of `bins` [h] (odd) exponential neighbours.
    The k-th of n ordered exponential variables is a sum of independent ones of rates n, n - 1, ... n - k + 1 (Renyi
    1953, Acta Math. Hung. 4, 191), so that E exp(-x M / ln 2) is a product: its log, the sum of
    ``log(1 + x / (j ln 2))`` over j from (n + 1) / 2 to n, is a difference of log gamma functions.
    """
    half, ratio = (bins + 1) / 2, np.asarray(snr) / math.log(2)
    rise = scipy.special.gammaln(bins + 1 + ratio) - scipy.special.gammaln(half + ratio)
    return np.asarray(rise - scipy.special.gammaln(bins + 1) + scipy.special.gammaln(half))


def true_noise_ratio(snr: FloatArray, bins: FloatArray) -> FloatArray:
    """`snr` [..., h] over the true noise, as it is on average where noise reaches it: smaller for fewer `bins`.

    Noise reaches far above its estimate mostly where the estimate is too low. With `neg_log_p` S this is x dS/dx.
    """
    ratio = np.asarray(snr) / math.log(2)
    rise = scipy.special.digamma(bins + 1 + ratio) - scipy.special.digamma((bins + 1) / 2 + ratio)
    return np.asarray(ratio * rise)


def false_alarm(
    total_neg_log_p: float, total_ratio: float, share: FloatArray, half_window_hz: float, seconds: float
) -> float:
    """Probability that noise shows a peak of a comb with at least this `neg_log_p` anywhere inside the window.

    `share` [h + 1] is the part of the window where this number of the comb's lines is visible, the rest being masked.
    The sum rises above a level on average N times (`upcrossings`), each time to a peak; the probability of any peak is
    ``1 - exp(-N)`` (Davies 1987, Biometrika 74, 33, whose window may also begin above the level: that is no peak
    inside it). One harmonic is a single line.
    """
    crossings = sum(
        float(share[lines]) * upcrossings(total_neg_log_p, total_ratio, lines, half_window_hz, seconds)
        for lines in range(1, share.size)
        if share[lines] > 0
    )
    return -math.expm1(-crossings)


def upcrossings(level: float, ratio: float, harmonics: int, half_window_hz: float, seconds: float) -> float:
    """How often the summed `neg_log_p` of a comb rises above `level` within +-`half_window_hz`, on noise alone.

    Rice's formula (1945, Bell Syst. Tech. J. 24, 46) for a sum of squared moduli of Gaussian spectra. Of a record of
    T = `seconds`, without a window, the spectrum moves with the mean square derivative (pi T)^2 / 3; harmonic h
    moves h times as fast. With the gamma density p of the level S, the sum R of the harmonics' ratios to the noise
    (`true_noise_ratio`; S itself where the noise is known) and shares d_h of it uniform on the simplex::

        N = 2 w T sqrt(pi R / 3) E[sqrt(sum h^2 d_h)] p(S)

    The expectation is sqrt(mean h^2) less a term in the spread of h^2. Below the level that is crossed most often
    a false alarm is certain: the result is infinite.
    """
    if level < harmonics - 0.5:
        return math.inf
    number = np.arange(1, harmonics + 1, dtype=np.float64)
    mean = float(np.mean(number**2))
    variance = (float(np.mean(number**4)) - mean**2) / (harmonics + 1)
    rate = math.sqrt(mean) * (1 - variance / (8 * mean**2))
    log_density = (harmonics - 1) * math.log(level) - level - math.lgamma(harmonics)
    return 2 * half_window_hz * seconds * math.sqrt(math.pi * ratio / 3) * rate * math.exp(log_density)
