"""The mean cage ratio over the records of each speed, which differ by more than their readings: random effects.

Mounting, load zone, temperature, the cage itself are others in each record. The ratios y are X m + b + e: effects m by
the design X, b normal and independent of the standard deviation tau, e normal of the records' joint covariance, in
which the tachometer's scale is one for all. The effects have flat priors, tau a half-normal one, which few records need
(Friede, Roever, Wandel & Neuenschwander 2017, Res. Synth. Methods 8, 79; with a design: Roever & Friede 2023, Comput.
Methods Programs Biomed. 229, 107303; both quoted from memory, not checked). Given tau the effects are those of weighted
least squares; tau's own posterior, with V = covariance + tau^2 I and the residuals r,

    p(tau | y) ~ p(tau) |V|^(-1/2) |X' V^-1 X|^(-1/2) exp(-r' V^-1 r / 2)

is taken on a grid. `tests/comparison/test_cage_readings.py` counts how often its intervals hold the truth.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.comparison.budget import PRIOR
from srbval.comparison.cage_readings import CageReading
from srbval.errors import DataError
from srbval.recordings.speed import SCALE_CI95
from srbval.signal import NORMAL_95

DRAWS, GRID, SEED = 4096, 200, 8
FARTHEST = 5.0  # end of the grid, in scales of tau's prior and in spreads of the values


@dataclass(frozen=True, kw_only=True, eq=False)
class CageMeans:
    """Mean cage ratio over the records of each nominal speed [rpm], rising, and how records scatter about it.

    `between_u` is the standard deviation between records, the median of its distribution, and `between_ci95` its 95 %
    interval; `draws` are of the means' joint distribution, [draws, speeds], `outer_less_inner` of how much higher it
    is with a fault of the outer race than with one of the inner, [draws], None where no records show that; for the
    means all records of a speed are alike.
    """

    rpm: tuple[float, ...]
    records: tuple[int, ...]
    means: tuple[float, ...]
    between_u: float
    between_ci95: tuple[float, float]
    draws: FloatArray
    outer_less_inner: FloatArray | None


def covariance(readings: Sequence[CageReading]) -> FloatArray:
    """Of the records' ratios by reading and speed, [records, records]: the tachometer's scale is common to all."""
    per_speed = np.array([one.per_speed for one in readings])
    scale_u = SCALE_CI95 / NORMAL_95
    own = [one.reading_u**2 + max(one.speed_u**2 - (one.per_speed * scale_u) ** 2, 0.0) for one in readings]
    return np.asarray(np.diag(own) + scale_u**2 * np.outer(per_speed, per_speed))


def cage_means(readings: Sequence[CageReading]) -> CageMeans:
    """Of the records' ratios, by nominal speed; `DataError` where no speed has two records."""
    rpm, place = np.unique([one.nominal_rpm for one in readings], return_inverse=True)
    if len(readings) <= rpm.size:
        raise DataError(f"{len(readings)} records at {rpm.size} speeds show a cage ratio; two at one speed are needed.")
    ratios, own, speeds = np.array([one.ratio for one in readings]), covariance(readings), np.eye(rpm.size)[place]
    scale = PRIOR.between_pct / 100 * float(ratios.mean())
    found = random_effects(ratios, own, speeds, between_scale=scale)
    races = np.array([(one.state is Fault.OUTER) - (one.state is Fault.INNER) for one in readings]) / 2
    design, apart = np.column_stack((speeds, races)), None
    if len(readings) > design.shape[1] == np.linalg.matrix_rank(design):
        apart = random_effects(ratios, own, design, between_scale=scale).effects[:, -1]
    low, middle, high = np.quantile(found.between, (0.025, 0.5, 0.975)).tolist()
    return CageMeans(
        rpm=tuple(rpm.tolist()), records=tuple(np.bincount(place).tolist()),
        means=tuple(found.effects.mean(axis=0).tolist()), between_u=middle,
        between_ci95=(low, high), draws=found.effects, outer_less_inner=apart,
    )  # fmt: skip


class RandomEffects(NamedTuple):
    """Draws of the joint posterior: `effects`, [`DRAWS`, effects], and `between`, tau, [`DRAWS`]."""

    effects: FloatArray
    between: FloatArray


def random_effects(
    values: FloatArray, covariance: FloatArray, design: FloatArray, *, between_scale: float
) -> RandomEffects:
    """Of `values` [n] with `covariance` [n, n] and `design` [n, effects], of full rank and with fewer effects than n.

    `between_scale` is that of the half-normal prior of tau, in the values' unit.
    """
    spread = float(np.std(values - design @ np.linalg.lstsq(design, values)[0]))
    tau = np.linspace(0, FARTHEST * max(between_scale, spread), GRID)
    own = covariance + tau[:, None, None] ** 2 * np.eye(values.size)
    weighed = np.linalg.solve(own, np.broadcast_to(design, (GRID, *design.shape)))
    information = design.T @ weighed
    effects = np.linalg.solve(information, (values @ weighed)[..., None])[..., 0]
    residual = values - effects @ design.T
    fit = (residual * np.linalg.solve(own, residual[..., None])[..., 0]).sum(axis=1)
    log_det = np.linalg.slogdet(own)[1] + np.linalg.slogdet(information)[1]
    log_p = -(fit + log_det + (tau / between_scale) ** 2) / 2
    rng, covariances = np.random.default_rng(SEED), np.linalg.inv(information)
    p = np.exp(log_p - log_p.max())
    drawn = rng.choice(tau.size, DRAWS, p=p / p.sum())
    normal = rng.standard_normal((DRAWS, design.shape[1]))
    moved = np.einsum("dij,dj->di", np.linalg.cholesky(covariances)[drawn], normal)
    return RandomEffects(effects[drawn] + moved, tau[drawn])
