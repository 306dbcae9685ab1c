"""Verdict on a record: a fault is named, nothing is found, or the state is undecided.

`diagnose` computes the probability of each state from combs (lines with their harmonics), single lines and the
comparison with a healthy record. A fault is named if its probability is at least two thirds. Nothing is found if the
probability of a healthy bearing is at least one half, and a fault of either race would have been detected. The declared
state of a record is not used.
"""

import enum
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from srbval.bearing import DEFECTS, Fault
from srbval.bridges import NotebookObject
from srbval.diagnosis import fault_posterior as posterior
from srbval.diagnosis.baseline import (
    NO_HEALTHY,
    RISEN_RATIO,
    Baseline,
    BaselineComparison,
    baseline_of,
    compare_with_baseline,
)
from srbval.diagnosis.fault_posterior import LABELS, OTHER_CAUSE, SECOND_CAUSE_SHARE, FaultScores, fault_scores
from srbval.diagnosis.long_records import LongAnalysis
from srbval.processes.machine import one_thread
from srbval.reading.analyse import Analysis
from srbval.reading.lines import RACE_LINES, Line, NotDetected, detected_fault_lines
from srbval.reading.pipeline import process
from srbval.recordings import Origin, ShaftSpeed, SpeedSource
from srbval.recordings.registry import RecordSource
from srbval.signal import LEAST_SNR
from srbval.signal.comb import FALSE_ALARM

CALIBRATION_RIGS = 7  # the numbers of the method were set on records of known state of these rigs
# A defect struck once a period modulates the squared envelope by about its mean; healthy bearings by less than half.
SHALLOW_DEPTH = 0.5
STRUCK_DEPTH = 1.0  # modulation of the squared envelope by a defect that is struck once a period
# A line of this power over the noise is read above `LEAST_SNR` in 95 of 100 records: its amplitude scatters by the part
# of the noise in phase with it, half of the noise's power (Rice 1945).
DETECTABLE_SNR = (math.sqrt(LEAST_SNR) + 1.645 / math.sqrt(2)) ** 2
DECIDABLE = 2 * SECOND_CAUSE_SHARE / (1 + 2 * SECOND_CAUSE_SHARE)  # a line that has risen raises this to two thirds


@dataclass(frozen=True, kw_only=True)
class Diagnosis(NotebookObject):
    """Most probable state of a record ("undecided" if no state is probable enough) and the evidence for it.

    `probabilities` contains all states, `log_likelihood` their log likelihood ratios to healthy, for use with other
    priors. `standing` describes the lines and combs that neither noise nor a healthy record explains. `scores` are the
    combs with the clearest evidence for the most probable state; `channel` is the channel in which they were found
    (None if only one channel was used or healthy is most probable).
    """

    state: str
    probabilities: Mapping[str, float]
    log_likelihood: Mapping[str, float]
    standing: tuple[str, ...]
    scores: FaultScores
    channel: str | None

    @property
    def shown_probabilities(self) -> dict[str, float]:
        """Probability of each state by its name in words, without improbable pairs of faults."""
        return {LABELS[name]: x for name, x in self.probabilities.items() if "+" not in name or x >= SECOND_CAUSE_SHARE}

    def summary_table(self) -> tuple[str, list[dict[str, Any]]]:
        """Sentence and table of probabilities for a notebook."""
        return self.sentence, [{"class": name, "probability": x} for name, x in self.shown_probabilities.items()]

    @property
    def sentence(self) -> str:
        """Probabilities, named fault, and the evidence of all combs in sentences."""
        shares = ", ".join(f"{name} {100 * share:.0f} %" for name, share in self.shown_probabilities.items())
        answer = "no fault is named" if self.state == Fault.HEALTHY else "no part is probable enough to be named"
        if posterior.faults_of(self.state):
            answer = f"named: {LABELS[self.state]}"
        said = (
            f"By combs and lines, compared with records of known state of {CALIBRATION_RIGS} rigs, and with a healthy "
            f"bearing as probable beforehand as all else together: {shares}; {answer}."
        )
        each = (
            f"{fault.label} {x.excess:.1f} at {100 * x.depth:.0f} %" + f" ({x.explained_by})" * bool(x.explained_by)
            for fault, x in ((fault, self.scores.first[fault]) for fault in DEFECTS)
        )
        said += f" Evidence of combs, with the modulation by their first lines: {', '.join(each)}."
        if (order := self.scores.unexplained_order) is not None:
            other = self.scores.first[OTHER_CAUSE]
            said += f" Strongest unexplained comb: order {order:.3f}, evidence {other.excess:.1f}."
        return said if self.channel is None else f"{said} The evidence is strongest in channel {self.channel}."


