"""Whether a record shows a fault, compared with the healthy record of the same rig, speed and load."""

import dataclasses
import enum
import math
from dataclasses import dataclass

import numpy as np

from srbval.bearing import Fault
from srbval.reading.analyse import Analysis
from srbval.reading.families import OTHER_LINE
from srbval.reading.lines import Line, detected_fault_lines
from srbval.reading.verdict import SHALLOW_DEPTH
from srbval.recordings import Origin
from srbval.signal import LEAST_SNR, NORMAL_95

# A fault is called where its line stands this many times above the healthy bearing's (6 dB, the usual alarm
# step of condition monitoring), its 95 % interval clear of one.
CALLING_RATIO = 2.0
# An outer-race line whose second harmonic is less than this share of it is a smooth modulation, as rollers passing
# under the load cause it (varying compliance, Sunnersjo 1978, J. Sound Vib. 58, 363), not a train of impacts. The
# healthy model at 997 rpm has 0.2 with a line half as deep as its mean, measured outer-race faults 0.48 and more.
IMPACT_SECOND_HARMONIC = 1 / 3
# Factor by which a healthy line's share of the mean may change from one speed or load to another: the largest of 15
# changes, three lines in five bands, between the two healthy records of one rig at hand that differ in speed, and 1.96
# times their scatter (tests/validation/test_baseline.py). One rig: another may need more.
OTHER_CONDITIONS = 5.5


class Basis(enum.StrEnum):
    """What a comparison rests on."""

    BASELINE = "healthy baseline"
    LINE_ALONE = "line alone"
    DECLARED_HEALTHY = "declared healthy"
    NOT_MEASURED = "not measured"


@dataclass(frozen=True, kw_only=True, eq=False)
class Baseline:
    """A healthy record analysed in the band of the record that is compared with it.

    `conditions` says in words what of speed and load differs: a healthy bearing's lines change with both, so the
    comparison is less certain. `remarks` names what else differs, or what neither record states.
    """

    analysis: Analysis
    conditions: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class BaselineComparison:
    """`indicated` is the state the deepest clear line points to; `called` is it only where there is a baseline.

    `ratio` is the line's modulation over the baseline's, `ratio_ci95` its interval; `sentence` says all that
    in words, and where there is no baseline that a line alone cannot tell.
    """

    basis: Basis
    sentence: str
    indicated: Fault | None = None
    called: Fault | None = None
    line: str | None = None
    ratio: float | None = None
    ratio_ci95: tuple[float, float] | None = None
    baseline: str | None = None


def compare_with_baseline(analysis: Analysis, baseline: Baseline | Analysis | None = None) -> BaselineComparison:
    """Compare `analysis` with the analysis of a healthy record in the same band.

    Where a `Baseline` states `conditions` that differ, modulations are compared as depths, since levels rise with the
    speed, and the interval of their ratio is as much wider as `OTHER_CONDITIONS` says.

    Modulations are compared in the squared envelope's own unit where both records state one, else as depths
    (share of the mean), since amplitudes of unknown scale cannot be compared. Without a baseline a line like a
    fault's (`is_fault_like`) is taken as indicating its part, and nothing is called: rollers passing under load give a
    healthy bearing lines of its own. A record declared healthy is never called faulty; a line like a fault's is
    reported as a doubt about the label. Raises `ValueError` for different bands.
    """
    healthy = baseline.analysis if isinstance(baseline, Baseline) else baseline
    conditions = baseline.conditions if isinstance(baseline, Baseline) else ()
    recording = analysis.recording
    if recording.origin is not Origin.MEASURED:
        return BaselineComparison(
            basis=Basis.NOT_MEASURED, sentence="No fault is called on a record that is not measured."
        )
    if healthy is not None and healthy.processed.band_hz != analysis.processed.band_hz:
        raise ValueError(f"bands differ: {analysis.processed.band_hz}, {healthy.processed.band_hz}.")
    lines = detected_fault_lines(analysis.lines)
    like_fault = next((x for x in lines if is_fault_like(analysis, x)), None)
    if healthy is not None and recording.state is not Fault.HEALTHY:
        return _compared(analysis, lines, healthy, conditions)
    state, part = _part(like_fault) if like_fault else (None, "")
    if recording.state is not Fault.HEALTHY:
        sentence = (
            "no healthy record of this rig at the same speed and load is registered: "
            "a line alone cannot tell a fault from the healthy bearing's own lines."
        )
        points = f"The {like_fault.name} line points to {part} fault, but " if like_fault else ""
        sentence = points + sentence if points else sentence[0].upper() + sentence[1:]
    elif like_fault:
        sentence = (
            f"Doubtful: the record is declared healthy, but its {like_fault.name} line is like {part} fault's. "
            "Check the label before using it as a baseline."
        )
    else:
        shown = f"its {lines[0].name} line is shallow or smooth" if lines else "no race or roller line shows"
        sentence = f"No fault is called: the record is declared healthy and {shown}; it is a baseline."
    return BaselineComparison(
        basis=Basis.DECLARED_HEALTHY if recording.state is Fault.HEALTHY else Basis.LINE_ALONE, sentence=sentence,
        indicated=state, line=like_fault.name if like_fault else None,
    )  # fmt: skip


