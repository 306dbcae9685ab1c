"""Analysis of records from file to verdict: one file, many in parallel with stored results, a table of features."""

import json
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from srbval.bearing import DEFECTS, Bearing, load_bearing
from srbval.diagnosis import fault_posterior as posterior
from srbval.diagnosis.baseline import (
    NO_HEALTHY,
    Baseline,
    baseline_of,
    load_healthy,
    registered_baseline,
    require_one_unit,
)
from srbval.diagnosis.fault_verdict import FaultVerdict, Finding, fault_verdict
from srbval.diagnosis.long_records import analyse_by_parts
from srbval.errors import ConfigurationError, DataError, NoRecordingError, SrbvalError
from srbval.processes.worker import in_processes
from srbval.progress import Progress, silent
from srbval.reading.analyse import Analysis, ShortRecordError, bearing_of
from srbval.reading.features import features_of, read_short
from srbval.reading.pipeline import LEAST_REVOLUTIONS, declared_band
from srbval.recordings import Recording, RecordingSettings
from srbval.recordings.load import open_channels, questions_error, subject_of
from srbval.recordings.registry import (
    RecordSource,
    files_of,
    listing,
    load_registered,
    recording_of,
    registered_settings,
)
from srbval.recordings.settings import BEARING_QUESTION, SPEED_QUESTION, settings_of
from srbval.recordings.speed import RPM_PER_HZ
from srbval.recordings.units import ACCELERATION_UNIT, UNKNOWN
from srbval.scene.parts import STANDARD_GRAVITY_M_S2
from srbval.storage.content_store import ContentStore
from srbval.storage.files import file_sha256
from srbval.storage.json_files import to_json

if TYPE_CHECKING:
    import pandas

MIN_POOLED_TURNS = 2.0  # turns of a record that is pooled with others, for its noise to be read between the lines
SUMMARY_FEATURES = ("unit", "rms", "peak", "crest", "kurtosis", "velocity_rms_mm_s")
LEVEL_FEATURES = ("rms", "peak", "band_rms")  # of a row of features, in the unit of the record
STORE = ContentStore(kind="record", computed_by="srbval.diagnosis.records")
ALARMS = {Finding.NAMED: "yes", Finding.UNDECIDED: "check", Finding.NOTHING_FOUND: "no", None: "-"}  # worst first


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


@dataclass(frozen=True, kw_only=True)
class FailedFile:
    """File that could not be read or analysed, with its error."""

    file: str
    error: SrbvalError

    def to_dict(self) -> dict[str, str]:
        """Entry for the failed file in JSON documents."""
        return {"file": self.file, "reason": str(self.error)}


def build_request(asked: Mapping[str, Any]) -> RecordRequest:
    """Build a request from keyword arguments: fields of `RecordRequest` and of `RecordingSettings`."""
    own = {field.name for field in fields(RecordRequest)}
    of_request = {key: value for key, value in asked.items() if key in own}
    return RecordRequest(settings=settings_of({k: v for k, v in asked.items() if k not in own}), **of_request)


def requests_for(sources: Iterable[RecordSource], request: RecordRequest) -> list[RecordRequest]:
    """Return a copy of `request` for each file, recording and run, in their order; a folder stands for its files."""
    requests = []
    for source in sources:
        if isinstance(source, str | Path):
            requests += [replace(request, file=file) for file in files_of(source)]
        else:
            requests.append(replace(request, recording=recording_of(source, request.settings)))
    return requests


def read_record(request: RecordRequest) -> RecordReading:
    """Load and analyse a record, compare it with the given or registered healthy record, and compute the verdict.

    If no channel is stated, all channels contribute to the verdict. Raises the errors of all steps.
    """
    stored, all_channels = registered_settings(request.file), request.settings.channel is None
    request = replace(request, auto_band=request.auto_band or bool(stored.auto_band and request.band_hz is None))
    recording, bearing = _loaded(request)
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


def read_records(
    requests: Sequence[RecordRequest], *, jobs: int | None = None, progress: Progress = silent
) -> tuple[list[dict[str, Any]], list[FailedFile]]:
    """Analyse many files; returns their JSON documents, the most serious verdict first, and the failed files."""

    def seriousness(document: dict[str, Any]) -> tuple[float, ...]:
        shares, line = document["fault"]["probabilities"], _highest_line(document)
        share = max((shares.get(part.value) or 0.0 for part in DEFECTS), default=0.0)
        verdict = list(ALARMS).index(document["fault"]["verdict"])
        return verdict, -round(100 * share), -line["snr"] if line else 0.0

    answers = answers_of(requests, jobs=jobs, progress=progress).values()
    read = sorted((one for answer in answers if isinstance(answer, list) for one in answer), key=seriousness)
    return read, [answer for answer in answers if isinstance(answer, FailedFile)]