@one_thread()
def diagnose(
    analysis: Analysis, comparison: BaselineComparison = NO_HEALTHY, *, all_channels: bool = False
) -> Diagnosis:
    """Compute the diagnosis from the combs and lines of a record, and its comparison with a healthy record if given.

    With `all_channels` the combs in the other channels of the record are used too. If the speed was estimated from the
    record, the combs are also scored at the stated speed: the estimate may belong to another shaft.
    """
    if isinstance(analysis, LongAnalysis):
        return weigh_evidence(analysis.views, analysis, comparison)
    recording, done = analysis.recording, analysis.processed
    views, own = [(recording.channel, analysis)], recording.channels.get(recording.channel or "")
    for name, x in recording.channels.items() if all_channels else ():
        if name != recording.channel and own is not None and x.size == own.size and x.min() < x.max():
            other = process(replace(recording, channel=name), band_hz=done.band_hz, tracking=done.tracking)
            views.append((name, replace(analysis, processed=other)))
    if analysis.speed.source is SpeedSource.ESTIMATED and recording.speed is not None:
        views += [(name, replace(view, speed=recording.speed)) for name, view in views]
    return weigh_evidence([(name, fault_scores(view)) for name, view in views], analysis, comparison)


def weigh_evidence(
    views: Sequence[tuple[str | None, FaultScores]], analysis: Analysis, comparison: BaselineComparison
) -> Diagnosis:
    """Make a diagnosis of comb scores (`views`: pairs of channel and scores), lines and the `comparison`."""
    standing, elsewhere = tuple(_describe_standing(analysis, comparison)), None
    lines = {
        part.value: 2 if x.name == comparison.line else int(_is_unexplained(x, comparison))  # risen, or unexplained
        for x in analysis.lines
        if x.is_first and x.detected and (part := Fault.of_line(x.name))
    }
    if (outside := analysis.outside_speed) is not None:
        speed = ShaftSpeed(value_hz=outside.value_hz, ci95_hz=outside.ci95_hz, source=SpeedSource.ESTIMATED)
        elsewhere = fault_scores(replace(analysis, speed=speed))
    scored = [scores for _, scores in views]
    together = posterior.log_likelihood(scored, lines, stands=bool(standing), elsewhere=elsewhere)
    shares = posterior.probabilities(together)
    found = max(shares, key=shares.__getitem__)
    best, scores = max(views, key=lambda one: posterior.log_likelihood([one[1]], lines, stands=bool(standing))[found])
    return Diagnosis(
        state=posterior.decide(shares),
        probabilities=shares,
        log_likelihood=together,
        standing=standing,
        scores=scores,
        channel=best if len(dict(views)) > 1 and found != Fault.HEALTHY else None,
    )


def _is_unexplained(line: Line, comparison: BaselineComparison) -> bool:
    """True for a strong line above the noise, and for a weaker fault line that a healthy record does not explain."""
    is_deep = (line.depth or 0.0) >= SHALLOW_DEPTH
    stands = line.stands_out if Fault.of_line(line.name) else line.detected and is_deep  # a healthy cage has a line
    ratio, _ = comparison.ratios.get(line.name, (math.inf, None))
    return stands and (is_deep or ratio >= RISEN_RATIO)


def _describe_standing(analysis: Analysis, comparison: BaselineComparison) -> Iterator[str]:
    """Describe each line, and each comb (line with harmonics), that neither noise nor a healthy record explains."""
    if comparison.line is not None:
        ratio, _ = comparison.ratios[comparison.line]
        yield f"{comparison.line} {comparison.times(ratio)} as in the healthy record"
    for line in sorted((x for x in analysis.lines if x.is_first), key=lambda x: -(x.snr or 0.0)):
        noise = 1.0 if line.noise_false_alarm is None else line.noise_false_alarm
        if _is_unexplained(line, comparison):
            if line.name != comparison.line:
                yield f"{line.name} {line.snr:,.0f} times the noise"
        elif line.covered and max(noise, line.placebo_false_alarm or 0.0) < FALSE_ALARM:
            yield f"multiples of {line.name}, which is hidden by a shaft line"
    if analysis.outside is not None:
        yield f"a comb at {analysis.outside.found_hz:.2f} Hz, outside the search windows"
    if analysis.outside_speed is not None:
        yield f"lines that fit a shaft at {60 * analysis.outside_speed.value_hz:.1f} rpm, outside the stated tolerance"


