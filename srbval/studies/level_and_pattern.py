"""Level and pattern of a record's errors in bands, tested apart; what levels scatter by from one mounting to the next.

The errors E of n bands have the covariance V. Generalised least squares (Aitken 1935, Proc. R. Soc. Edinb. 55, 42) give
the level b that all share, with u_b^2 = 1 / (1' V^-1 1); what is left of E' V^-1 E, D^2, is the pattern's. With a right
model b / u_b is normal and D^2 chi-squared with n - 1 degrees of freedom.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from srbval.arrays import FloatArray

SCATTERS_DB = np.linspace(0.02, 12.0, 600)


@dataclass(frozen=True, kw_only=True)
class LevelAndPattern:
    """Common `level` [dB] with its standard deviation `u`, `d2` of the pattern over `bands`; the chances of both."""

    bands: int
    level: float
    u: float
    level_p: float
    d2: float
    pattern_p: float | None  # None of one band


def level_and_pattern(errors: ArrayLike, covariance: ArrayLike) -> LevelAndPattern:
    """Of errors [dB], [n], and their covariance [n, n]."""
    from scipy.special import chdtrc

    error, whole = np.asarray(errors, dtype=float), np.asarray(covariance, dtype=float)
    weights = np.linalg.solve(whole, np.ones(error.size))
    u = 1 / math.sqrt(float(weights.sum()))
    level = float(weights @ error) * u**2
    d2 = max(float(error @ np.linalg.solve(whole, error)) - (level / u) ** 2, 0.0)
    return LevelAndPattern(
        bands=error.size, level=level, u=u, level_p=math.erfc(abs(level / u) / math.sqrt(2)), d2=d2,
        pattern_p=float(chdtrc(error.size - 1, d2)) if error.size > 1 else None,
    )  # fmt: skip


def draws_covariance(draws: ArrayLike, own_u: ArrayLike) -> FloatArray:
    """Covariance of n bands: that of stored `draws` of the inputs [draws, n], and each band's own u, [n], all in dB."""
    drawn = np.asarray(draws, dtype=float)
    return np.atleast_2d(np.cov(drawn, rowvar=False)) + np.diag(np.square(own_u))


def mounting_scatter(quieter_db: ArrayLike, reading_u_db: ArrayLike, prior_db: float) -> tuple[float, float, float]:
    """Standard deviation of one mounting's levels [dB]: its mean and 95 % interval after the differences.

    `quieter_db`: how far faulty records lie below healthy ones in bands, [n], with one standard deviation of reading
    both. A fault adds nothing there: half of a normal distribution of variance 2 tau^2 + u^2. Prior: half-normal.
    Bands count as independent.
    """
    off, own = np.abs(np.asarray(quieter_db, dtype=float)), np.asarray(reading_u_db, dtype=float)
    variance = 2 * SCATTERS_DB[:, None] ** 2 + own**2
    logarithm = -(SCATTERS_DB**2) / (2 * prior_db**2) - (np.log(variance) + off**2 / variance).sum(axis=1) / 2
    weight = np.exp(logarithm - logarithm.max())
    share = np.cumsum(weight) / weight.sum()
    low, high = np.interp((0.025, 0.975), share, SCATTERS_DB)
    return float(weight @ SCATTERS_DB / weight.sum()), float(low), float(high)
