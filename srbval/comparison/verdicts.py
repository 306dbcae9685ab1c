"""Whether the model's cage ratio is within its tolerance of the rig's: met, missed or not resolved, and how surely.

The error is E = S - D (ASME V&V 20) of an endpoint: the mean over the records of the fastest speed, the slowest speed
less that (the trend), and the records of the outer race less those of the inner. S has the distribution of the model's
runs at draws of its inputs that all records share, so that what they share cancels in a difference. D has the
distribution of `cage_means`, in which records scatter by more than their readings. Both are independent, and so is the
change that a finer run makes. `p_beyond` is the chance that E lies beyond the limit on either side:

    missed       p_beyond >= 1 - risk
    met          p_beyond <= risk
    not resolved else, or if one input alone, over its range, gives both

If the truth lies on the limit either wrong verdict has at most the chance `risk`. The study `inputs` counts how often
each verdict is given on simulated rigs, with the functions of this file.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import RACE_DEFECTS, Fault
from srbval.comparison.cage_means import CageMeans, cage_means, race_design
from srbval.comparison.cage_readings import CageReading
from srbval.comparison.comparison import TOLERANCE, Row, Verdict, verdict_on_tolerance

QUANTILES = 128  # that represent the rig's distribution
HALF_WIDTH = 0.95  # of an error's distribution, for U
Variant = Mapping[str, Any]  # draws of one scene, an entry of `variants` of the stored result ``inputs``


class Endpoint(NamedTuple):
    """A difference of cage ratios: `weights` of the records' ratios in it, and draws of the rig's value [ratio]."""

    name: str
    weights: FloatArray
    rig: FloatArray


def endpoints(readings: Sequence[CageReading], means: CageMeans) -> Iterator[Endpoint]:
    """All endpoints that the records allow: no trend by one speed, no difference of races by one.

    The weights are those of least squares with the effects of `cage_means`: a mean of each speed, and the races apart.
    """
    speeds = np.array([[float(one.nominal_rpm == rpm) for rpm in means.rpm] for one in readings])
    slowest, fastest = means.rpm[0], means.rpm[-1]
    mean = np.linalg.pinv(speeds).round(12)
    yield Endpoint(f"{fastest:g} rpm", mean[-1], means.draws[:, -1])
    if slowest < fastest:
        trend = means.draws[:, 0] - means.draws[:, -1]
        yield Endpoint(f"{slowest:g} less {fastest:g} rpm", mean[0] - mean[-1], trend)
    if means.outer_less_inner is not None:
        apart = np.linalg.pinv(race_design(readings))[-1].round(12)
        codes = " less ".join(race.code for race in RACE_DEFECTS)
        yield Endpoint(codes, apart, means.outer_less_inner)


def verdicts(readings: Sequence[CageReading], stored: Mapping[str, Any]) -> list[Row]:
    """Verdicts on every scene of the stored result ``inputs``, by endpoint; none without it or without records."""
    if not readings or not stored:
        return []
    means = cage_means(readings)
    wanted = list(endpoints(readings, means))
    return [verdict(one, variant, readings, means.means[-1]) for variant in stored["variants"] for one in wanted]


def none_missed(rows: Iterable[Row]) -> bool:
    """True if no tolerance is missed, which does not mean that all are met."""
    return all(row["verdict"] != Verdict.MISSED for row in rows)


def verdict(of: Endpoint, variant: Variant, readings: Sequence[CageReading], scale: float) -> Row:
    """Verdict on one endpoint of one scene, in per cent of `scale`, the rig's cage ratio.

    `reversed_by` names the inputs that alone, over their range, give both met and missed; `changed_by` those with which
    the verdict would be another if they were known to have their nominal value.
    """
    weights = of_model(variant, readings, of.weights)

    def model(name: str) -> FloatArray:
        return np.asarray(100 / scale * (weights @ np.array([one[name] for one in variant["records"]])))

    rig = np.quantile(100 / scale * of.rig, (np.arange(QUANTILES) + 0.5) / QUANTILES)
    drawn, nominal = model("drawn"), float(model("nominal"))
    numerics = float(model("finer")) - nominal
    apart = np.concatenate([rig - numerics, rig + numerics])
    error, p = float(drawn.mean() - rig.mean()), share_beyond_limit(drawn, apart)
    answer, reversing, changing = verdict_on_tolerance(p, TOLERANCE.risk), list[str](), list[str]()
    for place, effect in enumerate(variant["effects"]):
        curve = 100 / scale * (weights @ np.array(effect["ratios"]))
        left = drawn - interpolate_effect(np.array(variant["at"])[:, place], effect["shares"], curve)
        *known, own = (
            verdict_on_tolerance(share_beyond_limit(left + x, apart), TOLERANCE.risk) for x in (*curve, nominal)
        )
        if {Verdict.MET, Verdict.MISSED} <= {*known, answer}:
            reversing.append(effect["name"])
        if own is not answer:
            changing.append(effect["name"])
    return {
        "endpoint": of.name,
        "scene": variant["scene"],
        "error_pct": error,
        "u_pct": float(np.quantile(np.abs(np.subtract.outer(drawn, apart) - error), HALF_WIDTH)),
        "p_beyond": p,
        "records": int(np.count_nonzero(of.weights)),
        "draws": drawn.size,
        "reversed_by": reversing,
        "changed_by": changing,
        "verdict": (Verdict.NOT_RESOLVED if reversing else answer).value,
    }


def of_model(variant: Variant, readings: Iterable[CageReading], weights: FloatArray) -> FloatArray:
    """Weights of the scene's records: a record without a run of its state takes the healthy bearing's run."""
    places = {(one["state"], one["nominal_rpm"]): place for place, one in enumerate(variant["records"])}
    found = np.zeros(len(variant["records"]))
    for reading, weight in zip(readings, weights.tolist(), strict=True):
        state = reading.state if (reading.state, reading.nominal_rpm) in places else Fault.HEALTHY
        found[places[state, reading.nominal_rpm]] += weight
    return found


def share_beyond_limit(model: FloatArray, rig: FloatArray) -> float:
    """Chance that values of the model and of the rig [%], drawn independently, differ by more than the limit."""
    ordered = np.sort(rig)
    above = np.searchsorted(ordered, model + TOLERANCE.limit_pct, "right")
    below = np.searchsorted(ordered, model - TOLERANCE.limit_pct, "left")
    return 1 - float((above - below).mean()) / ordered.size


def interpolate_effect(at: FloatArray, shares: Sequence[float], curve: FloatArray) -> FloatArray:
    """An input's own effect at shares of its range, by straight line; of two values the nearer half of the range."""
    if len(shares) == 2:
        return np.where(at < (shares[1] if shares[1] < 1 else 0.5), curve[0], curve[1])
    return np.interp(at, shares, curve)


def trend_pct(means: CageMeans) -> tuple[float, float]:
    """Increase of the rig's ratio from the fastest speed to the slowest [%], and its 95 % half width."""
    drawn: FloatArray = 100 * (means.draws[:, 0] / means.draws[:, -1] - 1)
    low, high = np.quantile(drawn, (0.025, 0.975))
    return float(drawn.mean()), float(high - low) / 2