def answers_of(
    requests: Sequence[RecordRequest], *, jobs: int | None = None, progress: Progress = silent
) -> dict[RecordRequest, list[dict[str, Any]] | FailedFile]:
    """Analyse many files, `jobs` at a time (default: one per core); returns each file's JSON documents or its failure.

    A file without a stated channel has one document per channel. Raises an error if all files fail.
    """
    register = repr(listing().recordings)
    contents = {request: _dependencies(request, register) for request in requests}
    answers: dict[RecordRequest, list[dict[str, Any]] | FailedFile] = {
        request: found for request, content in contents.items() if content and (found := STORE.load(content, list))
    }
    task = f"Analyse {len(requests)} files"
    progress(task, len(answers) / max(1, len(requests)))
    for request, answer in in_processes(_read_channels, [one for one in contents if one not in answers], jobs=jobs):
        answers[request] = answer
        if isinstance(answer, list):
            STORE.save(contents[request], answer)
        progress(task, len(answers) / len(requests))
    failed = [answer for answer in answers.values() if isinstance(answer, FailedFile)]
    if failed and len(failed) == len(answers):
        raise common_error(failed)
    return answers


def _highest_line(document: dict[str, Any]) -> dict[str, Any] | None:
    """Detected line of the part named by the verdict, otherwise the highest detected line; None if there is none."""
    called = next((part.line for part in DEFECTS if part.value == document["fault"]["called"]), None)
    found = [line for line in document["lines"] if line["harmonic"] == 1 and line["detected"]]
    return max(found, key=lambda line: (line["name"] == called, line["snr"]), default=None)


def common_error(failed: Sequence[FailedFile]) -> SrbvalError:
    """Error that all failed files have in common, otherwise one error that lists the errors of all files."""
    first, *others = {str(one.error).replace(one.file, ""): one.error for one in failed}.values()
    if not others:
        return first
    return DataError("none of the recordings can be analysed: " + "; ".join(f"{o.file}: {o.error}" for o in failed))


def separate_other_files(
    failed: Sequence[FailedFile], named: Collection[str], read: Sequence[dict[str, Any]]
) -> tuple[list[FailedFile], list[str]]:
    """Separate failed recordings from other files of a folder, such as a licence beside the recordings.

    A failed file is one of the other files if it is in no format for recordings, if the user did not name it (`named`),
    and if no recording that was `read` has the same file suffix.
    """
    endings = {Path(one["file"]).suffix for one in read if one["file"]}
    other = [
        one.file
        for one in failed
        if isinstance(one.error, NoRecordingError) and one.file not in named and Path(one.file).suffix not in endings
    ]
    return [one for one in failed if one.file not in other], other


