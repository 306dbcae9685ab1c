"""The one verdict on a record: a fault is named, strong lines stay unexplained, or nothing was found.

Headline, reasons and tone of a report, the text of ``analyse`` and its JSON follow from it alone.

*Named*: a part is probable enough by the record alone (`diagnose`), or its line is like a fault's and has risen against
a comparable healthy record. *Undecided*: something strong names no part, such as a line above the noise (unless a
comparable healthy record has it too and it is too shallow for a fault), or a race line could not be searched. *Nothing
found*: all other records. The declared state of a record is not used.
"""

import enum
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from srbval.bearing import DEFECTS, Fault
from srbval.diagnosis.baseline import RISEN_RATIO, Baseline, BaselineComparison, compare_with_baseline, short_ratio
from srbval.diagnosis.diagnose import Diagnosis, diagnose, fault_of, label_of
from srbval.diagnosis.fault_posterior import LEAST_NAMED, OTHER
from srbval.reading.analyse import Analysis
from srbval.reading.lines import RACE_LINES, Line, NotDetected
from srbval.recordings import Origin
from srbval.signal import LEAST_SNR
from srbval.signal.comb import FALSE_ALARM

# A defect struck once a period modulates the squared envelope by about its mean; healthy bearings by less than half.
SHALLOW_DEPTH, STRUCK_DEPTH = 0.5, 1.0
# An outer-race line with a weaker second harmonic is a smooth modulation by rollers that pass under the load (varying
# compliance, Sunnersjo 1978, J. Sound Vib. 58, 363). The healthy model has 0.2, measured outer-race faults from 0.48.
IMPACT_SECOND_HARMONIC = 1 / 3
# A line of this power over the noise is read above `LEAST_SNR` in 95 of 100 records: its amplitude scatters by the part
# of the noise in phase with it, half of the noise's power (Rice 1945).
SEEN_SNR = (math.sqrt(LEAST_SNR) + 1.645 / math.sqrt(2)) ** 2


class Finding(enum.StrEnum):
    """Kind of a verdict."""

    NAMED = "named"
    UNDECIDED = "undecided"
    NOTHING_FOUND = "nothing found"


@dataclass(frozen=True, kw_only=True)
class FaultVerdict:
    """Verdict on a record: the `part` named, a `headline`, and `reasons`, first the `advice` if no part is named.

    `finding` and `diagnosis` are None if the record is not measured.
    """

    finding: Finding | None
    headline: str
    reasons: tuple[str, ...]
    comparison: BaselineComparison
    diagnosis: Diagnosis | None = None
    part: Fault | None = None
    advice: str = ""

    @property
    def answer(self) -> str:
        """Headline and probability in one sentence."""
        if self.diagnosis is None:
            return self.sentence
        name = self.diagnosis.best_class if self.part is None else self.part.value
        share = f"{label_of(name)} {100 * self.diagnosis.probabilities[name]:.0f} % by the record alone"
        return f"{self.headline} ({share}, against records of known state of {self.diagnosis.rigs} rigs)."

    @property
    def sentence(self) -> str:
        """Headline and reasons."""
        return " ".join((f"{self.headline}.", *self.reasons))

    def beside(self, declared: Fault | None) -> str:
        """The declared state compared with the verdict, in words; empty if no state is declared."""
        if declared is None:
            return ""
        other = self.part is not None and self.part is not declared
        return f"Declared: {declared.label}{', which is not what was found: check the label' if other else ''}."

    def to_dict(self) -> dict[str, Any]:
        """The entry ``fault`` of JSON documents."""
        named, compared = self.diagnosis, self.comparison
        return {
            "verdict": self.finding,
            "called": self.part,
            "headline": self.headline,
            "reasons": self.reasons,
            "state": named and named.state,
            "against": named and (compared.baseline or f"records of known state of {named.rigs} rigs"),
            "probabilities": named.probabilities if named else {},
            "log_likelihood": named.log_likelihood if named else {},
            "unexplained_order": named and named.scores.unexplained_order,
            "cage_excess": named and named.scores.cage,
            "channel": named and named.channel,
            "parts": named.scores.parts if named else (),
            **{name: getattr(compared, name) for name in ("line", "ratio", "ratio_ci95", "baseline")},
        }


def fault_verdict(
    analysis: Analysis, baseline: Baseline | Analysis | None = None, *, all_channels: bool = False
) -> FaultVerdict:
    """Judge an analysed record, compared with a healthy record if given.

    `all_channels`: see `diagnose`. Raises what `compare_with_baseline` raises.
    """
    if analysis.recording.origin is not Origin.MEASURED:
        said = f"No fault is named: the record is {analysis.recording.origin.value}, not measured"
        return FaultVerdict(
            finding=None, headline=said, reasons=(analysis.summary,), comparison=BaselineComparison(sentence="")
        )
    comparison = compare_with_baseline(analysis, baseline)
    return verdict_of(analysis, comparison, diagnose(analysis, all_channels=all_channels))


