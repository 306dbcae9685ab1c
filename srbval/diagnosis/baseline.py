"""The healthy record that a record is compared with, how the two differ, and whether the record shows a fault.

Or a healthy record's noise under a simulated run.
"""

import dataclasses
import enum
import math
from dataclasses import dataclass

import numpy as np

from srbval.bearing import Fault
from srbval.errors import ConfigurationError, DataError
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.lines import OTHER_LINE, Line, detected_fault_lines
from srbval.reading.pipeline import one_signal
from srbval.reading.verdict import SHALLOW_DEPTH
from srbval.recordings import Origin, Recording, RecordingSettings
from srbval.recordings.datasets.srbval_files import SENSOR
from srbval.recordings.registry import healthy_baseline, load_registered, registered_settings
from srbval.signal import LEAST_SNR, NORMAL_95, phase_randomised

# Speeds, and loads, that differ by no more than this share are one operating point: a motor's slip under load.
SAME_SHARE = 0.03
N_PER_KN = 1000.0
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


def registered_baseline(analysis: Analysis) -> Recording | None:
    """The registered healthy record of the same rig, speed and load, or None; raises what loading it raises.

    None too where the scale of one of the two is missing.
    """
    entry = healthy_baseline(analysis.recording)
    if entry is None:
        return None
    healthy = load_registered(entry.file, RecordingSettings(channel=analysis.recording.channel))
    return None if healthy.scale_missing or analysis.recording.scale_missing else healthy


def load_healthy(path: str, settings: RecordingSettings, scale: float | None = None) -> Recording:
    """A healthy record by its file, with the settings of the record that is compared with it.

    Its own speed, state and loads count; the `settings`' speed only where it states none. Another gain belongs to
    another file: its `scale` is given, or it is registered with one, and its registered unit and sensitivity count.
    `ConfigurationError` where it is declared faulty, or a scale is given for the other record alone.
    """
    own = registered_settings(path)
    if settings.scale is not None and scale is None and own.scale is None:
        raise ConfigurationError(
            f"--scale {settings.scale:g} is that of the record; state that of {path} too: --healthy-scale F, "
            "or register it with `srbval data add FILE --scale F`."
        )
    kept = dataclasses.replace(settings, state=None, radial_kn=None, axial_kn=None, scale=scale)
    kept = dataclasses.replace(kept, **{name: None for name in ("unit", "sensitivity_mv_per_g") if getattr(own, name)})
    healthy = load_registered(path, dataclasses.replace(kept, rpm=None, rpm_tolerance_pct=None))
    if healthy.speed is None and settings.rpm is not None:
        healthy = load_registered(path, kept)
    if healthy.state not in (None, Fault.HEALTHY):
        raise ConfigurationError(
            f"{path}: declared {healthy.state.label}, so it is no healthy record; give one of a healthy bearing, or "
            "none."
        )
    return healthy


def baseline_of(analysis: Analysis, healthy: Recording) -> Baseline:
    """`healthy` in the band and with the filter of `analysis`; raises what `analyse` raises.

    `ConfigurationError` where it is the very record that `analysis` was made of, `DataError` where a scale is missing.
    """
    ours, processed = analysis.recording, analysis.processed
    if healthy.sha256 is not None and healthy.sha256 == ours.sha256:
        raise ConfigurationError(f"{healthy.name}: the healthy record is the record itself; give another, or none.")
    if unscaled := [record.file or record.name for record in (ours, healthy) if record.scale_missing]:
        raise DataError(
            f"{' and '.join(unscaled)}: whole numbers of a converter without a scale: levels cannot be compared. "
            "State what full scale (or 1) is in the unit given: --scale F for the record, --healthy-scale F for the "
            "healthy one. With --unit unknown only shares of the mean are compared."
        )
    found = analyse(healthy, bearing=analysis.bearing, band_hz=processed.band_hz, band_filter=processed.band_filter)
    rpm, wanted_rpm = 60 * found.speed.value_hz, 60 * analysis.speed.value_hz
    loads = (
        (f"{kind} load", there / N_PER_KN, here / N_PER_KN)
        for kind, there, here in (("radial", healthy.radial_n, ours.radial_n), ("axial", healthy.axial_n, ours.axial_n))
        if there is not None and here is not None
    )
    conditions = []
    if not _same(rpm, wanted_rpm):
        conditions.append(f"{rpm:.0f} rpm instead of {wanted_rpm:.0f} rpm")
    conditions += [f"{what} {a:.4g} kN instead of {b:.4g} kN" for what, a, b in loads if not _same(a, b)]
    remarks = (
        (
            None in (healthy.radial_n, ours.radial_n),
            "the load is not stated for both records: it is taken to be the same",
        ),
        (healthy.channel != ours.channel, f"another channel, {healthy.channel} instead of {ours.channel}"),
        (
            healthy.fs_hz != ours.fs_hz,
            f"sampled at {healthy.fs_hz:g} Hz instead of {ours.fs_hz:g} Hz; the same band was used",
        ),
        (
            not healthy.unit == ours.unit == "m/s2",
            "not both in m/s2: lines are compared as shares of the mean, not as levels",
        ),
        (healthy.state is None, "declared healthy by the user alone"),
    )
    said = tuple(text for holds, text in remarks if holds)
    return Baseline(analysis=found, conditions=tuple(conditions), remarks=said)


