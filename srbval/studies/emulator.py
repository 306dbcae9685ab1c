"""A Gaussian process through a few runs of the model: the quantity as a function of all open inputs at once.

Constant mean, squared-exponential covariance with a length for every input, and a noise for what the covariance does
not follow; by the largest marginal likelihood (Rasmussen & Williams 2006, sect. 2.3, 5.4.1). Each group of runs has a
noise of its own: of the printed roller diameter more of a sideband is left open than of play. Its own check is to
predict each run from all others, in closed form (sect. 5.4.2): the residual over its predicted deviation is z, and
|z| > 2 should happen in about one in twenty.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from srbval.arrays import FloatArray, IntArray

# Ends of the parameters: the cage ratio changes over a thirtieth of the critical velocity's two decades.
LENGTHS, SIGNAL, NOISE = (0.03, 30.0), (0.05, 20.0), (1e-3, 2.0)


FOLDS = 10
# Where the parameters' search begins: lengths and noise; for a fold the first alone.
STARTS = ((1.0, 0.1), (5.0, 0.5))


@dataclass(frozen=True, kw_only=True, eq=False)
class Emulator:
    """Fitted to `points`, [n, inputs] in 0 to 1. `residuals` are what it misses of runs it never saw, [n].

    These are of ten fits, each without a tenth of the runs: parameters that were fitted to a run hide what they miss
    of it. `z` is that of leaving each run out with the parameters held, [n].
    """

    points: FloatArray
    lengths: FloatArray
    signal: float
    noise: FloatArray
    weights: FloatArray
    mean: float
    scale: float
    z: FloatArray
    residuals: FloatArray = field(default_factory=lambda: np.empty(0))

    @property
    def outside(self) -> float:
        """Share of the runs that the others predict by more than two of their deviations wrong."""
        return float(np.mean(np.abs(self.z) > 2))

    def __call__(self, points: FloatArray) -> FloatArray:
        """Predicted mean at `points`, [m, inputs]; shape [m]."""
        kernel = _kernel(points, self.points, self.lengths, self.signal)
        return np.asarray(self.mean + self.scale * (kernel @ self.weights))


def fit_emulator(points: FloatArray, values: FloatArray, groups: IntArray | None = None) -> Emulator:
    """Fit to runs at `points`, [n, inputs] in 0 to 1, whose `values` are [n], of `groups` [n] from 0, or one."""
    groups = np.zeros(values.size, dtype=int) if groups is None else groups
    residuals, fold = np.empty(values.size), np.arange(values.size) % FOLDS
    for one in range(FOLDS):
        kept, out = fold != one, fold == one
        residuals[out] = values[out] - _fit(points[kept], values[kept], groups[kept], STARTS[:1])(points[out])
    return replace(_fit(points, values, groups, STARTS), residuals=residuals)


def _fit(points: FloatArray, values: FloatArray, groups: IntArray, begins: Sequence[tuple[float, float]]) -> Emulator:
    from scipy.optimize import minimize

    mean, scale = float(values.mean()), float(values.std()) or 1.0
    y = (values - mean) / scale
    inputs, count = points.shape[1], int(groups.max()) + 1
    bounds = [tuple(map(math.log, ends)) for ends in (*(LENGTHS,) * inputs, SIGNAL, *(NOISE,) * count)]
    starts = [np.log([*([length] * inputs), 1.0, *([noise] * count)]) for length, noise in begins]
    found = [
        minimize(_cost, start, args=(points, y, groups), jac=True, bounds=bounds, method="L-BFGS-B") for start in starts
    ]
    best = np.exp(min(found, key=lambda one: one.fun).x)
    lengths, signal, noise = best[:inputs], float(best[inputs]), best[inputs + 1 :]
    inverse = np.linalg.inv(_kernel(points, points, lengths, signal) + np.diag(noise[groups] ** 2))
    weights = inverse @ y
    return Emulator(
        points=points, lengths=lengths, signal=signal, noise=noise, weights=weights, mean=mean, scale=scale,
        z=weights / np.sqrt(np.diag(inverse)),
    )  # fmt: skip


def _kernel(a: FloatArray, b: FloatArray, lengths: FloatArray, signal: float) -> FloatArray:
    apart = (((a[:, None, :] - b[None, :, :]) / lengths) ** 2).sum(axis=2)
    return np.asarray(signal**2 * np.exp(-0.5 * apart))


def _cost(log: FloatArray, points: FloatArray, y: FloatArray, groups: IntArray) -> tuple[float, FloatArray]:
    """Negative logarithm of the marginal likelihood, and its gradient in the logarithms of the parameters."""
    inputs = points.shape[1]
    lengths, signal, noise = np.exp(log[:inputs]), math.exp(log[inputs]), np.exp(log[inputs + 1 :])[groups]
    smooth = _kernel(points, points, lengths, signal)
    inverse = np.linalg.inv(covariance := smooth + np.diag(noise**2))
    alpha = inverse @ y
    cost = 0.5 * y @ alpha + 0.5 * np.linalg.slogdet(covariance)[1]
    inner = inverse - np.outer(alpha, alpha)
    apart = ((points[:, None, :] - points[None, :, :]) / lengths) ** 2
    by_length = 0.5 * np.einsum("ij,ij,ijk->k", inner, smooth, apart)
    by_noise = np.bincount(groups, weights=np.diag(inner) * noise**2, minlength=log.size - inputs - 1)
    return float(cost), np.array([*by_length, np.sum(inner * smooth), *by_noise])
