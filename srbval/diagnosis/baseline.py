"""Comparison of a record with a healthy record of the same machine."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from srbval.bearing import Fault
from srbval.diagnosis.long_records import analyse_by_parts
from srbval.errors import ConfigurationError, DataError
from srbval.reading.analyse import Analysis
from srbval.reading.lines import Line, NotDetected, detected_fault_lines
from srbval.reading.pipeline import one_signal
from srbval.recordings import Recording, RecordingSettings
from srbval.recordings.reading import N_PER_KN
from srbval.recordings.registry import RecordSource, healthy_baseline, recording_of, registered_settings
from srbval.scene.parts import STANDARD_GRAVITY_M_S2
from srbval.signal import LEAST_SNR, NORMAL_95, power_density

SAME_SHARE = 0.03  # largest difference of speeds and loads of one operating point: a motor slips under load
COMPARED_SAMPLES = 2**22  # largest number of samples of two records that are compared with each other
# The units of two records are compared by this quantile of the ratio of their spectra, which a fault does not change.
UNIT_TOLERANCE, QUIET_QUANTILE, SEGMENT_SAMPLES = 0.1, 0.25, 1024
RISEN_RATIO = 2.0  # from which a line has risen, if the 95 % interval excludes one: 6 dB, the usual alarm step


@dataclass(frozen=True, kw_only=True, eq=False)
class Baseline:
    """Healthy record, analysed in the band of the record that is compared with it.

    `conditions` lists differences in speed or load that make the records incomparable, `remarks` all other differences.
    `fault` is the headline of the healthy record's own verdict if that verdict names a fault, otherwise empty.
    """

    analysis: Analysis
    conditions: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    fault: str = ""


@dataclass(frozen=True, kw_only=True)
class BaselineComparison:
    """Comparison of the fault lines of a record with the same lines of a healthy record.

    `ratios` maps the name of a line to its modulation in this record divided by its value in a healthy one, and to
    the 95 % interval of this ratio. The modulation is the line's amplitude in the squared envelope: in (m/s2)^2 if both
    records are single channels in m/s2 (`by_level`), otherwise as a share of the squared envelope's mean. A line has
    risen if its ratio is at least `RISEN_RATIO` and the interval is above 1. `line` is the name of the risen line with
    the greatest modulation depth, None if no line has risen. `baseline` is the file of the healthy record.
    """

    sentence: str = ""
    ratios: Mapping[str, tuple[float, tuple[float, float]]] = field(default_factory=dict)
    line: str | None = None
    baseline: str | None = None
    by_level: bool = True

    def times(self, ratio: float) -> str:
        """Ratio in words, such as "2.1 times as high" for levels or "2.1 times as deep" for modulation depths."""
        return f"{_three_digits(ratio)} times as {'high' if self.by_level else 'deep'}"


NO_HEALTHY = BaselineComparison(sentence="There is no healthy record of the same machine, speed and load to compare.")


def registered_baseline(analysis: Analysis) -> Recording | None:
    """Load a healthy record of the same machine, speed and load from the register of recordings; None if none fits."""
    entry = healthy_baseline(analysis.recording)
    if entry is None:
        return None
    healthy = recording_of(entry.file, RecordingSettings(channel=analysis.recording.channel))
    missing = healthy.scale_missing or analysis.recording.scale_missing
    return None if missing or _is_same_signal(healthy, analysis.recording) else healthy


def _is_same_signal(one: Recording, other: Recording) -> bool:
    """True if two records contain the same signal, apart from rounding to single precision."""
    if one.sha256 is not None and one.sha256 == other.sha256:
        return True
    (a, b), same = (one_signal(x.part(0, COMPARED_SAMPLES)) for x in (one, other)), one.samples == other.samples
    return same and a.size == b.size and bool(np.allclose(a, b, rtol=0, atol=1e-6 * float(np.abs(a).max())))


def load_healthy(path: RecordSource, settings: RecordingSettings, scale: float | None = None) -> Recording:
    """Load a healthy record with the `settings` that the user stated for the record compared with it.

    Bearing state and loads in `settings` are ignored. Their speed is used if the healthy file has no speed, their unit
    and sensitivity if the healthy file is registered without them. `scale` is the value of the number 1 in the healthy
    file, in the unit of the healthy file (default: the registered scale). Raises `ConfigurationError` if the healthy
    file is declared faulty, or if `settings` contains a scale but neither `scale` nor a registered scale is given.
    """
    if not isinstance(path, str | Path):
        return recording_of(path)
    own = registered_settings(path)
    if settings.scale is not None and scale is None and own.scale is None:
        raise ConfigurationError(
            f"--scale {settings.scale:g} does not apply to the healthy record {path}. State its scale with "
            "--healthy-scale F, or register it: `srbval data add FILE --scale F`."
        )
    ignored = ["state", "radial_kn", "axial_kn", "cage_channel", "shaft_channel"]
    ignored += [name for name in ("unit", "sensitivity_mv_per_g") if getattr(own, name)]
    kept = replace(settings, **dict.fromkeys(ignored), scale=scale)
    healthy = recording_of(path, replace(kept, rpm=None, rpm_tolerance_pct=None))
    if healthy.speed is None and settings.rpm is not None:
        healthy = recording_of(path, kept)
    if healthy.state not in (None, Fault.HEALTHY):
        raise ConfigurationError(
            f"{path}: declared {healthy.state.label}, not healthy; give a record of a healthy bearing, or leave "
            "--healthy out."
        )
    return healthy


def baseline_of(analysis: Analysis, healthy: RecordSource) -> Baseline:
    """Analyse the healthy record in the band of `analysis`, and list how the two records differ.

    Raises an error if they cannot be compared, for example if they are the same record.
    """
    ours, processed, healthy = analysis.recording, analysis.processed, recording_of(healthy)
    if _is_same_signal(healthy, ours):
        raise ConfigurationError(
            f"{healthy.name}: the healthy record and the record are the same; give another, or leave --healthy out."
        )
    if processed.band_hz[1] >= healthy.fs_hz / 2:
        raise ConfigurationError(
            f"{healthy.name}: sampled at {healthy.fs_hz:g} Hz, the healthy record has no frequencies up to "
            f"{processed.band_hz[1]:g} Hz, the end of the band; give a band that both records contain (--band LO HI), "
            "or leave --healthy out."
        )
    if unscaled := [record.file or record.name for record in (ours, healthy) if record.scale_missing]:
        raise DataError(
            f"{' and '.join(unscaled)}: samples are counts of an analogue-digital converter without a scale, so levels "
            "cannot be compared. State the value of one count (WAV files: of full scale) in the unit of --unit (or, "
            "without --unit, in the file's unit): --scale F for the record, --healthy-scale F for the healthy record. "
            "Or state --unit unknown: then only modulation depths are compared."
        )
    found = analyse_by_parts(healthy, analysis.bearing, band_hz=processed.band_hz)
    compared = (
        ("{:.0f} rpm instead of {:.0f} rpm", 60 * found.speed.value_hz, 60 * analysis.speed.value_hz, 1.0),
        ("radial load {:.4g} kN instead of {:.4g} kN", healthy.radial_n, ours.radial_n, N_PER_KN),
        ("axial load {:.4g} kN instead of {:.4g} kN", healthy.axial_n, ours.axial_n, N_PER_KN),
    )
    conditions = [
        said.format(there / unit, here / unit)
        for said, there, here, unit in compared
        if there is not None and here is not None and not math.isclose(there, here, rel_tol=SAME_SHARE)
    ]
    remarks = []
    if None in (healthy.radial_n, ours.radial_n):
        remarks.append("the load is not stated for both records: it is assumed to be the same")
    if healthy.channel != ours.channel:
        remarks.append(f"another channel, {healthy.channel} instead of {ours.channel}")
    if healthy.fs_hz != ours.fs_hz:
        remarks.append(f"sampled at {healthy.fs_hz:g} Hz instead of {ours.fs_hz:g} Hz; the same band was used")
    if not _comparable_by_level(found, analysis):
        remarks.append("not both a single channel in m/s2: lines are compared as shares of the mean, not as levels")
    if healthy.state is None:
        remarks.append("declared healthy by the user alone")
    return Baseline(analysis=found, conditions=tuple(conditions), remarks=tuple(remarks))


def require_one_unit(ours: Recording, healthy: Recording) -> None:
    """Raise `ConfigurationError` if the noise of one record is about 9.81 times the other's: probably one is in g."""
    noted = {note.split()[0] for one in (ours, healthy) for note in one.notes if note.endswith("given by the user")}
    long_enough = min(ours.samples, healthy.samples) >= SEGMENT_SAMPLES
    if "unit" not in noted or "scale" in noted or not long_enough or ours.fs_hz != healthy.fs_hz:
        return
    signals = (one_signal(one.part(0, COMPARED_SAMPLES)) for one in (ours, healthy))
    here, there = (power_density(signal, ours.fs_hz, SEGMENT_SAMPLES / ours.fs_hz)[1][2:] for signal in signals)
    ratio = float(np.quantile(np.sqrt(here / np.maximum(there, np.finfo(float).tiny)), QUIET_QUANTILE))
    if ratio > 0 and abs(max(ratio, 1 / ratio) / STANDARD_GRAVITY_M_S2 - 1) < UNIT_TOLERANCE:
        raise ConfigurationError(
            f"{healthy.name}: the background of the record is {ratio:.3g} times the healthy record's, about the ratio "
            "of g to m/s2: probably one record is in g and the other in m/s2, while --unit applies to both. State the "
            f"healthy record's unit: `srbval data add FILE --unit U`, or --healthy-scale {ratio:.4g}."
        )


