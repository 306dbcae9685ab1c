"""Posterior probabilities of what a record shows: healthy, a fault of one part, or something else.

A record has one feature of each fault and one of the strongest comb that none of them explains (`FaultScores`). Each
class is held against the healthy one by the feature that tells the two apart, so that log likelihoods are those over
the healthy class's. A class is a mixture: where it shows, its feature stands out; some of its records hide it, and look
as silent as any (most rollers). Every part of it follows a Student t of `FREEDOM` degrees. A record of a rig never seen
is drawn with the scatter of rigs, bearings, runs and noise at once, so that one spread holds them all, every rig, and
every bearing of a rig, having the same weight. It is not shared by all classes: a silent part scatters as the highest
of noise does, a faulty one as sizes of faults do. One offset sets the level of all likelihoods over the healthy
class's; it is fitted on rigs left out.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from srbval.arrays import FloatArray
from srbval.bearing import DEFECTS, Fault

OTHER, UNDECIDED = "other", "undecided"
CLASSES = (Fault.HEALTHY.value, *(fault.value for fault in DEFECTS), OTHER)
# Before anything is known of a record every class is as probable. Stated, not fitted; others with `log_likelihood`.
PRIOR = dict.fromkeys(CLASSES, 1 / len(CLASSES))
FREEDOM = 4.0
# Rigs that the place of all parts counts for in the place of one part's own family.
SHRINKAGE = 2.0
# A wrong call costs this many times what no call costs: a class is called from probability 1 - 1 / WRONG_COST.
WRONG_COST = 3.0
# Least spread of a role: the highest of white noise in a window scatters by 0.55, of real noise a little more. Most
# silent features lie at their floor and show none of it.
LEAST_SPREAD = 0.6
_ROUNDS = 50  # of the iteration for place and spread
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
class Role:
    """Place and spread of a feature."""

    place: float
    spread: float

    def log_density(self, values: FloatArray | float) -> FloatArray:
        """Of the Student t, less a constant that is the same for all roles."""
        return _log_student(((np.asarray(values) - self.place) / self.spread) ** 2, self.spread)


@dataclass(frozen=True, kw_only=True)
class Shown:
    """The feature of a class: as it is where the class shows, where it does not, and the share of those that hide."""

    shown: Role
    silent: Role
    hidden: float

    def log_ratio(self, value: float) -> float:
        """Log likelihood of the class over the healthy one."""
        ratio = float(self.shown.log_density(value) - self.silent.log_density(value))
        return float(np.logaddexp(math.log1p(-self.hidden) + ratio, math.log(self.hidden)))


@dataclass(frozen=True, kw_only=True)
class FaultPosterior:
    """The fitted classes but the healthy one, by name.

    `specimens`: bearings known of each class; `offset`: what all likelihoods lose against the healthy class's.
    """

    classes: Mapping[str, Shown]
    specimens: Mapping[str, int]
    offset: float = 0.0

    def log_likelihood(self, *channels: FloatArray) -> dict[str, float]:
        """Log likelihood of each class over the healthy one's; with it any prior can be used.

        From the features [4] of each of several `channels`, of which any may be the one that shows the class: the mean
        of the likelihoods, so that every channel looked at is paid for.
        """
        found = {Fault.HEALTHY.value: 0.0}
        for number, name in enumerate(CLASSES[1:]):
            if name in self.classes:
                ratio = [self.classes[name].log_ratio(float(features[number])) for features in channels]
                found[name] = float(np.logaddexp.reduce(ratio)) - math.log(len(ratio)) - self.offset
        return found

    def probabilities(self, *channels: FloatArray, prior: Mapping[str, float] = PRIOR) -> dict[str, float]:
        """Posterior probability of each class, none above (n + 1/2) / (n + 1) of n specimens known of it.

        That is what n of n leave to the next by Jeffreys' prior.
        """
        weight = {name: prior[name] * math.exp(value) for name, value in self.log_likelihood(*channels).items()}
        total = sum(weight.values())
        found = {name: value / total for name, value in weight.items()}
        best = most_probable(found)
        cap = (self.specimens[best] + 0.5) / (self.specimens[best] + 1)
        if found[best] > cap:
            others = {name: max(value, 1e-300) for name, value in weight.items() if name != best}
            rest = sum(others.values())
            found = {name: (1 - cap) * value / rest for name, value in others.items()} | {best: cap}
            found = {name: found[name] for name in weight}
        return found


def _log_student(distance: FloatArray, spread: float) -> FloatArray:
    return np.asarray(-math.log(spread) - (FREEDOM + 1) / 2 * np.log1p(distance / FREEDOM))


def most_probable(probabilities: Mapping[str, float]) -> str:
    """The class of the highest probability."""
    return max(probabilities, key=lambda name: probabilities[name])


def decide(probabilities: Mapping[str, float]) -> str:
    """The most probable class where calling it costs less than leaving it open, else `UNDECIDED`."""
    best = most_probable(probabilities)
    return best if probabilities[best] >= 1 - 1 / WRONG_COST else UNDECIDED


def fit_posterior(known: Sequence[KnownFeatures]) -> FaultPosterior:
    """Classes from records of known state, with the offset by which rigs left out in turn are judged best.

    The offset is drawn towards none by a normal prior of standard deviation one: few rigs are silent.
    """
    weighted = _weighted(known)
    rows = []
    for rig in dict.fromkeys(k.rig for k in known):
        model = _fitted([pair for pair in weighted if pair[1].rig != rig])
        rows += [(w, k.state, model.log_likelihood(k.vector)) for w, k in weighted if k.rig == rig]
    rows = [(w, state, found) for w, state, found in rows if state in found]
    weight = np.array([w for w, *_ in rows])
    likelihood = np.array([[found.get(name, -np.inf) for name in CLASSES] for *_, found in rows])
    prior = np.array([PRIOR[name] for name in CLASSES])
    faulty = np.array([name != Fault.HEALTHY for name in CLASSES])
    was_faulty = np.array([state != Fault.HEALTHY for _, state, _ in rows])

    def score(offset: float) -> float:
        return (
            float(weight @ (np.log(np.exp(likelihood - offset * faulty) @ prior) + offset * was_faulty)) + offset**2 / 2
        )

    best = minimize_scalar(score, bounds=(-3.0, 3.0), method="bounded")
    return replace(_fitted(weighted), offset=float(best.x))


def _weighted(known: Sequence[KnownFeatures]) -> list[tuple[float, KnownFeatures]]:
    """Every record with its weight: one for each rig and state, shared evenly by its specimens and by their records."""
    records = Counter((k.rig, k.state, k.specimen) for k in known)
    specimens = Counter((rig, state) for rig, state, _ in records)
    return [(1 / specimens[k.rig, k.state] / records[k.rig, k.state, k.specimen], k) for k in known]


def _fitted(weighted: Sequence[tuple[float, KnownFeatures]]) -> FaultPosterior:
    of = {name: [(w, k) for w, k in weighted if k.state == name] for name in CLASSES}
    silent = _role([(w, x) for name in (Fault.HEALTHY, OTHER) for w, k in of[name] for x in k.families])
    own = {name: [(w, k.families[number]) for w, k in of[name]] for number, name in enumerate(_PARTS) if of[name]}
    classes = _shown(own, silent)
    if of[OTHER]:
        quiet = _role([(w, k.unexplained) for w, k in of[Fault.HEALTHY]])
        classes |= _shown({OTHER: [(w, k.unexplained) for w, k in of[OTHER]]}, quiet)
    return FaultPosterior(
        classes=classes, specimens={n: len({(k.rig, k.specimen) for _, k in pairs}) for n, pairs in of.items()}
    )


def _shown(own: Mapping[str, Sequence[tuple[float, float]]], silent: Role) -> dict[str, Shown]:
    """Each class as a mixture of what shows, with one spread, and what hides, by expectation and maximisation."""
    if not own:
        return {}
    of = np.repeat(np.arange(len(own)), [len(pairs) for pairs in own.values()])
    weight, values = np.array([pair for pairs in own.values() for pair in pairs]).T
    total = np.bincount(of, weight)
    place, hidden = np.full(len(own), values.max() / 2), np.full(len(own), 0.5)
    spread = float(max(values.max() / 4, LEAST_SPREAD))
    for _ in range(_ROUNDS):
        distance = ((values - place[of]) / spread) ** 2
        odds = (1 / hidden[of] - 1) * np.exp(_log_student(distance, spread) - silent.log_density(values))
        seen = weight * odds / (1 + odds)
        share = seen * (FREEDOM + 1) / (FREEDOM + distance)
        everywhere, rigs = float(share @ values / share.sum()), np.bincount(of, seen)
        # Each class at its own place, drawn towards that of all by `SHRINKAGE` rigs.
        mean = np.bincount(of, share * values) / np.maximum(np.bincount(of, share), 1e-300)
        place = (rigs * mean + SHRINKAGE * everywhere) / (rigs + SHRINKAGE)
        spread = max(math.sqrt(float(share @ (values - place[of]) ** 2 / seen.sum())), LEAST_SPREAD)
        hidden = (1 + total - rigs) / (2 + total)
    # The place itself is known from so many rigs.
    return {
        name: Shown(
            shown=Role(place=float(place[n]), spread=spread * math.sqrt(1 + 1 / (1 + float(rigs[n])))),
            silent=silent, hidden=float(hidden[n]),
        )
        for n, name in enumerate(own)
    }  # fmt: skip


def _role(weighted: Sequence[tuple[float, float]]) -> Role:
    """Place and spread of a Student t by its iteration (Lange, Little & Taylor 1989, J. Am. Stat. Assoc. 84, 881)."""
    weight, values = np.array(weighted).T
    total = float(weight.sum())
    place, spread = float(weight @ values) / total, max(float(values.std()), LEAST_SPREAD)
    for _ in range(_ROUNDS):
        share = weight * (FREEDOM + 1) / (FREEDOM + ((values - place) / spread) ** 2)
        place = float(share @ values / share.sum())
        spread = max(math.sqrt(float(share @ (values - place) ** 2) / total), LEAST_SPREAD)
    return Role(place=place, spread=spread)
