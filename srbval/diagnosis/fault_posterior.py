"""Posterior probabilities of what a record shows: healthy, a fault of one part, or something else.

A record has one feature of each fault and one of the strongest comb that none of them explains (`FaultScores`): by how
much a comb stands above a typical one. Of a healthy bearing large values are exponentially rare; of a faulty one they
are spread over a range many times as wide, or hidden, and then as of a healthy one. So the log likelihood of a class
over the healthy one's rises in proportion to its feature: four numbers for all parts and machines (`Evidence`).
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
# Before anything is known of a record a bearing is healthy or not with equal odds, and all that it may be instead is
# equally probable. Stated, not fitted; others with `log_likelihood`.
PRIOR = {name: 0.5 if name == Fault.HEALTHY else 0.5 / (len(CLASSES) - 1) for name in CLASSES}
# A wrong call costs this many times what no call costs: a class is called from probability `LEAST_NAMED`.
WRONG_COST = 3.0
LEAST_NAMED = 1 - 1 / WRONG_COST
# Correlation of the features of two records of one bearing, which have rig, mounting and load in common: 0.36 in 84
# records of healthy bearings, 0.73 in 53 of faulty races. Stated between the two.
SHARED = 0.5


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """How features are weighed: log likelihoods rise by `slope` per unit from minus `onset` on.

    A fault of a race, and something else, hides in the share `hidden` of the records, one of a rolling element in
    `roller_hidden`. Fitted to records of known state of so many `rigs`, with so many `specimens` of each class.
    """

    slope: float
    onset: float
    hidden: float
    roller_hidden: float
    rigs: int
    specimens: Mapping[str, int]

    def log_ratios(self, features: FloatArray) -> FloatArray:
        """Log likelihood of each class but the first over the healthy one, [..., 4], from `features` [..., 4].

            r = log(h + (1 - h) exp(slope x - onset))

        with the hidden share h: an exponential tail of scale 1 / slope for x of healthy records against a uniform
        density for those of a fault that shows. Something else may stand beside a fault (`FOREIGN_COMB`).
        """
        parts = [name in RACE_DEFECTS or name == OTHER for name in CLASSES[1:]]
        hidden = np.where(parts, self.hidden, self.roller_hidden)
        ratios = np.logaddexp(np.log(hidden), np.log1p(-hidden) + self.slope * features - self.onset)
        beside = np.logaddexp(math.log1p(-FOREIGN_COMB), math.log(FOREIGN_COMB) + ratios[..., -1:])
        return np.concatenate((ratios[..., :-1] + beside, ratios[..., -1:]), axis=-1)

    def log_likelihood(self, *views: FloatArray) -> dict[str, float]:
        """Log likelihood of each class over the healthy one's; with it any prior can be used.

        From the features [4] of each of several `views`, channels or speeds, of which any may be the one that shows the
        class: the mean of the likelihoods, so that every view looked at is paid for.
        """
        ratios = np.logaddexp.reduce(self.log_ratios(np.array(views)), axis=0) - math.log(len(views))
        return dict(zip(CLASSES, (0.0, *ratios.tolist()), strict=True))

    def probabilities(
        self, log_likelihood: Mapping[str, float], prior: Mapping[str, float] = PRIOR
    ) -> dict[str, float]:
        """Posterior probability of each class, none above (n + 1/2) / (n + 1) of n specimens known of it.

        That is what n of n leave to the next by Jeffreys' prior.
        """
        log = np.array([math.log(prior[name]) + log_likelihood[name] for name in CLASSES])
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
    """That which comes with the program; written by ``srbval study run naming``."""
    file = Path(__file__).with_name("evidence.toml")
    return build(Evidence, read_toml(file), str(file))


def of_one_machine(log_likelihoods: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Log likelihood of each class over the healthy one's from those of n records of one bearing.

    Their sum over 1 + (n - 1) `SHARED`: that many records with the same correlation between any two are worth one
    without (the design effect of cluster samples, Kish 1965, Survey Sampling, sect. 5.4). One record says what it says
    alone, and no number of records says more than 1 / `SHARED` times what they say on average.
    """
    count = len(log_likelihoods)
    return {name: sum(one[name] for one in log_likelihoods) / (1 + (count - 1) * SHARED) for name in CLASSES}


def most_probable(probabilities: Mapping[str, float]) -> str:
    """The class of the highest probability."""
    return max(probabilities, key=lambda name: probabilities[name])


def decide(probabilities: Mapping[str, float]) -> str:
    """The most probable class where calling it costs less than leaving it open, else `UNDECIDED`."""
    best = most_probable(probabilities)
    return best if probabilities[best] >= LEAST_NAMED else UNDECIDED
