"""The state that a record shows: combs, lines and the comparison with a healthy record in one posterior."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from srbval.bearing import Fault
from srbval.diagnosis.baseline import RISEN_RATIO, BaselineComparison, short_ratio
from srbval.diagnosis.fault_posterior import (
    BESIDE,
    LABELS,
    decide,
    faults_of,
    log_likelihood,
    most_probable,
    probabilities,
    stands_out,
)
from srbval.diagnosis.fault_scores import OTHER, FaultScores, fault_scores
from srbval.processes.machine import one_thread
from srbval.reading.analyse import Analysis
from srbval.reading.lines import Line
from srbval.reading.pipeline import process
from srbval.reading.speed_search import OutsideSpeed
from srbval.recordings import ShaftSpeed, SpeedSource
from srbval.signal.comb import FALSE_ALARM

RIGS = 7  # whose records of known state the numbers of the method were set on
NO_HEALTHY = BaselineComparison(sentence="There is no healthy record of the same machine, speed and load to compare.")
# A defect struck once a period modulates the squared envelope by about its mean; healthy bearings by less than half.
SHALLOW_DEPTH = 0.5
# An outer-race line with a weaker second harmonic is a smooth modulation by rollers that pass under the load (varying
# compliance, Sunnersjo 1978, J. Sound Vib. 58, 363). The healthy model has 0.2, measured outer-race faults from 0.48.
IMPACT_SECOND_HARMONIC = 1 / 3


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """Class called (`state`, "undecided" if none is probable enough) and `probabilities` of all classes.

    `log_likelihood` is that of each class over healthy, for other priors. `standing` lists all in the table of lines
    that stands out. `channel` shows the class best, and `scores` belong to it.
    """

    state: str
    probabilities: Mapping[str, float]
    log_likelihood: Mapping[str, float]
    standing: tuple[str, ...]
    scores: FaultScores
    channel: str | None

    @property
    def best_class(self) -> str:
        """The most probable class."""
        return most_probable(self.probabilities)

    @property
    def cage_shows(self) -> bool:
        """True if the cage's comb stands out."""
        return stands_out(self.scores.cage.excess)

    @property
    def coincidences(self) -> tuple[str, ...]:
        """Combs at a fault's line that are multiples of another source, in words."""
        combs = ((Fault(name), comb) for name, comb in self.scores.first.items() if comb.explained_by)
        return tuple(
            f"The comb at {fault.line}, {comb.found_hz:.2f} Hz, is {comb.explained_by}: it names no fault by itself."
            for fault, comb in combs
            if stands_out(comb.excess)
        )

    @property
    def sentence(self) -> str:
        """The diagnosis in words."""
        shown = {name: share for name, share in self.probabilities.items() if "+" not in name or share >= BESIDE}
        shares = ", ".join(f"{LABELS[name]} {100 * share:.0f} %" for name, share in shown.items())
        answer = "no fault is named" if self.state == Fault.HEALTHY else "no part is probable enough to be named"
        if faults_of(self.state):
            answer = f"named: {LABELS[self.state]}"
        said = [
            f"By combs and lines, beside records of known state of {RIGS} rigs and with a healthy bearing as probable "
            f"beforehand as all else together: {shares}; {answer}."
        ]
        if (order := self.scores.unexplained_order) is not None:
            excess = self.scores.first[OTHER].excess
            said.append(f"Strongest unexplained comb: order {order:.3f}, evidence {excess:.1f}.")
        if self.channel is not None:
            said.append(f"Channel {self.channel} shows it best.")
        if self.cage_shows:
            said.append(
                f"The cage's comb stands out (evidence {self.scores.cage.excess:.1f}), as of one rolling element or "
                "one pocket that strikes once a turn of the cage; it names no fault."
            )
        return " ".join(said)


@one_thread()
def diagnose(
    analysis: Analysis, comparison: BaselineComparison = NO_HEALTHY, *, all_channels: bool = False
) -> Diagnosis:
    """Diagnose an analysed record, by itself or compared with a healthy one.

    With `all_channels` other channels of the record are views too. If the speed was estimated from the record, the
    stated speed within its tolerance is a further view: the estimate may belong to another shaft.
    """
    return weigh(views_of(analysis, all_channels=all_channels), analysis, comparison)


