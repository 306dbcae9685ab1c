"""Posterior probabilities of what a record shows: healthy, a fault of one part, or something else.

A record has one feature of each fault: by how much its family's comb stands out above the next fault's; and one of the
strongest comb that none of them explains. Each class is held against the healthy one by the feature that tells the two
apart, so that log likelihoods are those over the healthy class's: a part's by its own feature as faulty and as silent,
something else's by the unexplained comb. Every feature follows a Student t of `FREEDOM` degrees. A record of a rig
never seen is drawn with the scatter of rigs, bearings, runs and noise at once, so that one spread holds them all, every
rig, and every bearing of a rig, having the same weight. It is not shared by all classes: a silent part scatters as the
highest of noise does, a faulty one as sizes of faults do. One exponent tempers all likelihoods, fitted on rigs left
out.
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
# Least spread of a role: the highest of noise in a window scatters by more than this.
LEAST_SPREAD = 0.3
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
        distance = ((np.asarray(values) - self.place) / self.spread) ** 2
        return np.asarray(-math.log(self.spread) - (FREEDOM + 1) / 2 * np.log1p(distance / FREEDOM))


@dataclass(frozen=True, kw_only=True)
class FaultPosterior:
    """The fitted classes: of each but the healthy one its feature's role in it and outside it.

    `specimens`: bearings known of each class; `temper`: exponent of all likelihoods.
    """

    roles: Mapping[str, tuple[Role, Role]]
    specimens: Mapping[str, int]
    temper: float = 1.0

    def log_likelihood(self, features: FloatArray) -> dict[str, float]:
        """Log likelihood of each class over the healthy one's, tempered: with it any prior can be used."""
        found = {Fault.HEALTHY.value: 0.0}
        for name, value in zip(CLASSES[1:], features, strict=True):
            if name in self.roles:
                inside, outside = self.roles[name]
                found[name] = self.temper * float(inside.log_density(value) - outside.log_density(value))
        return found

    def probabilities(self, features: FloatArray, prior: Mapping[str, float] = PRIOR) -> dict[str, float]:
        """Posterior probability of each class, none above (n + 1) / (n + 2) of n specimens known of it."""
        weight = {name: prior[name] * math.exp(value) for name, value in self.log_likelihood(features).items()}
        total = sum(weight.values())
        found = {name: value / total for name, value in weight.items()}
        best = max(found, key=lambda name: found[name])
        cap = (self.specimens[best] + 1) / (self.specimens[best] + 2)
        if found[best] > cap:
            others = {name: max(value, 1e-300) for name, value in weight.items() if name != best}
            rest = sum(others.values())
            found = {name: (1 - cap) * value / rest for name, value in others.items()} | {best: cap}
            found = {name: found[name] for name in weight}
        return found


def decide(probabilities: Mapping[str, float]) -> str:
    """The most probable class where calling it costs less than leaving it open, else `UNDECIDED`."""
    best = max(probabilities, key=lambda name: probabilities[name])
    return best if probabilities[best] >= 1 - 1 / WRONG_COST else UNDECIDED


def fit_posterior(known: Sequence[KnownFeatures]) -> FaultPosterior:
    """Classes from records of known state; likelihoods tempered so that rigs left out in turn are judged best."""
    weighted = _weighted(known)
    rows = []
    for rig in dict.fromkeys(k.rig for k in known):
        model = _fitted([pair for pair in weighted if pair[1].rig != rig])
        rows += [(w, k.state, model.log_likelihood(k.vector)) for w, k in weighted if k.rig == rig]
    weight = np.array([w for w, state, found in rows if state in found])
    likelihood = np.array([[f.get(n, -np.inf) for n in CLASSES] for _, state, f in rows if state in f])
    own = np.array([found[state] for _, state, found in rows if state in found])
    prior = np.array([PRIOR[name] for name in CLASSES])

    def score(temper: float) -> float:
        return float(weight @ (np.log(np.exp(temper * likelihood) @ prior) - temper * own))

    best = minimize_scalar(score, bounds=(0.05, 3.0), method="bounded")
    return replace(_fitted(weighted), temper=float(best.x))


def _weighted(known: Sequence[KnownFeatures]) -> list[tuple[float, KnownFeatures]]:
    """Every record with its weight: one for each rig and state, shared evenly by its specimens and by their records."""
    records = Counter((k.rig, k.state, k.specimen) for k in known)
    specimens = Counter((rig, state) for rig, state, _ in records)
    return [(1 / specimens[k.rig, k.state] / records[k.rig, k.state, k.specimen], k) for k in known]


def _fitted(weighted: Sequence[tuple[float, KnownFeatures]]) -> FaultPosterior:
    of = {name: [(w, k) for w, k in weighted if k.state == name] for name in CLASSES}
    rigs = {name: len({k.rig for _, k in pairs}) for name, pairs in of.items()}
    own = {name: [(w, k.families[number]) for w, k in of[name]] for number, name in enumerate(_PARTS) if of[name]}
    everywhere = _role([pair for pairs in own.values() for pair in pairs]).place
    place = {n: (rigs[n] * _role(p).place + SHRINKAGE * everywhere) / (rigs[n] + SHRINKAGE) for n, p in own.items()}
    spread = _role([(w, x - place[name]) for name, pairs in own.items() for w, x in pairs]).spread
    silent = _role([(w, x) for name in (Fault.HEALTHY, OTHER) for w, k in of[name] for x in k.families])
    # The place itself is known from so many rigs.
    roles = {n: (Role(place=place[n], spread=spread * math.sqrt(1 + 1 / rigs[n])), silent) for n in own}
    if of[OTHER]:
        alien = _role([(w, k.unexplained) for w, k in of[OTHER]])
        roles[OTHER] = alien, _role([(w, k.unexplained) for name in CLASSES[:-1] for w, k in of[name]])
    return FaultPosterior(
        roles=roles, specimens={n: len({(k.rig, k.specimen) for _, k in pairs}) for n, pairs in of.items()}
    )


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