def _same(one: float, other: float) -> bool:
    return abs(one - other) <= SAME_SHARE * max(abs(one), abs(other))


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
        points = f"The {like_fault.name} line points to {part} fault, but no" if like_fault else "No"
        sentence = (
            f"{points} healthy record of this rig at the same speed and load is registered: "
            "a line alone cannot tell a fault from the healthy bearing's own lines."
        )
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


def _compared(
    analysis: Analysis, lines: list[Line], baseline: Analysis, conditions: tuple[str, ...]
) -> BaselineComparison:
    def short(ratio: float) -> str:
        """Three digits, never with an exponent a reader has to work out."""
        return f"{float(f'{ratio:.3g}'):,g}"

    name = baseline.recording.name
    if conditions:
        name += f" ({', '.join(conditions)}: comparable within a factor of {OTHER_CONDITIONS:g} only)"
    ratios = [(x, *r) for x in lines if (r := _ratio(analysis, x, baseline, bool(conditions)))]
    risen = [(x, ratio, ci95) for x, ratio, ci95 in ratios if ratio >= CALLING_RATIO and ci95[0] > 1]
    said = f"Compared with the healthy record {name}, "
    if not risen:
        said += f"no line is {CALLING_RATIO:g} times as high or more: no fault is called."
        return BaselineComparison(basis=Basis.BASELINE, sentence=said, baseline=baseline.recording.file)
    line, ratio, ci95 = risen[0]
    state, part = _part(line)
    others = [f"{x.name} {short(r)} times" for x, r, _ in risen[1:]]
    also = f" (also higher, less deep: {', '.join(others)})" if others else ""
    said += (
        f"the {line.name} line is {short(ratio)} times as high (95 %: {short(ci95[0])} to {short(ci95[1])}): "
        f"{part.split()[1]} fault{also}."
    )
    return BaselineComparison(
        basis=Basis.BASELINE, sentence=said, indicated=state, called=state, line=line.name, ratio=ratio,
        ratio_ci95=ci95, baseline=baseline.recording.file,
    )  # fmt: skip


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


def on_background(run: Recording, healthy: Recording, *, seed: int = 0) -> Recording:
    """The run with the spectrum of a `healthy` record under it, whose phases are random.

    Depth of modulation, kurtosis and signal-to-noise ratio compare with a measured record's only so. An increment over
    a healthy record must never be taken of it: the background is that record. Raises `ConfigurationError` for what is
    not simulated or not measured, and where rate, unit or length do not fit.
    """
    if run.origin is not Origin.SIMULATED or healthy.origin is not Origin.MEASURED:
        raise ConfigurationError(
            f"a background under {run.name}: it takes a simulated run and a measured record; these are "
            f"{run.origin.value} and {healthy.origin.value}."
        )
    for what, ours, theirs in (("sampled at", run.fs_hz, healthy.fs_hz), ("in", run.unit, healthy.unit)):
        if ours != theirs:
            raise ConfigurationError(
                f"background {healthy.name}: {what} {theirs}, the run {what} {ours}; both must be alike."
            )
    if healthy.samples < run.samples:
        raise ConfigurationError(
            f"background {healthy.name}: {healthy.seconds:.4g} s; it must last as long as the run, "
            f"{run.seconds:.4g} s: simulate a shorter run (--seconds)."
        )
    note = f"measured background: spectrum of {healthy.name}, phases random (seed {seed}); no increment is to be taken"
    cautions = run.cautions
    if run.speed and healthy.speed and abs(healthy.speed.value_hz / run.speed.value_hz - 1) > SAME_SHARE:
        cautions += (f"background at {healthy.speed.value_hz:.4g} Hz of the shaft, run at {run.speed.value_hz:.4g} Hz",)
    both = one_signal(run) + phase_randomised(one_signal(healthy)[: run.samples], seed)
    return dataclasses.replace(
        run, channels={SENSOR: both}, channel=SENSOR, axes=None, name=f"{run.name}, on a measured background",
        notes=(*run.notes, note), cautions=cautions,
    )  # fmt: skip