class Finding(enum.StrEnum):
    """Kind of verdict on a record: a fault is named, the state is undecided, or nothing is found."""

    NAMED = "named"
    UNDECIDED = "undecided"
    NOTHING_FOUND = "nothing found"


@dataclass(frozen=True, kw_only=True)
class FaultVerdict:
    """Verdict on a record: the faulty `parts` that are named, a `headline` and `reasons`.

    `finding` and `diagnosis` are None if the record is not a measurement (but a simulation, say) or is too short.
    `advice` explains why a strong line does not name a part; it is also the first reason, and may be empty.
    """

    finding: Finding | None
    headline: str
    reasons: tuple[str, ...]
    comparison: BaselineComparison = field(default_factory=BaselineComparison)
    diagnosis: Diagnosis | None = None
    parts: tuple[Fault, ...] = ()
    advice: str = ""

    @property
    def answer(self) -> str:
        """Headline and probability of the most probable state in one sentence."""
        if self.diagnosis is None:
            return self.sentence
        shares = self.diagnosis.probabilities
        name = max(shares, key=shares.__getitem__)
        share = f"{LABELS[name]} {100 * posterior.share_of(name, shares):.0f} %"
        return f"{self.headline} ({share}, against records of known state of {CALIBRATION_RIGS} rigs)."

    @property
    def part(self) -> Fault | None:
        """Named part, or the part with the stronger comb if two are named; None if no part is named."""
        return self.parts[0] if self.parts else None

    @property
    def sentence(self) -> str:
        """Headline and reasons in one text."""
        return " ".join((f"{self.headline}.", *self.reasons))

    def describe_declared(self, declared: Fault | None) -> str:
        """Compare the declared state with the verdict, in one sentence; empty if no state is declared."""
        if declared is None:
            return ""
        other = bool(self.parts) and declared not in self.parts
        return f"Declared: {declared.label}{', which is not what was found: check the label' if other else ''}."

    def to_dict(self) -> dict[str, Any]:
        """Verdict in the form of the entry ``fault`` of a JSON document."""
        named, compared = self.diagnosis, self.comparison
        ratio, ratio_ci95 = compared.ratios.get(compared.line or "", (None, None))
        return {
            "verdict": self.finding,
            "called": self.part,
            "parts_called": self.parts,
            "headline": self.headline,
            "reasons": self.reasons,
            "state": named and named.state,
            "against": named and (compared.baseline or f"records of known state of {CALIBRATION_RIGS} rigs"),
            "probabilities": named.probabilities if named else {},
            "log_likelihood": named.log_likelihood if named else {},
            "unexplained_order": named and named.scores.unexplained_order,
            "channel": named and named.channel,
            "parts": [{"fault": f, **vars(named.scores.first[f])} for f in DEFECTS] if named else [],
            "line": compared.line,
            "ratio": ratio,
            "ratio_ci95": ratio_ci95,
            "baseline": compared.baseline,
        }


def fault_verdict(
    analysis: Analysis, baseline: Baseline | Analysis | RecordSource | None = None, *, all_channels: bool = False
) -> FaultVerdict:
    """Verdict on an analysed record, compared with a healthy record if given; raises the errors of `baseline_of`."""
    if isinstance(baseline, RecordSource):
        baseline = baseline_of(analysis, baseline)
    if analysis.recording.origin is not Origin.MEASURED:
        said = f"No fault is named: the record is {analysis.recording.origin.value}, not measured"
        return FaultVerdict(finding=None, headline=said, reasons=(analysis.summary,))
    comparison = compare_with_baseline(analysis, baseline)
    return verdict_of(analysis, comparison, diagnose(analysis, comparison, all_channels=all_channels))


