"""Look at one file: hash it, read it, say what it is and what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from srbval.errors import DataError, SrbvalError
from srbval.recordings.datasets.description import known_datasets
from srbval.recordings.load import read_file, sha256_of
from srbval.recordings.reading import Reading
from srbval.recordings.registry.entry import RegisteredRecording, Status
from srbval.recordings.sniff import sniff

N_PER_KN = 1e3
BytesRead = Callable[[int], None]


def inspect_file(path: Path, bytes_read: BytesRead | None = None) -> RegisteredRecording:
    """Read and hash `path` (at the same time); whatever is wrong becomes a status with a reason.

    A file that leaves the channel or the rate open is ok: the question comes up when it is analysed.
    """
    entry = RegisteredRecording(file=str(path), sha256="", size_bytes=0, mtime_ns=0, status=Status.OK)
    try:
        stat = path.stat()
    except OSError as error:
        return entry.with_status(Status.UNREADABLE, f"cannot be read ({error.strerror})")
    entry = replace(entry, size_bytes=stat.st_size, mtime_ns=stat.st_mtime_ns)
    with ThreadPoolExecutor(max_workers=1) as pool:
        hashing = pool.submit(sha256_of, path, bytes_read)
        try:
            entry = replace(entry, format=sniff(path).value)
            entry = _described(entry, read_file(path))
        except SrbvalError as error:
            entry = entry.with_status(_status_of(error), _reason(path, error))
    try:
        return _against_published(replace(entry, sha256=hashing.result()))
    except DataError as error:
        return entry.with_status(Status.UNREADABLE, _reason(path, error))


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
    )


def _against_published(entry: RegisteredRecording) -> RegisteredRecording:
    """A file that carries the name and set of a published one must have its hash."""
    for description in known_datasets():
        for expected in description.files if description.name == entry.dataset else ():
            published = expected.name == Path(entry.file).name and expected.sha256
            if published and entry.status is Status.OK and published != entry.sha256:
                return entry.with_status(
                    Status.CHANGED, f"its SHA-256 is not the published {published[:12]}..."
                )
    return entry


def _status_of(error: SrbvalError) -> Status:
    """Truncated where the reader says so, else unreadable."""
    text = str(error)
    cut = "truncated: " in text or ": truncated MATLAB v5 file" in text or "truncated file" in text
    return Status.TRUNCATED if cut else Status.UNREADABLE


def _reason(path: Path, error: SrbvalError) -> str:
    return str(error).removeprefix(f"{path}: ")
