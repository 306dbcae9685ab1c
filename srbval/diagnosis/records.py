"""Analysis of a record from file to verdict."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from srbval.bearing import Bearing
from srbval.diagnosis.baseline import Baseline, baseline_of, load_healthy, registered_baseline, require_one_unit
from srbval.diagnosis.fault_verdict import FaultVerdict, Finding, fault_verdict
from srbval.diagnosis.long_records import analyse_by_parts
from srbval.errors import ConfigurationError, DataError
from srbval.reading.analyse import Analysis, bearing_of
from srbval.reading.features import features_of
from srbval.recordings import Recording, RecordingSettings, load_recording
from srbval.recordings.load import questions_error, subject_of
from srbval.recordings.registry import registered_settings
from srbval.recordings.settings import BEARING_QUESTION, SPEED_QUESTION, settings_of
from srbval.recordings.units import ACCELERATION_UNIT
from srbval.scene.parts import STANDARD_GRAVITY_M_S2


@dataclass(frozen=True, kw_only=True)
class RecordRequest:
    """Request to analyse a `file` or a loaded `recording`; fields as in `analyse`, `bearing_of`, `load_healthy`.

    The band is the one that the request states, else the one that the data set states. If neither states a band, a band
    is chosen from the record, or with `one_band` the whole band is used, so that levels of records can be compared.
    With `auto_band` a band is always chosen from the record.
    """

    file: str = ""
    settings: RecordingSettings = field(default_factory=RecordingSettings)
    bearing: str | None = None
    largest_slip_pct: float | None = None
    band_hz: tuple[float, float] | None = None
    auto_band: bool = False
    one_band: bool = False
    healthy: str | Recording | None = None
    healthy_scale: float | None = None
    recording: Recording | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordReading:
    """Analysis of a record, its healthy baseline and its verdict; `cautions` are warnings about the baseline."""

    analysis: Analysis
    baseline: Baseline | None
    verdict: FaultVerdict
    cautions: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Values printed by ``srbval analyse --json``."""
        recording, verdict = self.analysis.recording, self.verdict
        return self.analysis.to_dict() | {
            "channel": recording.channel,
            "features": (features := features_of(self.analysis)),
            "feature_table": feature_table(features),
            "fault": verdict,
            "verdict": verdict.sentence,
            "answer": verdict.answer,
            "declared_state": recording.state,
        }


def build_request(asked: Mapping[str, Any]) -> RecordRequest:
    """Build a request from keyword arguments: fields of `RecordRequest` and of `RecordingSettings`."""
    own = {field.name for field in fields(RecordRequest)}
    of_request = {key: value for key, value in asked.items() if key in own}
    return RecordRequest(settings=settings_of({k: v for k, v in asked.items() if k not in own}), **of_request)


def read_record(request: RecordRequest) -> RecordReading:
    """Load and analyse a record, compare it with the given or registered healthy record, and compute the verdict.

    If no channel is stated, all channels contribute to the verdict. Raises the errors of all steps.
    """
    stored, all_channels = registered_settings(request.file), request.settings.channel is None
    request = replace(request, auto_band=request.auto_band or bool(stored.auto_band and request.band_hz is None))
    recording, bearing = load_record(request)
    healthy = load_healthy(request.healthy, request.settings, request.healthy_scale) if request.healthy else None
    if overload := bearing.overload(recording.radial_n, recording.axial_n):
        recording = replace(recording, cautions=(*recording.cautions, overload))
    band = {"band_hz": request.band_hz, "auto_band": request.auto_band, "whole_band": request.one_band}
    analysis = analyse_by_parts(recording, bearing, all_channels=all_channels, healthy=healthy, **band)
    baseline, cautions = None, tuple[str, ...]()
    try:
        own = healthy if healthy is not None else registered_baseline(analysis)
    except DataError as unreadable:  # an unreadable register must not hide the file's own verdict
        own, cautions = None, (f"no healthy baseline: {unreadable}",)
    if own is not None:
        if healthy is not None:
            require_one_unit(recording, healthy)
        baseline = baseline_of(analysis, own)
        if healthy is not None and (judged := fault_verdict(baseline.analysis)).finding is Finding.NAMED:
            baseline = replace(baseline, fault=judged.headline)
        faulty = (f"the baseline has a fault ({baseline.fault}): give another",) if baseline.fault else ()
        said = (*faulty, *own.cautions, *(baseline.remarks if healthy is not None else ()))
        cautions = tuple(f"caution: healthy baseline {own.file}: {caution}" for caution in said)
    verdict = fault_verdict(analysis, baseline, all_channels=all_channels)
    return RecordReading(analysis=analysis, baseline=baseline, verdict=verdict, cautions=cautions)


def load_record(request: RecordRequest) -> tuple[Recording, Bearing]:
    """Load the record of a request, and its bearing; one error names both bearing and speed if neither is known."""
    if (recording := request.recording) is None:
        settings = registered_settings(request.file, request.settings, request.band_hz)
        recording = load_recording(request.file, settings)
    if not (recording.bearing or recording.own_bearing or request.bearing or recording.speed):
        subject = subject_of(Path(recording.file)) if recording.file else recording.name
        raise questions_error(ConfigurationError, subject, (BEARING_QUESTION, SPEED_QUESTION))
    return recording, bearing_of(recording, request.bearing, largest_slip_pct=request.largest_slip_pct)


def feature_table(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Table of the features that `features_of` computes, with name, value and unit; accelerations also in g."""
    scales = {found["unit"]: 1.0} | ({"g": 1 / STANDARD_GRAVITY_M_S2} if found["unit"] == ACCELERATION_UNIT else {})
    levels = {"RMS": found["rms"], "peak": found["peak"], "RMS in the band": found["band_rms"]}
    rows = [(name, value * scale, unit) for name, value in levels.items() for unit, scale in scales.items()]
    rows += [("crest factor", found["crest"], ""), ("kurtosis", found["kurtosis"], "")]
    velocity = "velocity RMS, {:g} to {:g} Hz".format(*found["velocity_band_hz"])
    rows.append((velocity, found["velocity_rms_mm_s"], "mm/s"))
    return [{"feature": name, "value": value, "unit": unit} for name, value, unit in rows]
