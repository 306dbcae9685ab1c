"""How likely noise alone would have shown a line.

Every bin of a noise periodogram is exponential about the local mean, and that mean is itself estimated: it is the
median of n neighbours over ln 2. ``evidence`` turns the ratio of the two into the exponential variable of equal
tail, exactly; evidence adds over harmonics to a gamma variable. How often that sum rises above a level somewhere in
the window searched is counted after Rice.
"""

from __future__ import annotations

import math

import numpy as np
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


def likely_ratio(snr: FloatArray, bins: FloatArray) -> FloatArray:
    """What `snr` [..., h] is over the noise as it is on average where noise reaches it: the less the fewer the `bins`.

    Noise reaches far above an estimate mostly where the estimate is too low. With `evidence` E this is x dE/dx.
    """
    result = np.empty(np.shape(snr))
    for column, count in enumerate(bins):
        rates = np.arange((int(count) + 1) // 2, int(count) + 1) * math.log(2)
        ratio = np.asarray(snr)[..., column, None]
        result[..., column] = (ratio / (rates + ratio)).sum(axis=-1)
    return result


def false_alarm(
    total_evidence: float, total_ratio: float, share: FloatArray, half_window_hz: float, seconds: float
) -> float:
    """Chance that noise shows a peak of a comb with this much evidence anywhere inside the window.

    `share` [h + 1] is the part of the window where so many of the comb's lines can be seen, the rest being masked. The
    evidence rises above a level on average N times (`upcrossings`), each time to a peak; that of peaks at all is
    ``1 - exp(-N)`` (Davies 1987, Biometrika 74, 33, whose window may also begin above the level: that is no peak
    inside it). One harmonic is a single line.
    """
    crossings = sum(
        float(share[lines]) * upcrossings(total_evidence, total_ratio, lines, half_window_hz, seconds)
        for lines in range(1, share.size)
        if share[lines] > 0
    )
    return -math.expm1(-crossings)


def upcrossings(level: float, ratio: float, harmonics: int, half_window_hz: float, seconds: float) -> float:
    """How often the evidence of a comb rises above `level` within +-`half_window_hz` about the fundamental, on noise.

    Rice's count (1945, Bell Syst. Tech. J. 24, 46) for a sum of squared moduli of Gaussian spectra. Of a record of
    T = `seconds`, without a window, the spectrum moves with the mean square derivative (pi T)^2 / 3; harmonic h
    moves h times as fast. With the gamma density p of the level S, the sum R of the harmonics' ratios to the noise
    (`likely_ratio`; S itself where the noise is known) and shares d_h of it uniform on the simplex::

        N = 2 w T sqrt(pi R / 3) E[sqrt(sum h^2 d_h)] p(S)

    The expectation is sqrt(mean h^2) less a term in the spread of h^2. Below the level that is crossed most often
    a false alarm is certain: infinity is returned.
    """
    if level < harmonics - 0.5:
        return math.inf
    number = np.arange(1, harmonics + 1, dtype=np.float64)
    mean = float(np.mean(number**2))
    variance = (float(np.mean(number**4)) - mean**2) / (harmonics + 1)
    rate = math.sqrt(mean) * (1 - variance / (8 * mean**2))
    log_density = (harmonics - 1) * math.log(level) - level - math.lgamma(harmonics)
    return 2 * half_window_hz * seconds * math.sqrt(math.pi * ratio / 3) * rate * math.exp(log_density)
