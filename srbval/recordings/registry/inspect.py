"""Inspection of one file: hash it, read it, describe its contents and what is wrong with it."""

import stat
from dataclasses import replace
from pathlib import Path

from srbval.errors import DataError, SrbvalError
from srbval.recordings.datasets.description import known_datasets
from srbval.recordings.load import read_file, sha256_of
from srbval.recordings.loaders import detect_format
from srbval.recordings.reading import N_PER_KN, Reading
from srbval.recordings.registry.entry import FileStatus, RegisteredRecording
from srbval.recordings.settings import RecordingSettings, apply_settings, open_for_analysis, open_questions
from srbval.recordings.speed import RPM_PER_HZ


def inspect_file(path: Path, settings: RecordingSettings | None = None) -> RegisteredRecording:
    """Hash and read `path`; whatever is wrong becomes a status with a reason.

    `settings` decide what the file leaves open; one that does not fit it, as a channel that is not there, is ignored
    and reported. A file that still leaves something open is ok, with all questions and their options as its reason.
    """
    entry = RegisteredRecording(file=str(path), sha256="", size_bytes=0, mtime_ns=0, status=FileStatus.OK)
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):
            return entry.with_status(FileStatus.UNREADABLE, "not a regular file")
        sha256 = sha256_of(path)
        entry = replace(entry, size_bytes=found.st_size, mtime_ns=found.st_mtime_ns, sha256=sha256)
        entry = replace(entry, format=detect_format(path).name)
        return _against_published(_described(entry, path, read_file(path), settings or RecordingSettings()))
    except OSError as error:
        return entry.with_status(FileStatus.UNREADABLE, f"cannot be read ({error.strerror})")
    except SrbvalError as error:
        return entry.with_status(_status_of(error), str(error).removeprefix(f"{path}: "))


def _described(
    entry: RegisteredRecording, path: Path, reading: Reading, settings: RecordingSettings
) -> RegisteredRecording:
    reading, settings, reasons = _applied(path, reading, settings)
    if questions := (*open_questions(reading), *open_for_analysis(reading)):
        reasons.append(f"not stated: {'; '.join(questions)}")
    names = tuple(reading.channels)
    main = reading.channels[reading.channel or (reading.axes or names)[0]]
    return replace(
        entry,
        reason="; ".join(reasons) or None,
        origin=reading.origin,
        dataset=reading.dataset,
        state=main.state,
        radial_kn=None if reading.radial_n is None else reading.radial_n / N_PER_KN,
        axial_kn=None if reading.axial_n is None else reading.axial_n / N_PER_KN,
        nominal_rpm=reading.nominal_rpm,
        rpm=None if reading.speed is None else reading.speed.value_hz * RPM_PER_HZ,
        bearing=main.bearing,
        fs_hz=reading.fs_hz,
        seconds=None if reading.fs_hz is None else len(main.samples) / reading.fs_hz,
        channels=names,
        channel=reading.channel,
        settings=settings if settings else None,
        cautions=reading.all_cautions(),
    )


def _applied(path: Path, reading: Reading, settings: RecordingSettings) -> tuple[Reading, RecordingSettings, list[str]]:
    """`reading` with those of `settings` that fit it, these, and what is wrong with the others."""
    try:
        return apply_settings(path, reading, settings), settings, []
    except DataError:
        kept, wrong = RecordingSettings(), []
    for name, value in vars(settings).items():
        try:
            apply_settings(path, reading, replace(kept, **{name: value}))
            kept = replace(kept, **{name: value})
        except DataError as error:
            wrong.append(str(error).removeprefix(f"{path}: "))
    return apply_settings(path, reading, kept), kept, wrong


def _against_published(entry: RegisteredRecording) -> RegisteredRecording:
    """A file with the name and data set of a published one must have its hash."""
    for description in known_datasets():
        for expected in description.files if description.name == entry.dataset else ():
            published = expected.name == Path(entry.file).name and expected.sha256
            if published and entry.status is FileStatus.OK and published != entry.sha256:
                return entry.with_status(FileStatus.CHANGED, f"its SHA-256 is not the published {published[:12]}...")
    return entry


def _status_of(error: SrbvalError) -> FileStatus:
    """Truncated where the loader says so, else unreadable."""
    text = str(error)
    cut = "truncated: " in text or ": truncated MATLAB v5 file" in text or "truncated file" in text
    return FileStatus.TRUNCATED if cut else FileStatus.UNREADABLE