def weigh(
    scored: list[tuple[str | None, FaultScores]], analysis: Analysis, comparison: BaselineComparison
) -> Diagnosis:
    """Diagnosis from channel and scores of each view, the table of lines, and the comparison."""
    standing = tuple(_standing(analysis, comparison))
    views, lines = [one for _, one in scored], dict(_reasons(analysis, comparison))
    elsewhere = None if analysis.outside_speed is None else fault_scores(at_speed(analysis, analysis.outside_speed))
    together = log_likelihood(views, lines, stands=bool(standing), elsewhere=elsewhere)
    shares = probabilities(together)
    found = most_probable(shares)
    best = int(np.argmax([log_likelihood([one], lines, stands=bool(standing))[found] for one in views]))
    return Diagnosis(
        state=decide(shares),
        probabilities=shares,
        log_likelihood=together,
        standing=standing,
        scores=views[best],
        channel=scored[best][0] if len(dict(scored)) > 1 and found != Fault.HEALTHY else None,
    )


def views_of(analysis: Analysis, *, all_channels: bool) -> list[tuple[str | None, FaultScores]]:
    """Channel and scores of each view of a record, see `diagnose`; channels are of the same length, not constant."""
    recording, done = analysis.recording, analysis.processed
    views, own = [(recording.channel, analysis)], recording.channels.get(recording.channel or "")
    for name, x in recording.channels.items() if all_channels else ():
        if name != recording.channel and own is not None and x.size == own.size and x.min() < x.max():
            other = process(replace(recording, channel=name), band_hz=done.band_hz, tracking=done.tracking)
            views.append((name, replace(analysis, processed=other)))
    if analysis.speed.source is SpeedSource.ESTIMATED and recording.speed is not None:
        views += [(name, replace(view, speed=recording.speed)) for name, view in views]
    return [(name, fault_scores(view)) for name, view in views]


def at_speed(analysis: Analysis, outside: OutsideSpeed) -> Analysis:
    """The analysis about a speed outside the stated tolerance."""
    speed = ShaftSpeed(value_hz=outside.value_hz, ci95_hz=outside.ci95_hz, source=SpeedSource.ESTIMATED)
    return replace(analysis, speed=speed)


def is_fault_like(analysis: Analysis, line: Line) -> bool:
    """True if `line` is at least half as deep as the mean and, on the outer race, not a smooth modulation."""
    if not line.detected or (line.depth or 0.0) < SHALLOW_DEPTH:
        return False
    second = [x.depth for x in analysis.lines if (x.name, x.harmonic) == (line.name, 2) and x.depth is not None]
    return line.name != "BPFO" or not second or second[0] >= IMPACT_SECOND_HARMONIC * (line.depth or 0.0)


def _stands(line: Line, comparison: BaselineComparison) -> bool:
    """True if a first line stands out and is not as in a comparable healthy record; of the cage, only a deep line."""
    is_deep = (line.depth or 0.0) >= SHALLOW_DEPTH
    stands = line.stands_out if Fault.of_line(line.name) else line.detected and is_deep  # a healthy cage has a line
    ratio, _ = comparison.ratios.get(line.name, (math.inf, None))
    return stands and (is_deep or ratio >= RISEN_RATIO)


def _reasons(analysis: Analysis, comparison: BaselineComparison) -> Iterator[tuple[str, int]]:
    """Parts whose own line stands out unexplained, 1, or has risen and is like a fault's, 2."""
    for line in analysis.lines:
        part = Fault.of_line(line.name)
        if part is None or not (line.is_first and line.detected):
            continue
        if line.name == comparison.line and is_fault_like(analysis, line):
            yield part.value, 2
        elif _stands(line, comparison):
            yield part.value, 1


def _standing(analysis: Analysis, comparison: BaselineComparison) -> Iterator[str]:
    """All in the table that stands out, in a few words each: risen lines first, then the highest."""
    if comparison.line is not None:
        yield f"{comparison.line} {short_ratio(comparison.ratio or 0.0)} {comparison.times} as in the healthy record"
    for line in sorted((x for x in analysis.lines if x.is_first), key=lambda x: -(x.snr or 0.0)):
        if _stands(line, comparison):
            if line.name != comparison.line:
                yield f"{line.name} {line.snr:,.0f} times the noise"
        elif (
            line.covered
            and line.noise_false_alarm is not None
            and max(line.noise_false_alarm, line.placebo_false_alarm or 0.0) < FALSE_ALARM
        ):
            yield f"multiples of {line.name}, which the shaft covers itself"
    if analysis.outside is not None:
        yield f"a comb at {analysis.outside.found_hz:.2f} Hz, outside the search windows"
    if analysis.outside_speed is not None:
        yield f"lines that fit a shaft at {60 * analysis.outside_speed.value_hz:.1f} rpm, outside the stated tolerance"
