"""Posterior probabilities of the state that a record shows: healthy, a fault of one part, or something else.

The features of a record (`FaultScores`) are excesses of combs over a typical comb. For a healthy bearing large values
are exponentially rare; for a faulty one they are spread over a range many times as wide, or the fault is hidden. So the
log likelihood ratio of a class rises with its feature: four numbers for all parts and machines (`Evidence`).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import DEFECTS, RACE_DEFECTS, Fault
from srbval.signal.false_alarm import FOREIGN_COMB
from srbval.storage.tables import build, read_toml

OTHER, UNDECIDED = "other", "undecided"
CLASSES = (Fault.HEALTHY.value, *(fault.value for fault in DEFECTS), OTHER)
# Healthy or not with equal odds, and all other classes equally probable. Stated, not fitted; see `log_likelihood`.
PRIOR = {name: 0.5 if name == Fault.HEALTHY else 0.5 / (len(CLASSES) - 1) for name in CLASSES}
LEAST_NAMED = 1 - 1 / 3.0  # probability from which a class is called: a wrong call costs three times as much as none
SHARED = 0.5  # correlation of two records of one bearing: 0.36 in 84 of healthy ones, 0.73 in 53 of faulty races


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Weights of the features: log likelihood ratios rise from minus `onset` by `slope` per unit of the feature.

    Faults of a race, and something else, are hidden in the share `hidden` of the records, faults of a rolling element
    in `roller_hidden`. Fitted to records of `rigs` rigs with so many `specimens` (bearings) of each class.
    """

    slope: float
    onset: float
    hidden: float
    roller_hidden: float
    rigs: int
    specimens: Mapping[str, int]

    def log_ratios(self, features: FloatArray) -> FloatArray:
        """Log likelihood ratio of each class but healthy over healthy, [..., 4], from `features` [..., 4].

            r = log(h + (1 - h) exp(slope x - onset))

        with the hidden share h. Something else may be present beside a fault (`FOREIGN_COMB`).
        """
        parts = [name in RACE_DEFECTS or name == OTHER for name in CLASSES[1:]]
        hidden = np.where(parts, self.hidden, self.roller_hidden)
        ratios = np.logaddexp(np.log(hidden), np.log1p(-hidden) + self.slope * features - self.onset)
        beside = np.logaddexp(math.log1p(-FOREIGN_COMB), math.log(FOREIGN_COMB) + ratios[..., -1:])
        return np.concatenate((ratios[..., :-1] + beside, ratios[..., -1:]), axis=-1)

    def log_likelihood(self, *views: FloatArray) -> dict[str, float]:
        """Log likelihood ratio of each class over healthy, for use with any prior.

        It is the mean likelihood over several `views` (channels or speeds; features [4] each): any may show the class.
        """
        ratios = np.logaddexp.reduce(self.log_ratios(np.array(views)), axis=0) - math.log(len(views))
        return dict(zip(CLASSES, (0.0, *ratios.tolist()), strict=True))

    def probabilities(self, log_likelihood: Mapping[str, float]) -> dict[str, float]:
        """Posterior probability of each class, at most (n + 1/2) / (n + 1) with n known specimens.

        That is the predictive probability after n of n successes by Jeffreys' prior.
        """
        log = np.array([math.log(PRIOR[name]) + log_likelihood[name] for name in CLASSES])
        shares = np.exp(log - np.logaddexp.reduce(log))
        best = int(np.argmax(shares))
        cap = (self.specimens[CLASSES[best]] + 0.5) / (self.specimens[CLASSES[best]] + 1)
        if shares[best] > cap:
            shares[best] = 0.0
            shares *= (1 - cap) / shares.sum()
            shares[best] = cap
        return dict(zip(CLASSES, shares.tolist(), strict=True))


@functools.cache
def evidence() -> Evidence:
    """The evidence that ships, from ``evidence.toml``."""
    file = Path(__file__).with_name("evidence.toml")
    return build(Evidence, read_toml(file), str(file))


def of_one_machine(log_likelihoods: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Log likelihood ratios of n records of one bearing together: their sum over 1 + (n - 1) `SHARED`.

    The design effect of cluster samples (Kish 1965, Survey Sampling, sect. 5.4).
    """
    count = len(log_likelihoods)
    return {name: sum(one[name] for one in log_likelihoods) / (1 + (count - 1) * SHARED) for name in CLASSES}


def most_probable(probabilities: Mapping[str, float]) -> str:
    """The most probable class."""
    return max(probabilities, key=lambda name: probabilities[name])


def decide(probabilities: Mapping[str, float]) -> str:
    """The most probable class if it is probable enough to be called, else `UNDECIDED`."""
    best = most_probable(probabilities)
    return best if probabilities[best] >= LEAST_NAMED else UNDECIDED
