"""Analysis of many files in parallel, with stored results; one verdict from all records of one bearing."""

import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from srbval.bearing import DEFECTS, load_bearing
from srbval.diagnosis import fault_posterior as posterior
from srbval.diagnosis.fault_verdict import FaultVerdict, Finding
from srbval.diagnosis.records import RecordReading, RecordRequest, load_record, read_record
from srbval.errors import ConfigurationError, DataError, NoRecordingError, SrbvalError
from srbval.processes.worker import in_processes
from srbval.progress import Progress, silent
from srbval.reading.analyse import ShortRecordError
from srbval.reading.features import read_short
from srbval.reading.pipeline import LEAST_REVOLUTIONS, declared_band
from srbval.recordings import Recording
from srbval.recordings.load import open_channels
from srbval.recordings.registry import RecordSource, files_of, listing, recording_of, registered_settings
from srbval.storage.content_store import ContentStore
from srbval.storage.files import file_sha256
from srbval.storage.json_files import to_json

SUMMARY_FEATURES = ("unit", "rms", "peak", "crest", "kurtosis", "velocity_rms_mm_s")
STORE = ContentStore(kind="record", computed_by="srbval.monitoring.batch")
ALARMS = {Finding.NAMED: "yes", Finding.UNDECIDED: "check", Finding.NOTHING_FOUND: "no", None: "-"}  # worst first
MIN_POOLED_TURNS = 2.0  # turns of a record that is pooled with others, for its noise to be read between the lines


@dataclass(frozen=True, kw_only=True)
class FailedFile:
    """File that could not be read or analysed, with its error."""

    file: str
    error: SrbvalError

    def to_dict(self) -> dict[str, str]:
        """Entry for the failed file in JSON documents."""
        return {"file": self.file, "reason": str(self.error)}


def requests_for(sources: Iterable[RecordSource], request: RecordRequest) -> list[RecordRequest]:
    """Return a copy of `request` for each file, recording and run, in their order; a folder stands for its files."""
    requests = []
    for source in sources:
        if isinstance(source, str | Path):
            requests += [replace(request, file=file) for file in files_of(source)]
        else:
            requests.append(replace(request, recording=recording_of(source, request.settings)))
    return requests


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
    recording, bearing = load_record(request)
    analysis = read_short(recording, bearing, declared_band(recording, request.band_hz, bearing))
    verdict = FaultVerdict(finding=None, headline="The record is too short", reasons=())
    return RecordReading(analysis=analysis, baseline=None, verdict=verdict).to_dict() | {"snapshot": True}


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
    found = [read_short(*load_record(request)) for request in requests]
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
