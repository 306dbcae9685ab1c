"""Posterior probabilities of what a record shows: healthy, a fault of one part, or something else.

A record has one feature of each fault and one of the strongest comb that none of them explains (`FaultScores`). Each
class is compared with the healthy one by the feature that tells the two apart; it is a mixture (`ClassFeature`) of
records that show it and records that hide it, each following Student's t. One scale holds the scatter of rigs,
bearings, runs and noise, every rig, and every bearing of a rig, having the same weight.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import DEFECTS, Fault
from srbval.signal.false_alarm import FOREIGN_COMB

OTHER, UNDECIDED = "other", "undecided"
CLASSES = (Fault.HEALTHY.value, *(fault.value for fault in DEFECTS), OTHER)
# Before anything is known of a record a bearing is healthy or not with equal odds, and all that it may be instead is
# equally probable. Stated, not fitted; others with `log_likelihood`.
PRIOR = {name: 0.5 if name == Fault.HEALTHY else 0.5 / (len(CLASSES) - 1) for name in CLASSES}
FREEDOM = 4.0
# The location common to all parts counts as this many rigs in the location of one part.
SHRINKAGE = 2.0
# A wrong call costs this many times what no call costs: a class is called from probability 1 - 1 / WRONG_COST.
WRONG_COST = 3.0
# Least scale: the highest of white noise in a window scatters by 0.55, of real noise a little more. Most silent
# features lie at their floor and show none of it.
LEAST_SCALE = 0.6
_ROUNDS = 50  # of the iteration for location and scale
_PARTS = tuple(fault.value for fault in DEFECTS)


@dataclass(frozen=True, kw_only=True)
class KnownFeatures:
    """Features of a record of known state: `families` by part, `unexplained`; `state` is one of `CLASSES`."""

    rig: str
    specimen: str
    state: str
    families: tuple[float, ...]
    unexplained: float

    @property
    def vector(self) -> FloatArray:
        """All features, [4]."""
        return np.array([*self.families, self.unexplained])


@dataclass(frozen=True, kw_only=True)
class StudentT:
    """Student's t distribution of `FREEDOM` degrees of freedom, of a feature: its location and scale."""

    location: float
    scale: float

    def log_density(self, values: FloatArray | float) -> FloatArray:
        """Log density, less a constant that is the same for all scales; ten times as fast as `scipy.stats.t`."""
        distance = ((np.asarray(values) - self.location) / self.scale) ** 2
        return np.asarray(-math.log(self.scale) - (FREEDOM + 1) / 2 * np.log1p(distance / FREEDOM))


@dataclass(frozen=True, kw_only=True)
class ClassFeature:
    """How the feature that tells a class from the healthy one is distributed over records of that class.

    A mixture: in the share `hidden` of the records the fault does not show and the feature is distributed as in healthy
    records, `silent`; in the others it stands out, distributed as `shown`.
    """

    shown: StudentT
    silent: StudentT
    hidden: float

    def log_ratio(self, value: float) -> float:
        """Log likelihood of the class over the healthy one, for a record whose feature has this value."""
        ratio = float(self.shown.log_density(value) - self.silent.log_density(value))
        return float(np.logaddexp(math.log1p(-self.hidden) + ratio, math.log(self.hidden)))


@dataclass(frozen=True, kw_only=True)
class FaultPosterior:
    """The fitted classes but the healthy one, by name, and how many bearings are known of each class."""

    classes: Mapping[str, ClassFeature]
    specimens: Mapping[str, int]

    def log_likelihood(self, *channels: FloatArray) -> dict[str, float]:
        """Log likelihood of each class over the healthy one's; with it any prior can be used.

        From the features [4] of each of several `channels`, of which any may be the one that shows the class: the mean
        of the likelihoods, so that every channel looked at is paid for. Something else may stand beside a fault.
        """
        ratios = {
            name: np.array([self.classes[name].log_ratio(float(features[number])) for features in channels])
            for number, name in enumerate(CLASSES[1:]) if name in self.classes
        }  # fmt: skip
        if OTHER in ratios:
            beside = np.logaddexp(math.log1p(-FOREIGN_COMB), math.log(FOREIGN_COMB) + ratios[OTHER])
            ratios = {name: ratio + beside * (name != OTHER) for name, ratio in ratios.items()}
        found = {name: float(np.logaddexp.reduce(ratio)) - math.log(ratio.size) for name, ratio in ratios.items()}
        return {Fault.HEALTHY.value: 0.0} | found

    def probabilities(self, *channels: FloatArray, prior: Mapping[str, float] = PRIOR) -> dict[str, float]:
        """Posterior probability of each class, none above (n + 1/2) / (n + 1) of n specimens known of it.

        That is what n of n leave to the next by Jeffreys' prior.
        """
        weight = {name: prior[name] * math.exp(value) for name, value in self.log_likelihood(*channels).items()}
        total = sum(weight.values())
        found = {name: value / total for name, value in weight.items()}
        best = most_probable(found)
        cap = (self.specimens[best] + 0.5) / (self.specimens[best] + 1)
        if found[best] <= cap:
            return found
        least = {name: max(value, 1e-300) for name, value in weight.items()}
        rest = sum(value for name, value in least.items() if name != best)
        return {name: cap if name == best else (1 - cap) * value / rest for name, value in least.items()}