def feature_table(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Table of the features that `features_of` computes, with name, value and unit; accelerations also in g."""
    scales = {found["unit"]: 1.0} | ({"g": 1 / STANDARD_GRAVITY_M_S2} if found["unit"] == ACCELERATION_UNIT else {})
    levels = {"RMS": found["rms"], "peak": found["peak"], "RMS in the band": found["band_rms"]}
    rows = [(name, value * scale, unit) for name, value in levels.items() for unit, scale in scales.items()]
    rows += [("crest factor", found["crest"], ""), ("kurtosis", found["kurtosis"], "")]
    velocity = "velocity RMS, {:g} to {:g} Hz".format(*found["velocity_band_hz"])
    rows.append((velocity, found["velocity_rms_mm_s"], "mm/s"))
    return [{"feature": name, "value": value, "unit": unit} for name, value, unit in rows]


def summary_of(document: dict[str, Any]) -> dict[str, Any]:
    """Table row of an analysis: verdict, most probable fault (None if nothing is found), clearest line, features."""
    fault = document["fault"]
    shares = {part.label: fault["probabilities"].get(part.value) for part in DEFECTS}
    part = max(shares, key=lambda one: shares[one] or 0.0)
    called = next((one.label for one in DEFECTS if one.value == fault["called"]), None)
    line = _highest_line(document) or dict.fromkeys(("name", "found_hz", "snr"))
    is_open = shares[part] and fault["verdict"] != Finding.NOTHING_FOUND
    return {
        **{key: document[key] for key in ("file", "name", "channel")},
        "state": f"{called} fault" if called else fault["verdict"] or document["origin"],
        "strongest_fault": part if is_open else None,
        "probability": shares[part] if is_open else None,
        "line": line["name"],
        "found_hz": line["found_hz"],
        "snr": line["snr"],
        "alarm": ALARMS[fault["verdict"]],
        **{name: document["features"][name] for name in SUMMARY_FEATURES},
    }


def machine_of(documents: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Compute one verdict from all records of a bearing; leave out records whose lines contradict the stated speed."""
    if len(names := sorted({document["bearing"] for document in documents})) > 1:
        raise ConfigurationError(
            f"--one-machine: the records are of {len(names)} bearings, {' and '.join(names)}; give records of one "
            "bearing, or state it with --bearing."
        )
    faults = [one["fault"] for one in documents if one["fault"]["log_likelihood"] and not one["shaft_hz"]["outside"]]
    if not faults:
        said = "One machine: no measured record can be used."
        return {"records": 0, "state": None, "called": None, "probabilities": {}, "sentence": said}
    together = posterior.of_one_machine([fault["log_likelihood"] for fault in faults])
    return {"records": len(faults)} | _of_machine(together, f"{len(faults)} records together")


def diagnose_pooled(requests: Sequence[RecordRequest]) -> dict[str, Any]:
    """One verdict from the mean spectrum of a bearing's short records; `DataError` for too few shaft revolutions."""
    found = [read_short(*_loaded(request)) for request in requests]
    own = [one.processed.seconds * one.speed.value_hz for one in found]
    if (few := min(own)) < MIN_POOLED_TURNS:
        name = found[own.index(few)].recording.name
        raise DataError(f"{name}: {few:.2g} shaft turns; --one-machine needs {MIN_POOLED_TURNS:g} in each record.")
    if len({one.bearing.name for one in found}) > 1 or len({one.processed.fs_hz for one in found}) > 1:
        raise ConfigurationError(
            "--one-machine: the records differ in bearing or sampling rate; give records that agree in both."
        )
    if (turns := sum(own)) < LEAST_REVOLUTIONS:
        raise DataError(
            f"{len(found)} records have {turns:.3g} turns of the shaft in all; {LEAST_REVOLUTIONS} or more are needed."
        )
    scores = posterior.fault_scores(found[0], found[1:])
    together = posterior.log_likelihood([scores], {}, stands=False)
    how = f"{len(found)} short records, {turns:.0f} turns in all, by their mean spectrum"
    return {"records": len(found)} | _of_machine(together, how)


def _of_machine(together: Mapping[str, float], how: str) -> dict[str, Any]:
    """Verdict on a machine from `together`, one log likelihood ratio per state; `how` is the method in words."""
    shares = posterior.probabilities(together)
    state = posterior.decide(shares)
    parts, best = posterior.faults_of(state), max(shares, key=shares.__getitem__)
    answer = state if state == posterior.UNDECIDED else posterior.LABELS[state]
    answer += " fault" if parts else ", no fault named" if state != posterior.UNDECIDED else ""
    share = f"{posterior.LABELS[best]} {100 * posterior.share_of(best, shares):.0f} %"
    return {
        "state": state,
        "called": parts[0] if parts else None,
        "parts_called": parts,
        "probabilities": shares,
        "log_likelihood": together,
        "sentence": f"One machine: {answer} ({share} by {how}).",
    }


def record_features(
    sources: RecordSource | Iterable[RecordSource],
    request: RecordRequest | None = None,
    *,
    jobs: int | None = None,
    progress: Progress = silent,
    **stated: Any,
) -> "pandas.DataFrame":
    """Compute a table of features with a row for each channel of each record; columns as in `feature_row`.

    `sources` are files, folders, recordings or runs. `stated` are fields of `RecordRequest` or `RecordingSettings`,
    such as `bearing`, `rpm`, `channel` or `band_hz`; a `request` replaces them. All records use the stated band, the
    band of their data set, or the whole band; with `auto_band` each record has its own band. A record that cannot be
    read has a row with the `reason` alone; if no record can be read, an error is raised.
    """
    import pandas

    given = [sources] if isinstance(sources, RecordSource) else list(sources)
    asked = request or build_request(stated)
    requests = requests_for(given, replace(asked, one_band=not asked.auto_band))
    answers = answers_of(requests, jobs=jobs, progress=progress)
    failed = [answer for answer in answers.values() if isinstance(answer, FailedFile)]
    read = [document for answer in answers.values() if isinstance(answer, list) for document in answer]
    shown, _ = separate_other_files(failed, [str(source) for source in given], read)
    rows: list[Mapping[str, Any]] = []
    for answer in (answers[one] for one in requests):
        if isinstance(answer, list):
            rows += map(feature_row, answer)
        elif answer in shown:
            rows.append({"file": answer.file, "reason": str(answer.error).removeprefix(f"{answer.file}: ")})
    rows = json.loads(json.dumps(rows, ensure_ascii=False).encode("utf-8", "replace"))  # names that no text can have
    return pandas.DataFrame(rows, columns=list(dict.fromkeys(k for row in sorted(rows, key=len)[::-1] for k in row)))


def feature_row(document: Mapping[str, Any]) -> dict[str, Any]:
    """Convert an analysis document to a row of the feature table; the column `reason` explains missing values."""
    found, (low_hz, high_hz) = document["features"], document["band_hz"]
    unit, missing = found["unit"], [found["velocity_missing"]]
    if unit != ACCELERATION_UNIT:
        missing.append(f"no levels in {ACCELERATION_UNIT}: the unit is {unit}")
    row = {key: document[key] for key in ("file", "name", "channel", "bearing", "fs_hz", "seconds")}
    row |= {"state": document["declared_state"], "speed_rpm": RPM_PER_HZ * document["shaft_hz"]["value"]}
    row |= {"band_low_hz": low_hz, "band_high_hz": high_hz}
    for kind in (ACCELERATION_UNIT, unit):
        word = re.sub(r"\W", "_", kind) if kind != UNKNOWN else "unknown_unit"
        row |= {f"{name}_{word}": found[name] if kind == unit else None for name in LEVEL_FEATURES}
    row |= {"crest_factor": found["crest"]} | {key: found[key] for key in ("kurtosis", "velocity_rms_mm_s")}
    for line in document["lines"]:
        name = line["name"].lower().replace("-", "_minus_").replace("+", "_plus_")  # of sidebands, as BPFI-fr
        row |= {f"{name}_harmonic_{line['harmonic']}_{key}": line[key] for key in ("snr", "depth")}
        if line["snr"] is None:
            missing.append(f"{line['harmonic']} x {line['name']}: {line['not_detected']}")
    if document.get("snapshot"):
        missing.append("too short to search for lines: first harmonics at their calculated place")
    return row | {"reason": "; ".join(filter(None, missing))}


def _read_channels(request: RecordRequest) -> list[dict[str, Any]] | FailedFile:
    """Analyse a file; returns one JSON document for each channel, or for the stated channel, or the failure."""
    try:
        settings = registered_settings(request.file, request.settings, request.band_hz)
        names = () if request.recording else open_channels(Path(request.file), settings)
        own = [replace(request, settings=replace(request.settings, channel=name)) for name in names] or [request]
        documents: list[dict[str, Any]] = to_json([_reading_or_snapshot(one) for one in own])
    except SrbvalError as error:
        kind = type(error) if isinstance(error, ConfigurationError | NoRecordingError) else DataError
        return FailedFile(file=request.recording.name if request.recording else request.file, error=kind(str(error)))
    return documents


def _reading_or_snapshot(request: RecordRequest) -> RecordReading | dict[str, Any]:
    """Analyse a record; compute only levels if it is too short to search for lines and `one_band` is set."""
    try:
        return read_record(request)
    except ShortRecordError:
        if not request.one_band:
            raise
    recording, bearing = _loaded(request)
    analysis = read_short(recording, bearing, declared_band(recording, request.band_hz, bearing))
    verdict = FaultVerdict(finding=None, headline="The record is too short", reasons=(), comparison=NO_HEALTHY)
    return RecordReading(analysis=analysis, baseline=None, verdict=verdict).to_dict() | {"snapshot": True}


def _loaded(request: RecordRequest) -> tuple[Recording, Bearing]:
    """Load the record of a request, and its bearing; one error names both bearing and speed if neither is known."""
    recording = request.recording or load_registered(request.file, request.settings, request.band_hz)
    if not (recording.bearing or recording.own_bearing or request.bearing or recording.speed):
        subject = subject_of(Path(recording.file)) if recording.file else recording.name
        raise questions_error(ConfigurationError, subject, (BEARING_QUESTION, SPEED_QUESTION))
    return recording, bearing_of(recording, request.bearing, largest_slip_pct=request.largest_slip_pct)


def _dependencies(request: RecordRequest, register: str) -> str:
    """Key under which a reading is stored: all of its inputs as text; empty for a reading that cannot be stored."""
    if request.recording is not None or isinstance(request.healthy, Recording):
        return ""
    try:
        files = [Path(path) for path in (request.file, request.healthy) if path]
        if not all(file.is_file() for file in files):  # opening a pipe would block
            return ""
        hashes = [file_sha256(file) for file in files]
        name = request.bearing or registered_settings(request.file).bearing
        bearing = repr(load_bearing(name)) if name else ""
    except (SrbvalError, OSError):  # OSError: an impossible path
        return ""
    return json.dumps([to_json(request), str(Path(request.file).resolve()), hashes, bearing, register])
