"""Posterior probabilities of the state of a bearing, from its combs, its lines and a comparison with a healthy record.

A comb is a line with its harmonics in the spectrum of the squared envelope. Combs are searched in the whole band after
cepstrum prewhitening; no narrower band is chosen. A state is healthy, a fault of one part, faults of two parts,
something else (a strong comb that is no line of the bearing), or a fault of an unknown part.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from srbval.bearing import DEFECTS, Fault
from srbval.reading.families import (
    LOG_RATIO_ONSET,
    LOG_RATIO_SLOPE,
    OWN_SIDEBANDS,
    SLIP_SPREAD,
    families_of,
    is_placebo_order,
)
from srbval.reading.pipeline import LARGEST_MASK_SHARE, whitened_bands
from srbval.reading.speed_search import SpeedSearch
from srbval.recordings import ShaftSpeed
from srbval.signal.comb import HARMONICS, CombSpectrum
from srbval.signal.false_alarm import APART

OTHER_CAUSE = "other"
LOWEST_ORDER, LOWEST_BIN = 0.25, 2  # shaft order and bin from which combs are scored; equal in a record of 8 turns
# Depth at which a first line is as probable with a fault as without. In the 77 records at hand, lines of named faults
# are at least 0.21 deep, race lines of healthy bearings and of sound races beside a fault up to 0.15 (UESTC's).
EVEN_ODDS_DEPTH = 0.125
MAINS_HZ = (50.0, 60.0)
UNDECIDED, OPEN = "undecided", "open"
FAULT_PAIRS = {frozenset(pair): "+".join(pair) for pair in itertools.combinations((one.value for one in DEFECTS), 2)}
SINGLE_CAUSES = (*(fault.value for fault in DEFECTS), OTHER_CAUSE)
CLASSES = (Fault.HEALTHY.value, *SINGLE_CAUSES, OPEN, *FAULT_PAIRS.values())
# Share of the records in which a second cause of strong lines is present, such as a neighbouring bearing. A line that
# stands out in the table is as much more probable with a fault than without as this share is below one: 43 of the 47
# faulty records at hand have such a line, 4 of the 30 healthy ones. A line risen over a healthy record's counts twice.
SECOND_CAUSE_SHARE = 0.1
# Healthy is as probable beforehand as single faults, something else and a hidden fault (9 of 47) together: 0.83 if
# nothing stands out; of 30 such records at hand 26 are healthy. Two faults are as probable as either. Stated.
CLASS_PRIOR = {name: SECOND_CAUSE_SHARE * (1 if name != Fault.HEALTHY else 1 + len(SINGLE_CAUSES)) for name in CLASSES}
MIN_NAMED_PROBABILITY = 1 - 1 / 3.0  # naming a wrong fault costs three times as much as naming no fault
MAX_PROBABILITY = 0.97  # (n + 1/2) / (n + 1) after n = 15 of 15 bearings of a class, the most at hand (Jeffreys' prior)
RECORD_CORRELATION = 0.5  # of two records of one bearing: 0.36 in 84 healthy records, 0.73 in 53 with a faulty race


@dataclass(frozen=True, kw_only=True)
class Comb:
    """Line at `found_hz` with its harmonics; `found_hz` is None if the spectrum does not reach to this line.

    `excess` is the comb's score (see `CombSpectrum`) minus the score of a typical comb (see `CombSpectrum.typical`),
    `depth` the modulation depth of the comb's first line. `explained_by` names another source with a multiple at
    `found_hz`: the mains, the shaft, or a comb of lower frequency with at least the same score and half the depth.
    """

    excess: float = 0.0
    found_hz: float | None = None
    depth: float = 0.0
    explained_by: str = ""

    @property
    def log_ratio(self) -> float:
        """Log likelihood ratio of a fault to no fault: smooth minimum of values from `excess` and from `depth`.

        If all lines of a strong comb double in depth, both values rise by the same amount.
        """
        if self.explained_by or not self.depth:
            return -LOG_RATIO_ONSET
        by_depth = LOG_RATIO_SLOPE * 2 * HARMONICS * math.log(self.depth / EVEN_ODDS_DEPTH)
        return -float(np.logaddexp(LOG_RATIO_ONSET - LOG_RATIO_SLOPE * self.excess, -by_depth))

    @property
    def is_clear(self) -> bool:
        """True if this `excess` is at least 1 / `SECOND_CAUSE_SHARE` times as probable with a fault as without one."""
        return LOG_RATIO_SLOPE * self.excess - LOG_RATIO_ONSET >= -math.log(SECOND_CAUSE_SHARE)


@dataclass(frozen=True, kw_only=True)
class FaultScores:
    """Strongest combs of a record by cause: one for each fault, and `OTHER_CAUSE` for a comb without a known cause.

    `first` maps each cause to its comb in the whole spectrum; `strongest` is the cause with the strongest comb. After
    the lines of this comb are removed, `second` maps the other causes to their combs (empty if no comb indicates a
    fault). `shaft_hz` is the shaft speed.
    """

    first: Mapping[str, Comb]
    second: Mapping[str, Comb]
    strongest: str
    shaft_hz: float

    @property
    def unexplained_order(self) -> float | None:
        """Frequency of the strongest comb without a known cause, in shaft orders; None if there is no such comb."""
        found_hz = self.first[OTHER_CAUSE].found_hz
        return None if found_hz is None else found_hz / self.shaft_hz


def fault_scores(analysis: SpeedSearch, more: Sequence[SpeedSearch] = ()) -> FaultScores:
    """Score the combs in a record's spectrum or, given `more` records of the machine, in their mean order spectrum."""
    speed, bearing, second = analysis.speed, analysis.bearing, dict[str, Comb]()
    stretched = ((one.processed, speed.value_hz / one.speed.value_hz) for one in (analysis, *more))
    bands = [whitened_bands(processed, bearing, speed, stretch) for processed, stretch in stretched]
    lowest_hz = max(LOWEST_ORDER * speed.value_hz, LOWEST_BIN * bands[0][0].bin_hz)
    spectrum = CombSpectrum.of(bands, lowest_hz)
    relative = bearing.largest_slip + speed.ci95_hz / speed.value_hz
    typical = spectrum.typical(relative)
    first = _combs(spectrum, analysis, relative, typical)
    strongest = max(first, key=lambda name: first[name].log_ratio)
    if first[strongest].log_ratio > 0 and (found_hz := first[strongest].found_hz):
        number = np.arange(1, math.floor(spectrum.line_hz[-1] / found_hz) + 2, dtype=np.float64)[:, None]
        side = np.arange(-OWN_SIDEBANDS, OWN_SIDEBANDS + 1, dtype=np.float64)[None, :]
        centre = number * found_hz + side * speed.value_hz
        half_hz = SLIP_SPREAD * number * found_hz + np.abs(side) * speed.ci95_hz
        rest = spectrum.without(centre.ravel(), half_hz.ravel())
        second = {name: one for name, one in _combs(rest, analysis, relative, typical).items() if name != strongest}
    return FaultScores(first=first, second=second, strongest=strongest, shaft_hz=speed.value_hz)


