"""How likely noise alone would have shown a line.

Every bin of a noise periodogram is exponential about the local mean, and that mean is itself estimated: it is the
median of n neighbours over ln 2. ``evidence`` turns the ratio of the two into the exponential variable of equal
tail, exactly; evidence adds over harmonics to a gamma variable. How often that sum rises above a level somewhere in
the window searched is counted after Rice.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.special
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def evidence(snr: FloatArray, bins: FloatArray) -> FloatArray:
    """Minus log of the chance that noise reaches `snr` at one given place; exponential of mean 1 on noise.

    `snr` [..., h] is power over a noise mean estimated as median / ln 2 of `bins` [h] (odd) exponential neighbours.
    The k-th of n ordered exponential variables is a sum of independent ones of rates n, n - 1, ... n - k + 1 (Renyi
    1953, Acta Math. Hung. 4, 191), so that E exp(-x M / ln 2) is a product: its log is summed here.
    """
    result = np.empty(np.shape(snr))
    for column, count in enumerate(bins):
        rates = np.arange((int(count) + 1) // 2, int(count) + 1) * math.log(2)
        result[..., column] = np.log1p(np.asarray(snr)[..., column, None] / rates).sum(axis=-1)
    return result


def false_alarm(total_evidence: float, harmonics: int, half_window_hz: float, seconds: float) -> float:
    """Chance that noise shows a comb of `harmonics` lines with this much evidence anywhere in the window.

    The comb's evidence is a gamma variable of `harmonics` degrees at any one place: tail Q(H, S). Moving through the
    window it rises above S on average N times (`upcrossings`), and never with the chance
    ``(1 - Q(H, S)) exp(-N)`` (Davies 1987, Biometrika 74, 33). One harmonic is a single line.
    """
    single = float(scipy.special.gammaincc(harmonics, total_evidence))
    if single >= 1.0:
        return 1.0
    crossings = upcrossings(total_evidence, harmonics, half_window_hz, seconds)
    return -math.expm1(math.log1p(-single) - crossings)


def upcrossings(level: float, harmonics: int, half_window_hz: float, seconds: float) -> float:
    """How often the evidence of a comb rises above `level` within +-`half_window_hz` about the fundamental, on noise.

    Rice's count (1945, Bell Syst. Tech. J. 24, 46) for a sum of squared moduli of Gaussian spectra. Of a record of
    T = `seconds`, without a window, the spectrum moves with the mean square derivative (pi T)^2 / 3; harmonic h
    moves h times as fast. With the gamma density p of the level and shares d_h of it uniform on the simplex::

        N = 2 w T sqrt(pi S / 3) E[sqrt(sum h^2 d_h)] p(S)

    The expectation is sqrt(mean h^2) less a term in the spread of h^2. Below the level that is crossed most often
    that level's count is returned: a certain false alarm.
    """
    at = max(level, harmonics - 0.5)
    number = np.arange(1, harmonics + 1, dtype=np.float64)
    mean = float(np.mean(number**2))
    variance = (float(np.mean(number**4)) - mean**2) / (harmonics + 1)
    rate = math.sqrt(mean) * (1 - variance / (8 * mean**2))
    log_density = (harmonics - 1) * math.log(at) - at - math.lgamma(harmonics)
    return 2 * half_window_hz * seconds * math.sqrt(math.pi * at / 3) * rate * math.exp(log_density)
