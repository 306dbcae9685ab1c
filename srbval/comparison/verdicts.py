"""Verdict on the model's cage ratio (cage / shaft speed) against a tolerance; theory: "Verdicts on the cage ratio".

Three values of model and rig are compared: the mean ratio at the fastest speed, the trend (slowest minus fastest speed)
and outer-race minus inner-race faults. The rig's value has the distribution from `cage_means`, the model's value the
distribution of runs with randomly drawn inputs; all records are simulated with the same draws. The numerical error of
the model is applied with either sign: the change of its value with half the step and more contact points or slices.

`p_beyond` is the probability that the error exceeds the tolerance. The verdict is met if `p_beyond` is at most the
accepted risk, missed if it is at least 1 - risk, otherwise not resolved. It is also not resolved if the verdicts with
one input fixed at each of its values in turn contain met and missed. The study `inputs` counts the verdicts on
simulated rigs with a known error.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import RACE_DEFECTS, Fault
from srbval.comparison.cage_means import CageMeans, race_design
from srbval.comparison.cage_readings import CageReading
from srbval.comparison.comparison import TOLERANCE, Row, Verdict, verdict_on_tolerance

QUANTILES = 128  # number of values that represent the rig's distribution
HALF_WIDTH = 0.95  # share of the error's distribution within +-U
Variant = Mapping[str, Any]  # draws of one scene, an entry of `variants` of the stored result ``inputs``


class ComparedValue(NamedTuple):
    """Value on which there is a verdict: the sum of the records' cage ratios times `weights`.

    `rig` contains samples of this value from its probability distribution on the rig.
    """

    name: str
    weights: FloatArray
    rig: FloatArray


def endpoints(readings: Sequence[CageReading], means: CageMeans) -> Iterator[ComparedValue]:
    """Yield the cage ratio at the fastest speed, its rise to the slowest, and the difference outer - inner fault."""
    speeds = np.array([[float(one.nominal_rpm == rpm) for rpm in means.rpm] for one in readings])
    slowest, fastest = means.rpm[0], means.rpm[-1]
    mean = np.linalg.pinv(speeds).round(12)
    yield ComparedValue(f"{fastest:g} rpm", mean[-1], means.draws[:, -1])
    if slowest < fastest:
        trend = means.draws[:, 0] - means.draws[:, -1]
        yield ComparedValue(f"{slowest:g} less {fastest:g} rpm", mean[0] - mean[-1], trend)
    if means.outer_less_inner is not None:
        apart = np.linalg.pinv(race_design(readings))[-1].round(12)
        codes = " less ".join(race.code for race in RACE_DEFECTS)
        yield ComparedValue(codes, apart, means.outer_less_inner)


def verdicts(readings: Sequence[CageReading], means: CageMeans, stored: Mapping[str, Any]) -> list[Row]:
    """Judge whether simulated cage ratios, `stored`, agree with the rig's `readings` and `means`, for each scene."""
    variants, values = stored.get("variants", ()), list(endpoints(readings, means))
    return [verdict(value, variant, readings, means.means[-1]) for variant in variants for value in values]


def none_missed(rows: Iterable[Row]) -> bool:
    """True if no tolerance is missed, which does not mean that all are met."""
    return all(row["verdict"] != Verdict.MISSED for row in rows)


def verdict(value: ComparedValue, variant: Variant, readings: Sequence[CageReading], scale: float) -> Row:
    """Judge the error of one compared value in the runs of one scene (`variant`), in per cent of `scale`.

    `scale` is the rig's cage ratio. In the result, `reversed_by` names inputs with which the verdict is ``met`` at one
    fixed value and ``missed`` at another.
    """
    weights = of_model(variant, readings, value.weights)

    def model(name: str) -> FloatArray:
        return np.asarray(100 / scale * (weights @ np.array([one[name] for one in variant["records"]])))

    rig = np.quantile(100 / scale * value.rig, (np.arange(QUANTILES) + 0.5) / QUANTILES)
    drawn, numerics = model("drawn"), float(model("finer") - model("nominal"))
    apart = np.concatenate([rig - numerics, rig + numerics])
    error, p = float(drawn.mean() - rig.mean()), share_beyond_limit(drawn, apart)
    answer, reversing = verdict_on_tolerance(p, TOLERANCE.risk), list[str]()
    for place, effect in enumerate(variant["effects"]):
        curve = 100 / scale * (weights @ np.array(effect["ratios"]))
        left = drawn - interpolate_effect(np.array(variant["at"])[:, place], effect["shares"], curve)
        known = {verdict_on_tolerance(share_beyond_limit(left + x, apart), TOLERANCE.risk) for x in curve}
        if {Verdict.MET, Verdict.MISSED} <= known | {answer}:
            reversing.append(effect["name"])
    return {
        "endpoint": value.name,
        "scene": variant["scene"],
        "error_pct": error,
        "u_pct": float(np.quantile(np.abs(np.subtract.outer(drawn, apart) - error), HALF_WIDTH)),
        "p_beyond": p,
        "records": int(np.count_nonzero(value.weights)),
        "draws": drawn.size,
        "reversed_by": reversing,
        "verdict": (Verdict.NOT_RESOLVED if reversing else answer).value,
    }


def of_model(variant: Variant, readings: Iterable[CageReading], weights: FloatArray) -> FloatArray:
    """Convert the `weights` of measured readings to weights of the simulated runs with the same state and speed.

    A reading whose bearing state was not simulated adds its weight to the healthy run at its speed.
    """
    places = {(one["state"], one["nominal_rpm"]): place for place, one in enumerate(variant["records"])}
    found = np.zeros(len(variant["records"]))
    for reading, weight in zip(readings, weights.tolist(), strict=True):
        state = reading.state if (reading.state, reading.nominal_rpm) in places else Fault.HEALTHY
        found[places[state, reading.nominal_rpm]] += weight
    return found


def share_beyond_limit(model: FloatArray, rig: FloatArray) -> float:
    """Share (0 to 1) of pairs of a model and a rig value [%] that differ by more than the tolerance."""
    ordered = np.sort(rig)
    above = np.searchsorted(ordered, model + TOLERANCE.limit_pct, "right")
    below = np.searchsorted(ordered, model - TOLERANCE.limit_pct, "left")
    return 1 - float((above - below).mean()) / ordered.size


def interpolate_effect(at: FloatArray, shares: Sequence[float], curve: FloatArray) -> FloatArray:
    """Interpolate a result that depends on one input to the input's cumulative probabilities `at`.

    `curve` is the result at `shares`. With only two `shares`, it jumps at the second of them, or at 0.5 if this is 1.
    """
    if len(shares) == 2:
        return np.where(at < (shares[1] if shares[1] < 1 else 0.5), curve[0], curve[1])
    return np.interp(at, shares, curve)
