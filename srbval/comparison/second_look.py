"""A second look at the verdicts: all endpoints in one test, and the verdicts again without each record.

The errors E of all endpoints (see `verdicts`) have one distribution, by paired draws of the model and of the rig: what
inputs, tachometer and the scatter between records do to several of them is in it. D^2 = E' C^-1 E with its covariance C
is compared with the same of the draws about their mean, which are not normal where that scatter is estimated from few
records. Holm's procedure adjusts the endpoints' own chances. A verdict that one record more or less would turn, or the
record's other comb, rests on that record.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from srbval.arrays import FloatArray
from srbval.comparison.budget import STATED
from srbval.comparison.cage_means import CageMeans, cage_means
from srbval.comparison.cage_readings import CageReading
from srbval.comparison.verdicts import endpoints, of_model, verdicts

SEED = 4
Row = dict[str, Any]


def joint_tests(readings: Sequence[CageReading], stored: Mapping[str, Any]) -> Iterator[Row]:
    """Of every variant of the stored study ``cage_draws``: mean errors [% of the rig's ratio], D^2, its chance `p`.

    `p` is that of so large a D^2 if the model were right in all endpoints, `p_holm` that of each alone, after Holm.
    """
    means = cage_means(readings)
    of = list(endpoints(readings, means))
    rig, rng = np.array([one.rig for one in of]), np.random.default_rng(SEED)
    for variant in stored.get("variants", ()):
        weights = np.array([of_model(variant, readings, one.weights) for one in of])
        drawn, nominal, finer = (
            weights @ np.array([one[name] for one in variant["records"]]) for name in ("drawn", "nominal", "finer")
        )
        numerics = rng.choice((-1.0, 1.0), rig.shape[1]) * (finer - nominal)[:, None]
        model = drawn[:, rng.integers(drawn.shape[1], size=rig.shape[1])]
        errors = 100 / means.means[-1] * (model - rig + numerics)
        mean, own = errors.mean(axis=1), np.linalg.inv(np.atleast_2d(np.cov(errors)))
        d2, about = float(mean @ own @ mean), errors - mean[:, None]
        as_large = np.count_nonzero(np.einsum("id,ij,jd->d", about, own, about) >= d2)
        beyond = np.minimum((errors > 0).sum(axis=1), (errors < 0).sum(axis=1))
        yield {
            "scene": variant["scene"], "form": variant["form"], "endpoints": [one.name for one in of],
            "errors_pct": mean.tolist(), "d2": d2, "p": (1 + int(as_large)) / (1 + rig.shape[1]),
            "p_holm": holm_adjusted(np.minimum(1.0, 2 * (1 + beyond) / (1 + rig.shape[1]))).tolist(),
        }  # fmt: skip


def holm_adjusted(chances: ArrayLike) -> FloatArray:
    """Chances [n] after Holm's procedure (1979, Scand. J. Stat. 6, 65), in their order."""
    p = np.asarray(chances, dtype=float)
    order = np.argsort(p, kind="stable")
    adjusted = np.empty_like(p)
    adjusted[order] = np.maximum.accumulate(np.minimum(1.0, np.arange(p.size, 0, -1) * p[order]))
    return adjusted


def second_looks(readings: Sequence[CageReading], stored: Mapping[str, Any]) -> Iterator[Row]:
    """With nothing changed, without each record, and with each record's other comb, for models as they are stated.

    The rig's trend then [%], with its 95 % half width, and the verdicts that are others than with nothing changed.
    """
    sets = {"nothing": readings}
    sets |= {f"without {one.record}": [other for other in readings if other is not one] for one in readings}
    sets |= {
        f"{one.record} by {one.check.read_from}": [replace(one.check, check=None) if o is one else o for o in readings]
        for one in readings if one.check is not None
    }  # fmt: skip
    answers: dict[tuple[str, str], str] = {}
    for changed, own in sets.items():
        rows = [one for one in verdicts(own, stored) if one.form == STATED]
        if not answers:
            answers = {(one.scene, one.endpoint): one.verdict for one in rows}
        trend, half = trend_pct(cage_means(own))
        turned = [one for one in rows if one.verdict is not answers.get((one.scene, one.endpoint))]
        yield {"changed": changed, "trend_pct": trend, "trend_ci95_pct": half, "turned": turned}


def trend_pct(means: CageMeans) -> tuple[float, float]:
    """How much higher the rig's ratio is at the slowest speed than at the fastest [%], and its 95 % half width."""
    drawn: FloatArray = 100 * (means.draws[:, 0] / means.draws[:, -1] - 1)
    low, high = np.quantile(drawn, (0.025, 0.975))
    return float(drawn.mean()), float(high - low) / 2