def compare_with_baseline(analysis: Analysis, baseline: Baseline | Analysis | None = None) -> BaselineComparison:
    """Compare the fault lines of `analysis` with a healthy record; `ValueError` if their envelope bands differ.

    No line is compared without a `baseline`, or if the healthy record has a fault, another speed or another load.
    """
    if baseline is None:
        return NO_HEALTHY
    given = baseline if isinstance(baseline, Baseline) else Baseline(analysis=baseline)
    healthy, name = given.analysis, given.analysis.recording.name
    if given.fault:
        return BaselineComparison(sentence=f"The healthy record {name} has a fault: nothing is compared with it.")
    if healthy.processed.band_hz != analysis.processed.band_hz:
        raise ValueError(f"analyse the healthy record {name} in the record's band, {analysis.processed.band_hz} Hz.")
    if given.conditions:
        return BaselineComparison(
            sentence=f"The healthy record {name} was taken at {', '.join(given.conditions)}: levels at different "
            "speeds or loads are not comparable, so it neither proves nor excludes a fault."
        )
    lines = [x for x in analysis.lines if x.is_first and (x.detected or x.stands_out)]
    ratios = {x.name: found for x in lines if (found := _modulation_ratio(analysis, x, healthy))}
    above = {name for name, (ratio, ci95) in ratios.items() if ratio >= RISEN_RATIO and ci95[0] > 1}
    risen = [x for x in detected_fault_lines(lines) if x.name in above]
    by_level = _comparable_by_level(analysis, healthy)
    compared = BaselineComparison(ratios=ratios, baseline=healthy.recording.file, by_level=by_level)
    said = f"Compared with the healthy record {name},"
    if not risen:
        return replace(compared, sentence=f"{said} no line is {compared.times(RISEN_RATIO)} or more.")
    first, *others = risen
    ratio, (low, high) = ratios[first.name]
    also = "; also risen, less deep: " if others else ""
    also += ", ".join(f"{x.name} {_three_digits(ratios[x.name][0])} times" for x in others)
    interval = f"(95 %: {_three_digits(low)} to {_three_digits(high)})"
    sentence = f"{said} the {first.name} line is {compared.times(ratio)} {interval}{also}."
    return replace(compared, line=first.name, sentence=sentence)


