"""Mean cage ratio over the records of each speed, by a random-effects model; theory: "Mean over records".

Mounting, load zone, temperature and cage differ between records, so their ratios scatter by more than their reading
errors. The posterior distribution is computed on a grid of the scatter tau between records, whose prior is Jeffreys'
from the restricted likelihood (Bodnar et al. 2017, Stat. Med. 36, 378; for any design matrix: Roever & Friede 2023,
Comput. Methods Programs Biomed. 229, 107303; both cited from memory). `tests/comparison/test_cage_readings.py` counts
how often the intervals contain the true value.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import RACE_DEFECTS
from srbval.comparison.cage_readings import CageReading
from srbval.errors import DataError
from srbval.recordings.speed import SCALE_CI95
from srbval.signal import NORMAL_95

POSTERIOR_DRAWS, TAU_POINTS, SEED = 4096, 200, 8
# Ends of the logarithmic grid of tau, in units of the ratios' scatter or of the worst reading's uncertainty, if larger.
TAU_RANGE = (0.02, 50.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class CageMeans:
    """Mean cage ratio (cage over shaft speed) at each nominal speed `rpm` (rising), and scatter between records.

    `between_u` is the standard deviation of the ratio between records of one speed, with the 95 % interval
    `between_ci95`. `draws`, shape [draws, speeds], are samples from the joint posterior distribution of the means.
    `outer_less_inner`, shape [draws], are samples of the ratio with an outer-race fault minus the ratio with an
    inner-race fault; None if the records cannot determine this difference.
    """

    rpm: tuple[float, ...]
    records: tuple[int, ...]
    means: tuple[float, ...]
    between_u: float
    between_ci95: tuple[float, float]
    draws: FloatArray
    outer_less_inner: FloatArray | None


def covariance(readings: Sequence[CageReading]) -> FloatArray:
    """Covariance matrix of the errors of cage ratios, [records, records]; all share the tachometer's scale error."""
    per_speed = np.array([one.per_speed for one in readings])
    scale_u = SCALE_CI95 / NORMAL_95
    own = [one.reading_u**2 + max(one.speed_u**2 - (one.per_speed * scale_u) ** 2, 0.0) for one in readings]
    return np.asarray(np.diag(own) + scale_u**2 * np.outer(per_speed, per_speed))


def cage_means(readings: Sequence[CageReading]) -> CageMeans:
    """Compute the mean cage ratio of each nominal speed; raises `DataError` if no speed has two records."""
    rpm, place = np.unique([one.nominal_rpm for one in readings], return_inverse=True)
    if len(readings) <= rpm.size:
        raise DataError(
            f"{len(readings)} records at {rpm.size} speeds have a cage ratio; a mean needs two records at one speed."
        )
    ratios, own = np.array([one.ratio for one in readings]), covariance(readings)
    effects, between = random_effects(ratios, own, np.eye(rpm.size)[place])
    design, apart = race_design(readings), None
    if len(readings) > design.shape[1] == np.linalg.matrix_rank(design):
        apart = random_effects(ratios, own, design)[0][:, -1]
    low, middle, high = np.quantile(between, (0.025, 0.5, 0.975)).tolist()
    return CageMeans(
        rpm=tuple(rpm.tolist()),
        records=tuple(np.bincount(place).tolist()),
        means=tuple(effects.mean(axis=0).tolist()),
        between_u=middle,
        between_ci95=(low, high),
        draws=effects,
        outer_less_inner=apart,
    )


def race_design(readings: Sequence[CageReading]) -> FloatArray:
    """Design matrix, shape [records, effects]: a column for each speed (rising), and two columns for faults.

    The first of the two is 1 for records with a fault of a race. It is left out if it depends linearly on the others,
    as when every record has such a fault. The second is 1/2 for an outer-race and -1/2 for an inner-race fault.
    """
    rpm = np.array([one.nominal_rpm for one in readings])
    outer, inner = (np.array([one.state is race for one in readings], dtype=np.float64) for race in RACE_DEFECTS)
    speeds, apart = (rpm[:, None] == np.unique(rpm)).astype(np.float64), (outer - inner) / 2
    design = np.column_stack((speeds, outer + inner, apart))
    full = np.linalg.matrix_rank(design) == design.shape[1]
    return design if full else np.column_stack((speeds, apart))


def random_effects(values: FloatArray, covariance: FloatArray, design: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sample the effects m and the scatter tau between records in the model y = X m + b + e (see the theory).

    `values` are the ratios y, [n], `covariance` is that of their reading errors e, [n, n], `design` is X, [n, effects].
    Returns samples from the posterior distribution of m, [draws, effects], and of tau, [draws].
    """
    spread = float(np.std(values - design @ np.linalg.lstsq(design, values)[0]))
    tau = np.geomspace(*TAU_RANGE, TAU_POINTS) * max(spread, float(np.sqrt(np.diag(covariance).max())))
    inverse = np.linalg.inv(covariance + tau[:, None, None] ** 2 * np.eye(values.size))
    weighed = inverse @ design
    information = design.T @ weighed
    effects = np.linalg.solve(information, (values @ weighed)[..., None])[..., 0]
    residual = values - effects @ design.T
    fit = (residual * (inverse @ residual[..., None])[..., 0]).sum(axis=1)
    log_det = np.linalg.slogdet(information)[1] - np.linalg.slogdet(inverse)[1]
    free = inverse - weighed @ np.linalg.solve(information, np.swapaxes(weighed, 1, 2))
    # Twice the logarithm of tau: from the prior, and from the logarithmic steps of the grid.
    log_p = 2 * np.log(tau) + np.log((free**2).sum(axis=(1, 2))) / 2 - (fit + log_det) / 2
    rng, covariances = np.random.default_rng(SEED), np.linalg.inv(information)
    p = np.exp(log_p - log_p.max())
    drawn = rng.choice(tau.size, POSTERIOR_DRAWS, p=p / p.sum())
    normal = rng.standard_normal((POSTERIOR_DRAWS, design.shape[1]))
    moved = np.einsum("dij,dj->di", np.linalg.cholesky(covariances)[drawn], normal)
    return effects[drawn] + moved, tau[drawn]
