"""How likely noise alone would have shown a line.

Every bin of a noise periodogram is exponential about the local mean. That mean is itself estimated, from
`bins` neighbours, so a line of x times the estimated mean has the tail (1 + x/L)^-L instead of exp(-x).
``evidence`` turns x into the exponential variable of equal tail; evidence adds over harmonics to a gamma
variable. The number of places searched multiplies the chances.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.special
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def evidence(snr: FloatArray, bins: FloatArray) -> FloatArray:
    """Minus log of the chance that noise reaches `snr` at one given place; exponential of mean 1 on noise.

    `snr` is power over estimated mean noise power, `bins` the effective number of bins of the estimate.
    """
    return bins * np.log1p(snr / bins)


def false_alarm(total_evidence: float, harmonics: int, trials: float) -> float:
    """Chance that noise shows a comb of `harmonics` lines with this much evidence in `trials` places.

    ``1 - (1 - Q(H, S))^K``, Q the regularised upper incomplete gamma function; one harmonic is a single
    line, ``1 - (1 - exp(-S))^K``.
    """
    single = float(scipy.special.gammaincc(harmonics, total_evidence))
    if single >= 1.0:
        return 1.0
    return -math.expm1(max(trials, 1.0) * math.log1p(-single))


def comb_trials(half_window_hz: float, seconds: float, harmonics: int) -> float:
    """Independent places in a search of +-`half_window_hz` about the fundamental, ``4 w T sqrt(mean h^2)``.

    A periodogram off its bins has about two independent maxima a bin. Harmonic h moves h times as fast as
    the fundamental; how often their sum peaks goes with the root mean square of these rates (Rice 1945, Bell
    Syst. Tech. J. 24, 46). One harmonic: ``4 w T``.
    """
    mean_square = (harmonics + 1) * (2 * harmonics + 1) / 6
    return max(1.0, 4 * half_window_hz * seconds * math.sqrt(mean_square))