def most_probable(probabilities: Mapping[str, float]) -> str:
    """The class of the highest probability."""
    return max(probabilities, key=lambda name: probabilities[name])


def decide(probabilities: Mapping[str, float]) -> str:
    """The most probable class where calling it costs less than leaving it open, else `UNDECIDED`."""
    best = most_probable(probabilities)
    return best if probabilities[best] >= 1 - 1 / WRONG_COST else UNDECIDED


def fit_posterior(known: Sequence[KnownFeatures]) -> FaultPosterior:
    """Classes from records of known state."""
    weighted = _weighted(known)
    of = {name: [(w, k) for w, k in weighted if k.state == name] for name in CLASSES}
    silent = _fit_student([(w, x) for name in (Fault.HEALTHY, OTHER) for w, k in of[name] for x in k.families])
    own = {name: [(w, k.families[number]) for w, k in of[name]] for number, name in enumerate(_PARTS) if of[name]}
    classes = _fit_mixtures(own, silent)
    if of[OTHER]:
        quiet = _fit_student([(w, k.unexplained) for w, k in of[Fault.HEALTHY]])
        classes |= _fit_mixtures({OTHER: [(w, k.unexplained) for w, k in of[OTHER]]}, quiet)
    return FaultPosterior(
        classes=classes, specimens={n: len({(k.rig, k.specimen) for _, k in pairs}) for n, pairs in of.items()}
    )


def _weighted(known: Sequence[KnownFeatures]) -> list[tuple[float, KnownFeatures]]:
    """Every record with its weight: one for each rig and state, shared evenly by its specimens and by their records."""
    records = Counter((k.rig, k.state, k.specimen) for k in known)
    specimens = Counter((rig, state) for rig, state, _ in records)
    return [(1 / specimens[k.rig, k.state] / records[k.rig, k.state, k.specimen], k) for k in known]


def _fit_mixtures(own: Mapping[str, Sequence[tuple[float, float]]], silent: StudentT) -> dict[str, ClassFeature]:
    """Each class as a mixture of what shows, with one scale, and what hides, by expectation and maximisation."""
    if not own:
        return {}
    of = np.repeat(np.arange(len(own)), [len(pairs) for pairs in own.values()])
    weight, values = np.array([pair for pairs in own.values() for pair in pairs]).T
    total = np.bincount(of, weight)
    location, hidden = np.full(len(own), values.max() / 2), np.full(len(own), 0.5)
    scale = float(max(values.max() / 4, LEAST_SCALE))
    for _ in range(_ROUNDS):
        off = values - location[of]
        ratio = StudentT(location=0.0, scale=scale).log_density(off) - silent.log_density(values)
        odds = (1 / hidden[of] - 1) * np.exp(ratio)
        seen = weight * odds / (1 + odds)
        share = seen * (FREEDOM + 1) / (FREEDOM + (off / scale) ** 2)
        everywhere, rigs = float(share @ values / share.sum()), np.bincount(of, seen)
        # Each class at its own location, drawn towards that of all by `SHRINKAGE` rigs.
        mean = np.bincount(of, share * values) / np.maximum(np.bincount(of, share), 1e-300)
        location = (rigs * mean + SHRINKAGE * everywhere) / (rigs + SHRINKAGE)
        scale = max(math.sqrt(float(share @ (values - location[of]) ** 2 / seen.sum())), LEAST_SCALE)
        hidden = (1 + total - rigs) / (2 + total)
    # The location itself is known from so many rigs.
    return {
        name: ClassFeature(
            shown=StudentT(location=float(location[n]), scale=scale * math.sqrt(1 + 1 / (1 + float(rigs[n])))),
            silent=silent, hidden=float(hidden[n]),
        )
        for n, name in enumerate(own)
    }  # fmt: skip


def _fit_student(weighted: Sequence[tuple[float, float]]) -> StudentT:
    """Location and scale by their iteration (Lange, Little & Taylor 1989, J. Am. Stat. Assoc. 84, 881)."""
    weight, values = np.array(weighted).T
    total = float(weight.sum())
    location, scale = float(weight @ values) / total, max(float(values.std()), LEAST_SCALE)
    for _ in range(_ROUNDS):
        share = weight * (FREEDOM + 1) / (FREEDOM + ((values - location) / scale) ** 2)
        location = float(share @ values / share.sum())
        scale = max(math.sqrt(float(share @ (values - location) ** 2) / total), LEAST_SCALE)
    return StudentT(location=location, scale=scale)
