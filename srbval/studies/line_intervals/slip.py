"""Calibration of the interval of a slipping line.

Drawn are the residuals and the slope that noise and a random walk of every ratio leave; the table's factors are
moved until no ratio's coverage lies further from the middle of what is asked for than need be.
"""

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from srbval.signal.interval import SlipInterval, slip_interval
from srbval.signal.slip import RATIOS, modes_of, weigh

FloatArray = NDArray[np.float64]

BLOCKS, MODES, DRAWS = 96, 24, 8000
TRIED = np.concatenate(([0.0], np.geomspace(0.1, 3e4, 24)))
WANTED, FREE = 0.951, 0.02  # coverage aimed at, and how far off costs nothing
USUAL = 2.1  # factor that wider ones are kept near where coverage allows
STEPS = 300


def drawn(ratio: float, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Spread [draws] that the residuals suggest, and the modulus of the slope's error in noise errors [draws]."""
    modes = modes_of(BLOCKS)
    kept = np.argsort(modes.share)[::-1][:MODES]
    share, cross = modes.share[kept], modes.with_slope[kept] / math.sqrt(modes.slope_variance)
    covariance = np.eye(MODES + 1)
    covariance[0, 0] += ratio
    covariance[1:, 1:] += ratio * np.diag(share)
    covariance[0, 1:] = covariance[1:, 0] = ratio * cross
    sample = rng.standard_normal((DRAWS, MODES + 1)) @ np.linalg.cholesky(covariance).T
    weight = np.array([weigh(row, share)[0] for row in sample[:, 1:]])
    carried = weight @ (RATIOS[:, None] * cross / (1 + RATIOS[:, None] * share))
    error = sample[:, 0] - np.sum(carried * sample[:, 1:], axis=1)
    return weight @ np.log1p(RATIOS), np.abs(error)


def coverage(table: SlipInterval, spread: FloatArray, error: FloatArray) -> float:
    """Share of draws whose error lies within the table's half width (`SlipInterval.half_width`, all draws at once)."""
    wide = np.exp(spread / 2) * np.interp(spread, table.log_spread, table.factor)
    half = np.where(spread < table.start, table.floor, np.maximum(table.floor, wide))
    return float(np.mean(error < half))


def calibrate(seed: int = 0) -> SlipInterval:
    """The table again, from the present one's floor and knots."""
    import scipy.optimize

    rng = np.random.default_rng(seed)
    draws = [drawn(float(ratio), rng) for ratio in TRIED]
    old = slip_interval()

    def table(logs: FloatArray) -> SlipInterval:
        factor = tuple(float(f) for f in np.exp(logs))
        return dataclasses.replace(old, factor=factor)

    def cost(logs: FloatArray) -> float:
        off = np.array([abs(coverage(table(logs), *draw) - WANTED) for draw in draws])
        beyond = np.maximum(off - FREE, 0)
        return float(20 * beyond.max() + 2 * beyond.mean() + 0.01 * np.mean((logs - math.log(USUAL)) ** 2))

    found = scipy.optimize.minimize(
        cost, np.log(old.factor), method="Nelder-Mead", options={"maxiter": STEPS, "adaptive": True}
    )
    return table(found.x)


def table() -> str:
    """The table anew, as TOML, with its coverage of fresh draws."""
    new = calibrate()
    fresh = np.random.default_rng(1)
    shares = [coverage(new, *drawn(float(ratio), fresh)) for ratio in TRIED]
    return (
        f"# coverage of fresh draws: {min(shares):.3f} to {max(shares):.3f}\n"
        f"floor = {new.floor}\nstart = {new.start}\n"
        f"log_spread = {list(new.log_spread)}\nfactor = {[round(f, 2) for f in new.factor]}"
    )