def _combs(spectrum: CombSpectrum, analysis: SpeedSearch, relative: float, typical: float) -> dict[str, Comb]:
    """Find the comb with the highest score near each fault's frequency, and at frequencies without a known cause.

    Near means within `relative` times the fault's frequency; `typical` is the score of a typical comb of the record.
    """
    speed, families = analysis.speed, families_of(analysis.bearing, analysis.speed.value_hz)
    foreign = is_placebo_order(spectrum.frequency_hz, relative / APART, families, speed)
    at = {OTHER_CAUSE: int(np.argmax(np.where(foreign, spectrum.score, -np.inf))) if foreign.any() else None}
    for fault, family in zip(DEFECTS, families, strict=False):
        at[fault.value] = spectrum.highest(family.kinematic_hz, relative * family.kinematic_hz)
    combs = dict.fromkeys(SINGLE_CAUSES, Comb())
    for name, index in at.items():
        if index is not None:
            combs[name] = Comb(
                excess=float(spectrum.score[index]) - typical,
                found_hz=float(spectrum.frequency_hz[index]),
                depth=float(spectrum.depth[index]),
                explained_by="" if name == OTHER_CAUSE else _source_of(spectrum, index, Fault(name), speed),
            )
    return combs


def _source_of(spectrum: CombSpectrum, at: int, fault: Fault, speed: ShaftSpeed) -> str:
    """Name the mains, shaft or comb of lower frequency of which the comb at index `at` is a multiple; empty if none."""
    found_hz = float(spectrum.frequency_hz[at])
    near_hz = max(spectrum.bin_hz / 2, SLIP_SPREAD * found_hz)
    for mains_hz in MAINS_HZ:
        number = round(found_hz / mains_hz)
        if 1 <= number <= HARMONICS and abs(found_hz - number * mains_hz) <= near_hz:
            return f"{number} times the mains frequency of {mains_hz:g} Hz"
    turns = max(2, round(found_hz / speed.value_hz))
    shaft_error_hz = min(speed.ci95_hz, LARGEST_MASK_SHARE * speed.value_hz)
    if abs(found_hz - turns * speed.value_hz) <= max(spectrum.bin_hz / 2, turns * shaft_error_hz):
        return f"harmonic {turns} of the shaft"
    score, depth = spectrum.score, spectrum.depth
    for number in sorted({2, 3, 4, turns} - ({2} if fault is Fault.ROLLER else set())):  # a roller strikes both races
        lower = spectrum.highest(found_hz / number, near_hz)
        if lower is not None and score[lower] >= score[at] and depth[lower] >= depth[at] / 2:
            lower_hz = float(spectrum.frequency_hz[lower])
            if abs(lower_hz - speed.value_hz) <= max(spectrum.bin_hz, speed.ci95_hz):
                return f"harmonic {number} of the shaft"
            return f"harmonic {number} of a comb at {lower_hz / speed.value_hz:.3f} times the shaft speed"
    return ""


