"""Look at one file: hash it, read it, say what it is and what is wrong with it."""

from __future__ import annotations

import stat
from dataclasses import replace
from pathlib import Path

from srbval.errors import DataError, SrbvalError
from srbval.recordings.datasets.description import known_datasets
from srbval.recordings.load import read_and_hash
from srbval.recordings.reading import Reading
from srbval.recordings.registry.entry import RegisteredRecording, Status
from srbval.recordings.settings import Settings, open_questions, settle
from srbval.recordings.sniff import sniff

N_PER_KN = 1e3


def inspect_file(path: Path, settings: Settings | None = None) -> RegisteredRecording:
    """Read and hash `path`; whatever is wrong becomes a status with a reason.

    `settings` settle what the file leaves open; a channel it does not have is left out and said. A file that still
    leaves something open is ok, with the question and the option as its reason.
    """
    entry = RegisteredRecording(file=str(path), sha256="", size_bytes=0, mtime_ns=0, status=Status.OK)
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):
            return entry.with_status(Status.UNREADABLE, "not a regular file")
        reading, sha256 = read_and_hash(path)
        entry = replace(entry, size_bytes=found.st_size, mtime_ns=found.st_mtime_ns, sha256=sha256)
        entry = replace(entry, format=sniff(path).value)
        if isinstance(reading, DataError):
            raise reading
        return _against_published(_settled(entry, path, reading, settings or Settings()))
    except OSError as error:
        return entry.with_status(Status.UNREADABLE, f"cannot be read ({error.strerror})")
    except SrbvalError as error:
        return entry.with_status(_status_of(error), _reason(path, error))


def _settled(entry: RegisteredRecording, path: Path, reading: Reading, settings: Settings) -> RegisteredRecording:
    missing = ""
    try:
        reading = settle(path, reading, settings)
    except DataError as error:
        missing = _reason(path, error)
        settings = replace(settings, channel=None)
        reading = settle(path, reading, settings)
    described = replace(_described(entry, reading), settings=settings if settings else None)
    reasons = [text for text in (missing, described.reason) if text]
    return replace(described, reason="; ".join(reasons) or None)


def _described(entry: RegisteredRecording, reading: Reading) -> RegisteredRecording:
    names = tuple(reading.channels)
    main = reading.channels[reading.channel or (reading.axes or names)[0]]
    return replace(
        entry,
        origin=reading.origin,
        dataset=reading.dataset,
        state=main.state,
        radial_kn=None if reading.radial_n is None else reading.radial_n / N_PER_KN,
        axial_kn=None if reading.axial_n is None else reading.axial_n / N_PER_KN,
        nominal_rpm=reading.nominal_rpm,
        fs_hz=reading.fs_hz,
        seconds=None if reading.fs_hz is None else len(main.samples) / reading.fs_hz,
        channels=names,
        channel=reading.channel,
        reason=_open(reading),
    )


def _open(reading: Reading) -> str | None:
    """What the file leaves open and the options that settle it."""
    questions = open_questions(reading)
    return f"to be settled: {'; '.join(questions)}" if questions else None


def _against_published(entry: RegisteredRecording) -> RegisteredRecording:
    """A file that carries the name and set of a published one must have its hash."""
    for description in known_datasets():
        for expected in description.files if description.name == entry.dataset else ():
            published = expected.name == Path(entry.file).name and expected.sha256
            if published and entry.status is Status.OK and published != entry.sha256:
                return entry.with_status(Status.CHANGED, f"its SHA-256 is not the published {published[:12]}...")
    return entry


def _status_of(error: SrbvalError) -> Status:
    """Truncated where the reader says so, else unreadable."""
    text = str(error)
    cut = "truncated: " in text or ": truncated MATLAB v5 file" in text or "truncated file" in text
    return Status.TRUNCATED if cut else Status.UNREADABLE


def _reason(path: Path, error: SrbvalError) -> str:
    return str(error).removeprefix(f"{path}: ")
