"""Posterior probabilities of the state that a record shows, the one source of its verdict.

A state is healthy, a fault of one part, two faults, something else (a strong comb of no line of the bearing), or a
fault whose part is open. Combs (`FaultScores`), lines of the table and a comparison with a healthy record are weighed
together (`Evidence`).
"""

import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np

from srbval.bearing import DEFECTS, Fault
from srbval.diagnosis.fault_scores import ONSET, OTHER, SLOPE, Comb, FaultScores

UNDECIDED, OPEN = "undecided", "open"
PAIRS = {frozenset(pair): "+".join(pair) for pair in itertools.combinations((one.value for one in DEFECTS), 2)}
ONE = (*(fault.value for fault in DEFECTS), OTHER)
CLASSES = (Fault.HEALTHY.value, *ONE, OPEN, *PAIRS.values())
# Share of the records in which a second cause of strong lines is present, such as a neighbouring bearing. A line that
# stands out in the table is as much more probable with a fault than without as this share is below one: 43 of the 47
# faulty records at hand have such a line, 4 of the 30 healthy ones. A line risen over a healthy record's counts twice.
BESIDE = 0.1
# Healthy or not with equal odds, and all single faults as probable as something else and as a fault that hides, which
# 9 of 47 do: healthy with 0.83 if nothing stands out; of 30 such records at hand 26 are.
# Two faults at once have half of the prior of one: of 400 planted single faults none shows a second comb. Stated.
PRIOR = {name: 0.5 if name == Fault.HEALTHY else 0.1 for name in CLASSES if name not in PAIRS.values()}
PRIOR |= dict.fromkeys(PAIRS.values(), PRIOR[OPEN] / 2)
LEAST_NAMED = 1 - 1 / 3.0  # probability from which a fault is named: a wrong call costs three times as much as none
MOST = 0.97  # (n + 1/2) / (n + 1) after n = 15 of 15 bearings of a class, the most at hand (Jeffreys' prior)
SHARED = 0.5  # correlation of two records of one bearing: 0.36 in 84 of healthy ones, 0.73 in 53 of faulty races


def log_likelihood(
    views: Sequence[FaultScores], lines: Mapping[str, int], *, stands: bool, elsewhere: FaultScores | None = None
) -> dict[str, float]:
    """Log likelihood ratio of each class over healthy, for use with any prior.

    It is the mean likelihood over several `views` (channels or speeds): any may show the class. `lines` counts the
    reasons that the table gives for each part, 1 for its line that stands out and 2 for one that has risen. With
    `stands` something in the table stands out, whatever its part. If the combs `elsewhere`, at a speed outside the
    stated tolerance, are those of another part, the part is open.
    """
    found = [_of_combs(view, lines) for view in views]
    together = {name: _log_sum([one[name] for one in found]) - math.log(len(found)) for name in CLASSES}
    for name in CLASSES:
        reasons = int(stands) if name == OPEN else max(lines.get(part, 0) for part in name.split("+"))
        together[name] -= math.log(BESIDE) * reasons
    if elsewhere is not None and elsewhere.strongest != max(ONE, key=lambda name: together[name]):
        together[OPEN] = max(together[OPEN], elsewhere.first[elsewhere.strongest].log_ratio)
    return together


def _of_combs(view: FaultScores, lines: Mapping[str, int]) -> dict[str, float]:
    """Log likelihood ratios by the combs of one view.

    The strongest comb has a second one beside it, or none; a comb of another machine part is no evidence against a
    fault, and neither is a silent comb against a part whose line has risen.
    """

    def ratio(name: str, comb: Comb) -> float:
        return max(comb.log_ratio, 0.0) if lines.get(name, 0) > 1 else comb.log_ratio

    ratios = {name: ratio(name, view.first[name]) for name in ONE} | {Fault.HEALTHY.value: 0.0, OPEN: 0.0}
    ratios |= dict.fromkeys(PAIRS.values(), 2 * Comb().log_ratio)
    for name, second in view.second.items():
        both = ratios[view.strongest] + ratio(name, second)
        if OTHER in (name, view.strongest):
            part = name if view.strongest == OTHER else view.strongest
            ratios[part] = _log_sum([ratios[part], math.log(BESIDE) + both])
        else:
            ratios[PAIRS[frozenset((name, view.strongest))]] = both
    return ratios


def probabilities(log_likelihood: Mapping[str, float]) -> dict[str, float]:
    """Posterior probability of each class, at most `MOST`."""
    log = np.array([math.log(PRIOR[name]) + log_likelihood[name] for name in CLASSES])
    shares = np.exp(log - np.logaddexp.reduce(log))
    best = int(np.argmax(shares))
    if shares[best] > MOST:
        rest = np.delete(shares, best)
        shares *= (1 - MOST) / rest.sum() if rest.sum() else 0.0
        shares[best] = MOST
    return dict(zip(CLASSES, shares.tolist(), strict=True))


def of_one_machine(log_likelihoods: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Log likelihood ratios of n records of one bearing together: their sum over 1 + (n - 1) `SHARED`.

    The design effect of cluster samples (Kish 1965, Survey Sampling, sect. 5.4). A line that one record shows is open
    for the machine.
    """
    count = len(log_likelihoods)
    together = {name: sum(one[name] for one in log_likelihoods) / (1 + (count - 1) * SHARED) for name in CLASSES}
    return together | {OPEN: max(one[OPEN] for one in log_likelihoods)}


def most_probable(probabilities: Mapping[str, float]) -> str:
    """The most probable class."""
    return max(probabilities, key=lambda name: probabilities[name])


def share_of(state: str, probabilities: Mapping[str, float]) -> float:
    """Probability of a class or, if it has parts, that all of them are faulty, whatever else is; at most `MOST`."""
    parts = set(state.split("+"))
    return min(MOST, sum(share for name, share in probabilities.items() if parts <= set(name.split("+"))))


def decide(probabilities: Mapping[str, float]) -> str:
    """The parts, or else the most probable class, that are probable enough to be called, else `UNDECIDED`."""
    if parts := [one.value for one in DEFECTS if share_of(one.value, probabilities) >= LEAST_NAMED]:
        return "+".join(parts)
    best = most_probable(probabilities)
    return best if probabilities[best] >= LEAST_NAMED else UNDECIDED


def stands_out(excess: float) -> bool:
    """True for a comb that is 1 / `BESIDE` times as probable with a cause as without."""
    return SLOPE * excess - ONSET >= -math.log(BESIDE)


def faults_of(name: str) -> tuple[Fault, ...]:
    """The faults of a class, none if it names no part."""
    return tuple(fault for fault in DEFECTS if fault.value in name.split("+"))


LABELS = {name: " and ".join(fault.label for fault in faults_of(name)) for name in CLASSES}
LABELS |= {Fault.HEALTHY.value: Fault.HEALTHY.label, OTHER: "something else", OPEN: "faulty, part open"}
"""Names of the classes in words."""


def _log_sum(values: Sequence[float]) -> float:
    return float(np.logaddexp.reduce(values))
