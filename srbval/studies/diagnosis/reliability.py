"""Reliability of the fault probabilities: the records that come with the program, rigs left out in turn.

Every rig has the same weight, and so has every bearing of a rig.
"""

import itertools
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.diagnosis.diagnose import known_features
from srbval.diagnosis.fault_posterior import (
    CLASSES,
    OTHER,
    PRIOR,
    UNDECIDED,
    KnownFeatures,
    decide,
    fit_posterior,
    most_probable,
)

# Bins of the highest probability, from the least that it can be of so many classes.
EDGES = np.linspace(1 / len(PRIOR), 1, 6)
# A fault whose contrast is no more than this in its record, rightly read, cannot show at a wrong speed either.
SHOWN = 3.0
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


def held_out(known: Sequence[KnownFeatures]) -> list[HeldOut]:
    """Every record by the model of the other rigs."""
    bearings = Counter((k.rig, k.state, k.specimen) for k in known)
    of_rig = Counter(rig for rig, *_ in bearings)
    models = {rig: fit_posterior([k for k in known if k.rig != rig]) for rig in of_rig}
    return [
        HeldOut(
            record=k,
            probabilities=models[k.rig].probabilities(k.vector),
            weight=1 / of_rig[k.rig] / bearings[k.rig, k.state, k.specimen] / len(of_rig),
        )
        for k in known
    ]


def naming_scores() -> dict[str, Any]:
    """All of it, of the records that come with the program."""
    found = held_out(known_features())
    return {
        "scores": scores(found),
        "calls": calls(found),
        "wrongly_read": wrongly_read(found),
        "reliability": reliability(found),
    }


def scores(found: Sequence[HeldOut]) -> dict[str, float]:
    """Mean log score and Brier score, those of equal probabilities, and the expected calibration error.

    `calibration_error_by_chance`: what probabilities that are right stay below in 95 % of draws of so many bearings.
    """
    log = sum(f.weight * math.log(f.probabilities[f.record.state]) for f in found)
    brier = sum(f.weight * sum((p - (n == f.record.state)) ** 2 for n, p in f.probabilities.items()) for f in found)
    errors = [_calibration_error(found, right) for right in (np.array([[f.right for f in found]]), _drawn(found))]
    return {
        "log_score": log, "log_score_of_equal": -math.log(len(PRIOR)), "brier_score": brier,
        "brier_score_of_equal": 1 - 1 / len(PRIOR), "calibration_error": float(errors[0][0]),
        "calibration_error_by_chance": float(np.quantile(errors[1], 0.95)),
    }  # fmt: skip


def reliability(found: Sequence[HeldOut]) -> list[dict[str, float]]:
    """By bins of the highest probability: its mean, how often it was right, and the 95 % range if it were right."""
    bins, weight, said = _arrays(found)
    right, drawn = np.array([f.right for f in found]), _drawn(found)
    rows = []
    for number in np.unique(bins):
        of = bins == number
        low, high = np.quantile(drawn[:, of] @ weight[of] / weight[of].sum(), (0.025, 0.975))
        rows.append({
            "from": float(EDGES[number]), "to": float(EDGES[number + 1]), "records": int(of.sum()),
            "weight": float(weight[of].sum()), "said": float(np.average(said[of], weights=weight[of])),
            "right": float(np.average(right[of], weights=weight[of])), "low": float(low), "high": float(high),
        })  # fmt: skip
    return rows


def calls(found: Sequence[HeldOut]) -> list[dict[str, Any]]:
    """By state, how often which class is called."""
    said = Counter((f.record.state, decide(f.probabilities)) for f in found)
    return [{"state": s} | {name: said[s, name] for name in (*CLASSES, UNDECIDED)} for s in CLASSES]


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
            shows = max(one.record.families) > SHOWN
        yield shows


def _arrays(found: Sequence[HeldOut]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bin, weight and highest probability of each record."""
    said = np.array([max(f.probabilities.values()) for f in found])
    return np.clip(np.digitize(said, EDGES) - 1, 0, EDGES.size - 2), np.array([f.weight for f in found]), said


def _drawn(found: Sequence[HeldOut]) -> FloatArray:
    """Whether each record is right, in draws where probabilities are: all records of a bearing together [draws, n]."""
    number = itertools.count()
    groups = {key: next(number) for key in dict.fromkeys((f.record.rig, f.record.specimen) for f in found)}
    of = np.array([groups[f.record.rig, f.record.specimen] for f in found])
    _, _, said = _arrays(found)
    return np.asarray(np.random.default_rng(0).random((DRAWS, len(groups)))[:, of] < said, dtype=np.float64)


def _calibration_error(found: Sequence[HeldOut], right: FloatArray) -> FloatArray:
    """Mean of |said - right| over the bins, of each draw [draws]."""
    bins, weight, said = _arrays(found)
    off = [np.abs((right[:, bins == n] - said[bins == n]) @ weight[bins == n]) for n in np.unique(bins)]
    return np.asarray(np.sum(off, axis=0))
