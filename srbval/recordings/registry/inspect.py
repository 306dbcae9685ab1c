"""Inspection of one file: hash it, read it, describe its contents and what is wrong with it."""

import stat
from dataclasses import replace
from pathlib import Path

from srbval.errors import DataError, SrbvalError
from srbval.recordings.datasets.description import known_datasets
from srbval.recordings.load import read_file, sha256_of
from srbval.recordings.loaders import detect_format
from srbval.recordings.reading import N_PER_KN
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
        entry = _described(entry, path, settings or RecordingSettings())
    except OSError as error:
        return entry.with_status(FileStatus.UNREADABLE, f"cannot be read ({error.strerror})")
    except SrbvalError as error:
        text = str(error).removeprefix(f"{path}: ")
        cut = "truncated: " in text or "truncated file" in text  # as the loaders and the HDF5 library say it
        return entry.with_status(FileStatus.TRUNCATED if cut else FileStatus.UNREADABLE, text)
    expected = (file for d in known_datasets() if d.name == entry.dataset for file in d.files)
    published = next((file.sha256 for file in expected if file.name == path.name and file.sha256), sha256)
    if published != sha256:
        return entry.with_status(FileStatus.CHANGED, f"its SHA-256 is not the published {published[:12]}...")
    return entry


def _described(entry: RegisteredRecording, path: Path, settings: RecordingSettings) -> RegisteredRecording:
    file, wrong = read_file(path), []
    try:
        reading = apply_settings(path, file, settings)
    except DataError:  # one by one, to keep those that fit
        stated, settings = settings, RecordingSettings()
        for name, value in vars(stated).items():
            try:
                apply_settings(path, file, replace(settings, **{name: value}))
                settings = replace(settings, **{name: value})
            except DataError as error:
                wrong.append(str(error).removeprefix(f"{path}: "))
        reading = apply_settings(path, file, settings)
    if questions := (*open_questions(reading), *open_for_analysis(reading)):
        wrong.append(f"not stated: {'; '.join(questions)}")
    names = tuple(reading.channels)
    main = reading.channels[reading.channel or (reading.axes or names)[0]]
    return replace(
        entry,
        reason="; ".join(wrong) or None,
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
        settings=settings or None,
        cautions=reading.all_cautions(),
    )