def verdict_of(analysis: Analysis, comparison: BaselineComparison, diagnosis: Diagnosis) -> FaultVerdict:
    """Derive the verdict on a measured record from the probabilities of its diagnosis."""
    first, shares = diagnosis.scores.first, diagnosis.probabilities
    parts = tuple(sorted(posterior.faults_of(diagnosis.state), key=lambda part: -first[part].excess))
    seen = {x.line or "": smallest_detectable_depth(analysis.line_of(x), comparison) for x in DEFECTS}
    unseen = [name for name in RACE_LINES if seen[name] >= STRUCK_DEPTH]
    limits = advice = ""
    if parts:
        finding, line = Finding.NAMED, analysis.line_of(parts[0])
        shown = "the comb of its lines is detected in the whole band of this record"
        if comparison.line == line.name:
            ratio, _ = comparison.ratios[line.name]
            shown = f"the {line.name} line is {comparison.times(ratio)} as in the healthy record"
        elif line.detected:
            shown = f"the {line.name} line is {line.snr:,.0f} times the noise"
        headline = f"{parts[0].label.capitalize()} fault: {shown}"
        if len(parts) > 1:
            headline = f"{LABELS[diagnosis.state].capitalize()} faults: {shown}, and both combs are strong"
    elif diagnosis.state != Fault.HEALTHY:
        finding = Finding.UNDECIDED
        strong = [*diagnosis.standing]
        for name, comb in sorted(first.items(), key=lambda named: -named[1].log_ratio):
            if comb.log_ratio > 0 and comb.found_hz:
                order = f"a comb at {comb.found_hz / diagnosis.scores.shaft_hz:.3f} times the shaft speed"
                strong.append(order if name == OTHER_CAUSE else f"the {LABELS[name]}'s comb in the whole band")
        headline = f"Undecided: strong lines that are not explained: {', '.join(strong[:3])}"
        advice = " ".join(
            f"The comb at {Fault(name).line}, {comb.found_hz:.2f} Hz, is {comb.explained_by}: "
            "it does not identify a fault."
            for name, comb in first.items()
            if comb.explained_by and comb.is_clear
        )
        deep = (x for x in detected_fault_lines(analysis.lines) if (x.depth or 0.0) >= SHALLOW_DEPTH)
        part = next((Fault.of_line(x.name) for x in deep), None)
        if not advice and part is not None:
            share, needed = posterior.share_of(part, shares), posterior.MIN_NAMED_PROBABILITY
            decidable = share > DECIDABLE and not comparison.ratios
            advice = (
                f"Not named: without tones and exact repetitions, {part.label} has {100 * share:.0f} %; "
                f"{100 * needed:.0f} % is needed. The spacing of impacts of rolling elements scatters by slip; impacts "
                "of a gear or a synthetic signal repeat exactly."
                f"{' A healthy record can decide: --healthy FILE.' * decidable}"
            )
    elif unseen:
        finding = Finding.UNDECIDED
        headline = f"Undecided: {' and '.join(unseen)} could not have been detected in this record at any fault size"
    else:
        finding = Finding.NOTHING_FOUND
        least = max(limit for limit in seen.values() if limit < STRUCK_DEPTH)
        steady = "" if analysis.processed.tracking.used else " at a steady speed"
        fault = "a fault" if max(seen.values()) < STRUCK_DEPTH else "a race fault"
        headline = (
            f"Nothing found: no fault is named and no strong line is unexplained; {fault} would have been detected "
            f"from a modulation of about {100 * least:.2g} % up{steady}"
        )
        each = (f"{name} {f'{100 * x:.2g} %' if x < STRUCK_DEPTH else 'not at all'}" for name, x in seen.items())
        limits = (
            f"Smallest detectable modulation of the squared envelope in this band: {', '.join(each)}. "
            "An impact at every passage modulates it by 100 % or more, less under other vibration."
        )
    reasons = (advice, limits, comparison.sentence, analysis.summary, diagnosis.sentence)
    return FaultVerdict(
        finding=finding,
        headline=headline,
        reasons=tuple(filter(None, reasons)),
        comparison=comparison,
        diagnosis=diagnosis,
        parts=parts,
        advice=advice,
    )


def smallest_detectable_depth(line: Line, comparison: BaselineComparison) -> float:
    """Least modulation depth at which a line is detected in 95 of 100 records; infinite if it cannot be detected.

    At this depth the line has `DETECTABLE_SNR` times the power of the noise or, if `line` was compared with a healthy
    record, `RISEN_RATIO` times its present depth.
    """
    if line.not_detected in (NotDetected.OUT_OF_REACH, NotDetected.HIDDEN) or not line.snr or line.depth is None:
        return math.inf
    return line.depth * (RISEN_RATIO if line.name in comparison.ratios else math.sqrt(DETECTABLE_SNR / line.snr))
