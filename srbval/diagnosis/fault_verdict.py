"""The one verdict on a record: a fault is named, strong lines stay unexplained, or nothing was found.

Headline, reasons and tone of a report, the text of ``analyse`` and its JSON follow from it alone.

The verdict follows from the probabilities of the diagnosis (`diagnose`). *Named*: a fault has two thirds. *Nothing
found*: healthy has more than one half and both race lines were searched. *Undecided*: all others, such as a line above
the noise that is not as in a comparable healthy record. The declared state of a record is not used.
"""

import enum
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from srbval.bearing import DEFECTS, Fault
from srbval.diagnosis.baseline import RISEN_RATIO, Baseline, BaselineComparison, compare_with_baseline, short_ratio
from srbval.diagnosis.diagnose import RIGS, Diagnosis, diagnose, is_fault_like
from srbval.diagnosis.fault_posterior import LABELS, LEAST_NAMED, OTHER, faults_of, share_of
from srbval.reading.analyse import Analysis
from srbval.reading.lines import RACE_LINES, Line, NotDetected
from srbval.recordings import Origin
from srbval.signal import LEAST_SNR

STRUCK_DEPTH = 1.0  # modulation of the squared envelope by a defect that is struck once a period
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
    """Verdict on a record: the `parts` named, a `headline`, and `reasons`, first the `advice` if no part is named.

    `finding` and `diagnosis` are None if the record is not measured.
    """

    finding: Finding | None
    headline: str
    reasons: tuple[str, ...]
    comparison: BaselineComparison
    diagnosis: Diagnosis | None = None
    parts: tuple[Fault, ...] = ()
    advice: str = ""

    @property
    def answer(self) -> str:
        """Headline and probability in one sentence."""
        if self.diagnosis is None:
            return self.sentence
        name = self.diagnosis.state if self.parts else self.diagnosis.best_class
        share = f"{LABELS[name]} {100 * share_of(name, self.diagnosis.probabilities):.0f} %"
        return f"{self.headline} ({share}, against records of known state of {RIGS} rigs)."

    @property
    def part(self) -> Fault | None:
        """The part named, of two the one whose comb is stronger."""
        return self.parts[0] if self.parts else None

    @property
    def sentence(self) -> str:
        """Headline and reasons."""
        return " ".join((f"{self.headline}.", *self.reasons))

    def beside(self, declared: Fault | None) -> str:
        """The declared state compared with the verdict, in words; empty if no state is declared."""
        if declared is None:
            return ""
        other = bool(self.parts) and declared not in self.parts
        return f"Declared: {declared.label}{', which is not what was found: check the label' if other else ''}."

    def to_dict(self) -> dict[str, Any]:
        """The entry ``fault`` of JSON documents."""
        named, compared = self.diagnosis, self.comparison
        return {
            "verdict": self.finding,
            "called": self.part,
            "parts_called": self.parts,
            "headline": self.headline,
            "reasons": self.reasons,
            "state": named and named.state,
            "against": named and (compared.baseline or f"records of known state of {RIGS} rigs"),
            "probabilities": named.probabilities if named else {},
            "log_likelihood": named.log_likelihood if named else {},
            "unexplained_order": named and named.scores.unexplained_order,
            "cage_excess": named and (named.scores.cage.found_hz and named.scores.cage.excess),
            "channel": named and named.channel,
            "parts": [{"fault": f, **vars(named.scores.first[f])} for f in DEFECTS] if named else [],
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
    return verdict_of(analysis, comparison, diagnose(analysis, comparison, all_channels=all_channels))


def verdict_of(analysis: Analysis, comparison: BaselineComparison, diagnosis: Diagnosis) -> FaultVerdict:
    """Verdict on a measured record, which follows from the probabilities of its diagnosis."""
    first, shares = diagnosis.scores.first, diagnosis.probabilities
    parts = tuple(sorted(faults_of(diagnosis.state), key=lambda part: -first[part].excess))
    unseen = [name for name in RACE_LINES if smallest_seen(analysis.line(name), comparison) >= STRUCK_DEPTH]
    limits = advice = ""
    if parts:
        finding, line = Finding.NAMED, analysis.line_of(parts[0])
        shown = "the record alone shows the comb of its lines in the whole band"
        if comparison.risen is parts[0]:
            ratio = short_ratio(comparison.ratio or 0.0)
            shown = f"the {line.name} line stands {ratio} {comparison.times} as in the healthy record"
        elif line.detected:
            shown = f"the {line.name} line stands {line.snr:,.0f} times above the noise"
        headline = f"{parts[0].label.capitalize()} fault: {shown}"
        if len(parts) > 1:
            headline = f"{LABELS[diagnosis.state].capitalize()} faults: {shown}, and both combs are strong"
    elif shares[Fault.HEALTHY] <= 1 / 2:
        finding = Finding.UNDECIDED
        strong = [*diagnosis.standing, *_strong_combs(diagnosis)]
        headline = f"Undecided: strong lines that are not explained: {', '.join(strong[:3])}"
        # Why no part is named although a line is like a fault's, and what would decide.
        advice = " ".join(diagnosis.coincidences)
        if not advice and (alike := [one for one in DEFECTS if is_fault_like(analysis, analysis.line_of(one))]):
            likely = max(alike, key=lambda one: analysis.line_of(one).snr or 0.0)
            advice = (
                f"Not named: once tones and all that repeats exactly are taken out, {likely.label} has "
                f"{100 * shares[likely]:.0f} %; {100 * LEAST_NAMED:.0f} % is needed. Impacts of "
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
        steady = "" if analysis.processed.tracking.used else " at a steady speed"
        headline = (
            "Nothing found: no fault is named and no strong line is unexplained; a fault would have been seen from a "
            f"modulation of about {100 * least:.2g} % up{steady}"
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
        parts=parts,
        advice=advice,
    )


def smallest_seen(line: Line, comparison: BaselineComparison) -> float:
    """Depth from which a line at the frequency of `line` stands out in 95 of 100 records; infinite if it cannot.

    It is that of `SEEN_SNR` times the noise or, at a line of the healthy bearing, `RISEN_RATIO` times its depth, for a
    line with the harmonics of impacts.
    """
    if line.not_detected in (NotDetected.OUT_OF_REACH, NotDetected.HIDDEN) or not line.snr or line.depth is None:
        return math.inf
    return line.depth * (RISEN_RATIO if line.name in comparison.ratios else math.sqrt(SEEN_SNR / line.snr))


def _strong_combs(diagnosis: Diagnosis) -> Iterator[str]:
    """Combs that are evidence of a cause, the strongest first, in a few words each."""
    combs = sorted(diagnosis.scores.first.items(), key=lambda named: -named[1].log_ratio)
    for name, comb in combs:
        if comb.log_ratio > 0 and comb.found_hz:
            order = comb.found_hz / diagnosis.scores.shaft_hz
            yield (
                f"a comb at {order:.3f} times the shaft speed"
                if name == OTHER
                else f"the {LABELS[name]}'s comb in the whole band"
            )