def is_fault_like(analysis: Analysis, line: Line) -> bool:
    """Whether `line` is at least half as deep as the mean and, on the outer race, not a smooth modulation.

    Where its second harmonic is out of reach, it is taken for a train of impacts.
    """
    if not line.detected or (line.depth or 0.0) < SHALLOW_DEPTH:
        return False
    second = [x.depth for x in analysis.lines if (x.name, x.harmonic) == (line.name, 2) and x.depth is not None]
    return line.name != "BPFO" or not second or second[0] >= IMPACT_SECOND_HARMONIC * (line.depth or 0.0)


def _part(line: Line) -> tuple[Fault, str]:
    """The fault of a line, and its part as it stands before a noun, with an article: ``an outer-race``."""
    fault = Fault.of_line(line.name)
    assert fault is not None, "only lines of faults are compared"
    return fault, f"{'an' if fault.label[0] in 'aeiou' else 'a'} {fault.label.replace(' ', '-')}"


def _short(ratio: float) -> str:
    """Three digits, never with an exponent a reader has to work out."""
    return f"{float(f'{ratio:.3g}'):,g}"


def _compared(
    analysis: Analysis, lines: list[Line], baseline: Analysis, conditions: tuple[str, ...]
) -> BaselineComparison:
    name = baseline.recording.name
    if conditions:
        name += f" ({', '.join(conditions)}: comparable within a factor of {OTHER_CONDITIONS:g} only)"
    ratios = [(x, *r) for x in lines if (r := _ratio(analysis, x, baseline, bool(conditions)))]
    risen = [(x, ratio, ci95) for x, ratio, ci95 in ratios if ratio >= CALLING_RATIO and ci95[0] > 1]
    if not risen:
        return BaselineComparison(
            basis=Basis.BASELINE,
            sentence=f"Compared with the healthy record {name}, no line is {CALLING_RATIO:g} times as high or more: "
            "no fault is called.",
            baseline=baseline.recording.file,
        )
    line, ratio, ci95 = risen[0]
    state, part = _part(line)
    others = [f"{x.name} {_short(r)} times" for x, r, _ in risen[1:]]
    also = f" (also higher, less deep: {', '.join(others)})" if others else ""
    return BaselineComparison(
        basis=Basis.BASELINE,
        sentence=f"Compared with the healthy record {name}, the {line.name} line is {_short(ratio)} times as high "
        f"(95 %: {_short(ci95[0])} to {_short(ci95[1])}): {part.split()[1]} fault{also}.",
        indicated=state,
        called=state,
        line=line.name,
        ratio=ratio,
        ratio_ci95=ci95,
        baseline=baseline.recording.file,
    )


def _ratio(
    analysis: Analysis, line: Line, baseline: Analysis, other_conditions: bool
) -> tuple[float, tuple[float, float]] | None:
    """Modulation of `line` over the baseline's with its 95 % interval; None where the baseline's is out of reach.

    Where the baseline's peak is another's line, its own was not detected: it is taken as high as it could be.
    """
    scaled = not other_conditions and analysis.recording.unit == baseline.recording.unit == "m/s2"
    before = baseline.line(line.name)
    if before.explained_by == OTHER_LINE and before.snr and before.depth is not None:
        not_detected = min(1.0, math.sqrt(LEAST_SNR / before.snr))
        before = dataclasses.replace(before, depth=not_detected * before.depth, snr=min(before.snr, LEAST_SNR))
    ours, theirs = _modulation(analysis, line, scaled), _modulation(baseline, before, scaled)
    if not theirs:
        return None
    noise = NORMAL_95 * math.sqrt(sum(0.5 / max(x.snr or 0.0, 0.5) for x in (line, before)))
    spread = math.hypot(noise, math.log(OTHER_CONDITIONS) if other_conditions else 0.0)
    ratio = ours / theirs
    return ratio, (ratio * math.exp(-spread), ratio * math.exp(spread))


def _modulation(analysis: Analysis, line: Line, scaled: bool) -> float:
    """Amplitude of the line in the squared envelope: share of its mean, or (m/s2) squared."""
    depth = line.depth or 0.0
    if not scaled or analysis.recording.channel is None:
        return depth
    mean = float(np.mean(analysis.processed.squared))
    return depth * mean * float(np.var(analysis.recording.channels[analysis.recording.channel]))
