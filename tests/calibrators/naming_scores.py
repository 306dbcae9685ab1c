"""Are the probabilities of naming a fault right? ``python -m tests.calibrators.naming_scores``, rigs left out in turn.

From the features that come with the program, so that no recording is needed. Every rig has the same weight, and so has
every bearing of a rig. Printed are the classes called by state, the scores beside those of equal probabilities, and the
reliability of the highest probability.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from srbval.validation.fault_naming import known_features
from srbval.validation.fault_posterior import CLASSES, PRIOR, UNDECIDED, KnownFeatures, decide, fit_posterior
from tests.calibrators.rows import print_rows

BINS = 5  # of the reliability, from the least highest probability of so many classes to one


@dataclass(frozen=True, kw_only=True)
class HeldOut:
    """A record by the model of the other rigs, and its weight."""

    record: KnownFeatures
    probabilities: dict[str, float]
    weight: float

    @property
    def right(self) -> bool:
        """Is its state the most probable class?"""
        return max(self.probabilities, key=lambda name: self.probabilities[name]) == self.record.state


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


def scores(found: Sequence[HeldOut]) -> dict[str, float]:
    """Mean log score and Brier score, those of equal probabilities, and the expected calibration error."""
    log = sum(f.weight * math.log(f.probabilities[f.record.state]) for f in found)
    brier = sum(f.weight * sum((p - (n == f.record.state)) ** 2 for n, p in f.probabilities.items()) for f in found)
    error = sum(abs(row["said"] - row["right"]) * row["weight"] for row in reliability(found))
    equal = len(PRIOR)
    return {
        "log score": log, "equal probabilities": -math.log(equal), "Brier score": brier,
        "of equal ones": 1 - 1 / equal, "expected calibration error": error,
    }  # fmt: skip


def reliability(found: Sequence[HeldOut]) -> list[dict[str, float]]:
    """By bins of the highest probability: its mean and how often it was right."""
    highest = np.array([max(f.probabilities.values()) for f in found])
    right, weight = np.array([f.right for f in found]), np.array([f.weight for f in found])
    rows = []
    for low, high in zip(
        *(np.linspace(1 / len(PRIOR), 1, BINS + 1)[i:j] for i, j in ((0, -1), (1, None))), strict=True
    ):
        of = (highest > low) & (highest <= high)
        if of.any():
            said, was = (float(np.average(x[of], weights=weight[of])) for x in (highest, right))
            rows.append({"from": low, "records": int(of.sum()), "weight": float(weight[of].sum()), "said": said,
                         "right": was})  # fmt: skip
    return rows


def calls(found: Sequence[HeldOut]) -> list[dict[str, Any]]:
    """By state, how often which class is called."""
    said = Counter((f.record.state, decide(f.probabilities)) for f in found)
    return [{"state": s} | {name: said[s, name] for name in (*CLASSES, UNDECIDED)} for s in CLASSES]


def main() -> None:
    """Judge and print."""
    found = held_out(known_features())
    print_rows(calls(found))
    print_rows([scores(found)])
    print_rows(reliability(found))


if __name__ == "__main__":
    main()