def verdict_of(analysis: Analysis, comparison: BaselineComparison, diagnosis: Diagnosis) -> FaultVerdict:
    """Verdict on a measured record from its lines, the comparison and the diagnosis of the record alone."""
    part = fault_of(diagnosis.state)
    if part is None and comparison.line is not None and is_fault_like(analysis, analysis.line(comparison.line)):
        part = comparison.risen
    strong = list(_strong(analysis, comparison, diagnosis))
    unseen = [name for name in RACE_LINES if smallest_seen(analysis.line(name), comparison) >= STRUCK_DEPTH]
    limits = advice = ""
    if part is not None:
        finding, line = Finding.NAMED, analysis.line_of(part)
        shown = "the record alone shows the comb of its lines in the whole band"
        if comparison.risen is part:
            ratio = short_ratio(comparison.ratio or 0.0)
            shown = f"the {line.name} line stands {ratio} {comparison.times} as in the healthy record"
        elif line.detected:
            shown = f"the {line.name} line stands {line.snr:,.0f} times above the noise"
        headline = f"{part.label.capitalize()} fault: {shown}"
    elif strong:
        finding = Finding.UNDECIDED
        headline = f"Undecided: strong lines that are not explained: {', '.join(strong[:3])}"
        # Why no part is named although a line is like a fault's, and what would decide.
        if alike := [one for one in DEFECTS if is_fault_like(analysis, analysis.line_of(one))]:
            likely = max(alike, key=lambda one: analysis.line_of(one).snr or 0.0)
            advice = (
                f"Not named: once tones and all that repeats exactly are taken out, {likely.label} has "
                f"{100 * diagnosis.probabilities[likely]:.0f} %; {100 * LEAST_NAMED:.0f} % is needed. Impacts of "
                "rolling elements scatter by slip, those of a gear or a synthetic signal do not. A healthy record of "
                "the machine can decide: --healthy FILE."
            )
    elif unseen:
        finding = Finding.UNDECIDED
        lines = " and ".join(unseen)
        headline = f"Undecided: {lines} could not have been detected in this record at any fault size"
    else:
        finding = Finding.NOTHING_FOUND
        seen = {f: smallest_seen(analysis.line_of(f), comparison) for f in DEFECTS}
        least = max(limit for limit in seen.values() if limit < STRUCK_DEPTH)
        headline = (
            "Nothing found: no fault is named and no strong line is unexplained; a fault would have been seen from a "
            f"modulation of about {100 * least:.2g} % up"
        )
        each = (f"{f.line} {f'from {100 * x:.2g} % up' if x < STRUCK_DEPTH else 'not at all'}" for f, x in seen.items())
        limits = (
            "Lines would have been seen by how much they modulate the squared envelope in this band: "
            f"{', '.join(each)}. A blow at every passage modulates it by 100 % and more, less under other vibration."
        )
    reasons = (advice, limits, comparison.sentence, analysis.summary, diagnosis.sentence)
    return FaultVerdict(
        finding=finding,
        headline=headline,
        reasons=tuple(filter(None, reasons)),
        comparison=comparison,
        diagnosis=diagnosis,
        part=part,
        advice=advice,
    )


def is_fault_like(analysis: Analysis, line: Line) -> bool:
    """True if `line` is at least half as deep as the mean and, on the outer race, not a smooth modulation."""
    if not line.detected or (line.depth or 0.0) < SHALLOW_DEPTH:
        return False
    second = [x.depth for x in analysis.lines if (x.name, x.harmonic) == (line.name, 2) and x.depth is not None]
    return line.name != "BPFO" or not second or second[0] >= IMPACT_SECOND_HARMONIC * (line.depth or 0.0)


def smallest_seen(line: Line, comparison: BaselineComparison) -> float:
    """Depth from which a line at the frequency of `line` stands out in 95 of 100 records; infinite if it cannot.

    It is that of `SEEN_SNR` times the noise or, at a line of the healthy bearing, `RISEN_RATIO` times its depth, for a
    line with the harmonics of impacts.
    """
    if line.not_detected in (NotDetected.OUT_OF_REACH, NotDetected.HIDDEN) or not line.snr or line.depth is None:
        return math.inf
    return line.depth * (RISEN_RATIO if line.name in comparison.ratios else math.sqrt(SEEN_SNR / line.snr))


def _strong(analysis: Analysis, comparison: BaselineComparison, diagnosis: Diagnosis) -> Iterator[str]:
    """All that stands out without naming a part, in a few words each: risen lines first, then the highest."""
    if comparison.line is not None:
        yield f"{comparison.line} {short_ratio(comparison.ratio or 0.0)} {comparison.times} as in the healthy record"
    firsts = sorted((x for x in analysis.lines if x.is_first), key=lambda x: -(x.snr or 0.0))
    for line in firsts:
        is_deep = (line.depth or 0.0) >= SHALLOW_DEPTH
        stands = line.stands_out if Fault.of_line(line.name) else line.detected and is_deep  # a healthy cage has a line
        ratio, _ = comparison.ratios.get(line.name, (math.inf, None))
        if stands and line.name != comparison.line and (is_deep or ratio >= RISEN_RATIO):
            yield f"{line.name} {line.snr:,.0f} times the noise"
        elif (
            line.covered
            and line.noise_false_alarm is not None
            and max(line.noise_false_alarm, line.placebo_false_alarm or 0.0) < FALSE_ALARM
        ):
            yield f"multiples of {line.name}, which the shaft covers itself"
    best = diagnosis.best_class
    if best == OTHER and diagnosis.scores.unexplained_order is not None:
        yield f"a comb at {diagnosis.scores.unexplained_order:.3f} times the shaft speed"
    for part in diagnosis.scores.parts:
        if part["fault"] == best or (part["false_alarm"] is not None and part["false_alarm"] < FALSE_ALARM):
            yield f"the {part['fault'].label}'s comb in the whole band"
    if analysis.outside is not None:
        yield f"a comb at {analysis.outside.found_hz:.2f} Hz, outside the search windows"
    if analysis.outside_speed is not None:
        yield f"lines that fit a shaft at {60 * analysis.outside_speed.value_hz:.1f} rpm, outside the stated tolerance"
