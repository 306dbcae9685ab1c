"""A Gaussian process through a few runs of the model: the quantity as a function of all open inputs at once.

Constant mean, squared-exponential covariance with a length for every input, and a noise for what inputs do not settle
(where a run starts); by the largest marginal likelihood (Rasmussen & Williams 2006, sect. 2.3, 5.4.1). Its own check is
to predict each run from all others, in closed form (sect. 5.4.2): the residual over its predicted deviation is z, and
|z| > 2 should happen in about one in twenty.
"""

import math
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray

LENGTHS, SIGNAL, NOISE = (0.1, 30.0), (0.05, 20.0), (1e-3, 2.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Emulator:
    """Fitted to `points`, [n, inputs] in 0 to 1. `residuals` and `z` are those of leaving each run out, [n]."""

    points: FloatArray
    lengths: FloatArray
    signal: float
    weights: FloatArray
    mean: float
    scale: float
    residuals: FloatArray
    z: FloatArray

    @property
    def outside(self) -> float:
        """Share of the runs that the others predict by more than two of their deviations wrong."""
        return float(np.mean(np.abs(self.z) > 2))

    def __call__(self, points: FloatArray) -> FloatArray:
        """Predicted mean at `points`, [m, inputs]; shape [m]."""
        kernel = _kernel(points, self.points, self.lengths, self.signal)
        return np.asarray(self.mean + self.scale * (kernel @ self.weights))


def fit_emulator(points: FloatArray, values: FloatArray) -> Emulator:
    """Fit to runs at `points`, [n, inputs] in 0 to 1, whose `values` are [n]."""
    from scipy.optimize import minimize

    mean, scale = float(values.mean()), float(values.std()) or 1.0
    y = (values - mean) / scale
    inputs = points.shape[1]
    bounds = [tuple(map(math.log, ends)) for ends in (*(LENGTHS,) * inputs, SIGNAL, NOISE)]
    starts = [np.log([*([length] * inputs), 1.0, noise]) for length, noise in ((1.0, 0.1), (5.0, 0.5))]
    found = [minimize(_cost, start, args=(points, y), jac=True, bounds=bounds, method="L-BFGS-B") for start in starts]
    best = np.exp(min(found, key=lambda one: one.fun).x)
    lengths, signal, noise = best[:inputs], float(best[-2]), float(best[-1])
    inverse = np.linalg.inv(_kernel(points, points, lengths, signal) + noise**2 * np.eye(y.size))
    weights, diagonal = inverse @ y, np.diag(inverse)
    return Emulator(
        points=points, lengths=lengths, signal=signal, weights=weights, mean=mean, scale=scale,
        residuals=scale * weights / diagonal, z=weights / np.sqrt(diagonal),
    )  # fmt: skip


def _kernel(a: FloatArray, b: FloatArray, lengths: FloatArray, signal: float) -> FloatArray:
    apart = (((a[:, None, :] - b[None, :, :]) / lengths) ** 2).sum(axis=2)
    return np.asarray(signal**2 * np.exp(-0.5 * apart))


def _cost(log: FloatArray, points: FloatArray, y: FloatArray) -> tuple[float, FloatArray]:
    """Negative logarithm of the marginal likelihood, and its gradient in the logarithms of the parameters."""
    *lengths, signal, noise = np.exp(log)
    smooth = _kernel(points, points, np.array(lengths), signal)
    inverse = np.linalg.inv(covariance := smooth + noise**2 * np.eye(y.size))
    alpha = inverse @ y
    cost = 0.5 * y @ alpha + 0.5 * np.linalg.slogdet(covariance)[1]
    inner = inverse - np.outer(alpha, alpha)
    apart = ((points[:, None, :] - points[None, :, :]) / np.array(lengths)) ** 2
    by_length = 0.5 * np.einsum("ij,ij,ijk->k", inner, smooth, apart)
    return float(cost), np.array([*by_length, np.sum(inner * smooth), noise**2 * np.trace(inner)])
