"""The evidence that is fitted to records of known state, and its reliability with rigs left out in turn.

Every class weighs as much as it is probable beforehand, every rig of a class and every bearing of a rig the same.
Calibration is that of real records alone: wrong readings, which are made, are counted apart.
"""

import itertools
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from srbval.arrays import FloatArray, IntArray
from srbval.bearing import DEFECTS, RACE_DEFECTS, Fault
from srbval.diagnosis.fault_posterior import CLASSES, OTHER, PRIOR, Evidence, decide, most_probable
from srbval.studies.known_records import KnownFeatures

# Bins of the highest probability, from the least that it can be of so many classes.
EDGES = np.linspace(1 / len(PRIOR), 1, 6)
# A fault whose contrast is no more than this in its record, rightly read, cannot show at a wrong speed either.
SHOWN = 3.0
# Of the search for the evidence: where it starts (shares as log odds), and what keeps shares off 0 and 1.
START, PULL = (1.0, 4.0, -2.0, 2.0), 1e-3
# Times that outcomes are drawn with the probabilities said, for what chance does to the diagram.
DRAWS = 2000


@dataclass(frozen=True, kw_only=True)
class HeldOut:
    """A record by the model of the other rigs, and its weight."""

    record: KnownFeatures
    probabilities: dict[str, float]
    weight: float

    @property
    def right(self) -> bool:
        """Is its state the most probable class?"""
        return most_probable(self.probabilities) == self.record.state

    @property
    def highest(self) -> float:
        """The highest probability."""
        return max(self.probabilities.values())


def weights(known: Sequence[KnownFeatures]) -> FloatArray:
    """The weight of each record, [n]: that of its class beforehand, shared by rigs, their bearings, their records."""
    records = Counter((k.state, k.rig, k.specimen) for k in known)
    bearings = Counter((state, rig) for state, rig, _ in records)
    rigs = Counter(state for state, _ in bearings)
    return np.array([
        PRIOR[k.state] / rigs[k.state] / bearings[k.state, k.rig] / records[k.state, k.rig, k.specimen] for k in known
    ])  # fmt: skip


def fit_evidence(known: Sequence[KnownFeatures]) -> Evidence:
    """The evidence of the greatest mean log score on `known`, each share hidden pulled to a half by `PULL`."""
    specimens = {name: len({(k.rig, k.specimen) for k in known if k.state == name}) for name in CLASSES}
    features, weight = np.array([k.features for k in known]), weights(known)
    of, prior = [CLASSES.index(k.state) for k in known], np.log([PRIOR[name] for name in CLASSES])

    def evidence(values: Sequence[float]) -> Evidence:
        slope, onset, *hidden = map(float, values)
        shares = (1 / (1 + math.exp(-value)) for value in hidden)
        return Evidence(
            slope=slope, onset=onset, hidden=next(shares), roller_hidden=next(shares), specimens=specimens,
            rigs=len({k.rig for k in known}),
        )  # fmt: skip

    def loss(values: Sequence[float]) -> float:
        log = prior + np.column_stack((np.zeros(len(known)), evidence(values).log_ratios(features)))
        score = log[np.arange(len(known)), of] - np.logaddexp.reduce(log, axis=1)
        return float(-(weight @ score) + PULL * (values[2] ** 2 + values[3] ** 2))

    return evidence(minimize(loss, START, method="Nelder-Mead").x)


def held_out(known: Sequence[KnownFeatures], by: Mapping[str, Evidence]) -> list[HeldOut]:
    """Every record by the evidence for its rig."""
    shares = [by[k.rig].probabilities(by[k.rig].log_likelihood(np.array(k.features))) for k in known]
    return [
        HeldOut(record=k, probabilities=one, weight=float(weight))
        for k, one, weight in zip(known, shares, weights(known), strict=True)
    ]


def naming_scores(known: Sequence[KnownFeatures], by: Mapping[str, Evidence]) -> dict[str, Any]:
    """All of it."""
    found = held_out(known, by)
    return {
        "scores": scores(found),
        "wrongly_read": wrongly_read(found),
        "reliability": reliability(found),
        "by_class": reliability_by_class(found),
    }


def log_scores(found: Sequence[HeldOut]) -> FloatArray:
    """The part of each record in the mean log score, [n]."""
    return np.array([f.weight * math.log(f.probabilities[f.record.state]) for f in found])


def scores(found: Sequence[HeldOut]) -> dict[str, float]:
    """Mean log score and Brier score, those of the prior, and the expected calibration error on real records.

    `calibration_error_by_chance`: what probabilities that are right stay below in 95 % of draws of so many bearings.
    """
    brier = sum(f.weight * sum((p - (n == f.record.state)) ** 2 for n, p in f.probabilities.items()) for f in found)
    real = [f for f in found if f.record.state != OTHER]
    said = np.array([f.highest for f in real])
    errors = [_calibration_error(real, right) for right in (np.array([[f.right for f in real]]), _drawn(real, said))]
    return {
        "log_score": float(log_scores(found).sum()),
        "log_score_of_prior": sum(p * math.log(p) for p in PRIOR.values()), "brier_score": brier,
        "brier_score_of_prior": 1 - sum(p**2 for p in PRIOR.values()), "calibration_error": float(errors[0][0]),
        "calibration_error_by_chance": float(np.quantile(errors[1], 0.95)),
    }  # fmt: skip