def _comparable_by_level(one: Analysis, other: Analysis) -> bool:
    """True if both records are single channels in m/s2; False, for example, if a run has two axes."""
    return all(x.recording.unit == "m/s2" and x.recording.channel is not None for x in (one, other))


def _three_digits(ratio: float) -> str:
    return f"{float(f'{ratio:.3g}'):,g}"


def _modulation_ratio(analysis: Analysis, line: Line, baseline: Analysis) -> tuple[float, tuple[float, float]] | None:
    """Modulation of `line` divided by its value in `baseline`, with 95 % interval; None if the divisor is unknown."""
    by_level = _comparable_by_level(analysis, baseline)
    before = baseline.line(line.name)
    if before.explained_by == NotDetected.ANOTHER and before.snr and before.depth is not None:
        not_detected = min(1.0, math.sqrt(LEAST_SNR / before.snr))  # the highest level that is not detected
        before = replace(before, depth=not_detected * before.depth, snr=min(before.snr, LEAST_SNR))
    ours, theirs = (
        (read.depth or 0.0) * (float(np.mean(of.processed.squared)) * of.processed.scale**2 if by_level else 1.0)
        for of, read in ((analysis, line), (baseline, before))
    )
    if not theirs or (before.covered and ours / theirs < RISEN_RATIO):  # the covering line is only an upper bound
        return None
    ratio, noise = ours / theirs, NORMAL_95 * math.sqrt(sum(0.5 / max(x.snr or 0.0, 0.5) for x in (line, before)))
    return ratio, (ratio * math.exp(-noise), ratio * math.exp(noise))