def log_likelihood(
    views: Sequence[FaultScores], lines: Mapping[str, int], *, stands: bool, elsewhere: FaultScores | None = None
) -> dict[str, float]:
    """Log likelihood ratio of each state in `CLASSES` to healthy, for use with any prior.

    `views` contains the comb scores for each channel, and for each shaft speed that was tried; their likelihoods are
    averaged, because a fault may be visible in only one of them. `lines` contains a number for each part: 2 if its line
    has risen in comparison with a healthy record, 1 if its line is detected and neither noise nor a healthy record
    explains it, otherwise 0. `stands` is true if any line or comb of the record is unexplained (see
    `Diagnosis.standing`). If the record's lines fit a shaft speed outside the stated tolerance, `elsewhere` contains
    the comb scores at that speed; a fault of an unknown part can then become more likely, if the strongest comb at
    that speed belongs to another cause than the one that is most likely from `views` and `lines`.
    """
    found = [_comb_log_ratios(view) for view in views]
    mean = np.logaddexp.reduce([[one[name] for name in CLASSES] for one in found]) - math.log(len(found))
    together = dict(zip(CLASSES, mean.tolist(), strict=True))
    for name in CLASSES:
        reasons = int(stands) if name == OPEN else max(lines.get(part, 0) for part in name.split("+"))
        together[name] -= math.log(SECOND_CAUSE_SHARE) * reasons
    if elsewhere is not None and elsewhere.strongest != max(SINGLE_CAUSES, key=lambda name: together[name]):
        together[OPEN] = max(together[OPEN], elsewhere.first[elsewhere.strongest].log_ratio)
    return together


def _comb_log_ratios(view: FaultScores) -> dict[str, float]:
    """Log likelihood ratio to healthy of each state, also of two faulty parts, for one channel and shaft speed."""
    ratios = {name: view.first[name].log_ratio for name in SINGLE_CAUSES} | {Fault.HEALTHY.value: 0.0, OPEN: 0.0}
    ratios |= dict.fromkeys(FAULT_PAIRS.values(), 2 * Comb().log_ratio)
    for name, second in view.second.items():
        both = ratios[view.strongest] + second.log_ratio
        if OTHER_CAUSE in (name, view.strongest):
            part = name if view.strongest == OTHER_CAUSE else view.strongest
            ratios[part] = float(np.logaddexp(ratios[part], math.log(SECOND_CAUSE_SHARE) + both))
        else:
            ratios[FAULT_PAIRS[frozenset((name, view.strongest))]] = both
    return ratios


def probabilities(log_likelihood: Mapping[str, float]) -> dict[str, float]:
    """Posterior probability of each state from its log likelihood ratio to healthy, at most `MAX_PROBABILITY`."""
    log = np.array([math.log(CLASS_PRIOR[name]) + log_likelihood[name] for name in CLASSES])
    shares = np.exp(log - np.logaddexp.reduce(log))
    best = int(np.argmax(shares))
    if shares[best] > MAX_PROBABILITY:
        rest = np.delete(shares, best)
        shares *= (1 - MAX_PROBABILITY) / rest.sum() if rest.sum() else 0.0
        shares[best] = MAX_PROBABILITY
    return dict(zip(CLASSES, shares.tolist(), strict=True))


def of_one_machine(log_likelihoods: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Pool n records of one bearing: sum of log likelihood ratios, divided by 1 + (n - 1) `RECORD_CORRELATION`.

    The divisor is the design effect of cluster samples (Kish 1965, Survey Sampling, sect. 5.4). For a fault of an
    unknown part (`OPEN`) the highest ratio of all records is used instead.
    """
    count = len(log_likelihoods)
    effect = 1 + (count - 1) * RECORD_CORRELATION
    together = {name: sum(one[name] for one in log_likelihoods) / effect for name in CLASSES}
    return together | {OPEN: max(one[OPEN] for one in log_likelihoods)}


def share_of(state: str, probabilities: Mapping[str, float]) -> float:
    """Probability that all parts named in `state` are faulty, alone or with other parts; at most `MAX_PROBABILITY`."""
    parts = set(state.split("+"))
    return min(MAX_PROBABILITY, sum(share for name, share in probabilities.items() if parts <= set(name.split("+"))))


def decide(probabilities: Mapping[str, float]) -> str:
    """Most probable state, or `UNDECIDED` if its probability is below `MIN_NAMED_PROBABILITY` (for healthy: 1/2)."""
    best = max(probabilities, key=probabilities.__getitem__)
    least = 1 / 2 if best == Fault.HEALTHY else MIN_NAMED_PROBABILITY
    return best if share_of(best, probabilities) >= least else UNDECIDED


def faults_of(name: str) -> tuple[Fault, ...]:
    """Faulty parts in the name of a state, such as ``outer+roller``; empty if it names no part."""
    return tuple(fault for fault in DEFECTS if fault.value in name.split("+"))


LABELS = {name: " and ".join(fault.label for fault in faults_of(name)) for name in CLASSES}  # of the classes in words
LABELS |= {Fault.HEALTHY.value: Fault.HEALTHY.label, OTHER_CAUSE: "something else", OPEN: "faulty, part open"}