def reliability(found: Sequence[HeldOut]) -> list[dict[str, float]]:
    """Of real records by bins of the highest probability: mean said, share right, its 95 % range if that were right."""
    real = [f for f in found if f.record.state != OTHER]
    said, right = np.array([f.highest for f in real]), np.array([f.right for f in real])
    bins = _bins(said)
    return [
        {"from": float(EDGES[number]), "to": float(EDGES[number + 1])} | _row(real, said, right, bins == number)
        for number in np.unique(bins)
    ]


def reliability_by_class(found: Sequence[HeldOut]) -> list[dict[str, Any]]:
    """The same of every class: its mean probability over all real records, and how often it was the record's state."""
    real = [f for f in found if f.record.state != OTHER]
    every, states = np.ones(len(real), dtype=np.bool_), np.array([f.record.state for f in real])
    return [
        {"state": name} | _row(real, np.array([f.probabilities[name] for f in real]), states == name, every)
        for name in CLASSES[:-1]
    ]


def called(found: Sequence[HeldOut]) -> dict[str, int]:
    """Faulty records called right, wrong, not at all; races apart; healthy and wrongly read ones called faulty."""
    said = [(f.record.state, decide(f.probabilities)) for f in found]
    faulty = [(state, one) for state, one in said if state in DEFECTS]
    right = [state for state, one in faulty if state == one]
    wrong = [state for state, one in faulty if one in DEFECTS and one != state]
    return {
        "right": len(right), "wrong": len(wrong), "none": len(faulty) - len(right) - len(wrong),
        "races_right": sum(state in RACE_DEFECTS for state in right),
        "races": sum(state in RACE_DEFECTS for state, _ in faulty),
        "healthy_called": sum(one in DEFECTS for state, one in said if state == Fault.HEALTHY),
        "wrong_readings_called": sum(one in DEFECTS for state, one in said if state == OTHER),
    }  # fmt: skip


def wrongly_read(found: Sequence[HeldOut]) -> dict[str, int]:
    """Of records at a wrong speed or as a wrong bearing whose fault shows when rightly read: how often that is seen."""
    of = [f for f, shows in zip(found, _shows(found), strict=True) if f.record.state == OTHER and shows]
    called = Counter(decide(f.probabilities) for f in of)
    return {
        "records": len(of), "called_other": called[OTHER], "most_probably_other": sum(f.right for f in of),
        "fault_called": sum(n for name, n in called.items() if name in CLASSES[1:-1]),
    }  # fmt: skip


def _shows(found: Sequence[HeldOut]) -> Iterator[bool]:
    """Whether each record, or the one just before that it is a wrong reading of, shows its fault."""
    shows = False
    for one in found:
        if one.record.state != OTHER:
            shows = max(one.record.features[:-1]) > SHOWN
        yield shows


def _bins(said: FloatArray) -> IntArray:
    return np.clip(np.digitize(said, EDGES) - 1, 0, EDGES.size - 2)


def _row(
    found: Sequence[HeldOut], said: FloatArray, right: NDArray[np.bool_], chosen: NDArray[np.bool_]
) -> dict[str, float]:
    weight = np.array([f.weight for f in found]) * chosen
    low, high = np.quantile(_drawn(found, said) @ weight / weight.sum(), (0.025, 0.975))
    return {
        "records": int(chosen.sum()), "weight": float(weight.sum()), "said": float(np.average(said, weights=weight)),
        "right": float(np.average(right, weights=weight)), "low": float(low), "high": float(high),
    }  # fmt: skip


def _drawn(found: Sequence[HeldOut], said: FloatArray) -> FloatArray:
    """Whether what is said of each record is right, in draws where it is: all of a bearing together [draws, n]."""
    number = itertools.count()
    groups = {key: next(number) for key in dict.fromkeys((f.record.rig, f.record.specimen) for f in found)}
    of = np.array([groups[f.record.rig, f.record.specimen] for f in found])
    return np.asarray(np.random.default_rng(0).random((DRAWS, len(groups)))[:, of] < said, dtype=np.float64)


def _calibration_error(found: Sequence[HeldOut], right: FloatArray) -> FloatArray:
    """Mean of |said - right| over the bins, of each draw [draws]."""
    said, weight = np.array([f.highest for f in found]), np.array([f.weight for f in found])
    bins = _bins(said)
    off = [np.abs((right[:, bins == n] - said[bins == n]) @ weight[bins == n]) for n in np.unique(bins)]
    return np.asarray(np.sum(off, axis=0) / weight.sum())
