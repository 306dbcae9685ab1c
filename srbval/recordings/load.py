"""`load_recording`: from a path to a `Recording`, whatever the file is."""

from __future__ import annotations

import hashlib
import mmap
from collections.abc import Callable
from pathlib import Path

import numpy as np

from srbval.errors import DataError
from srbval.recordings.amplitude import UNITS
from srbval.recordings.datasets.description import dataset
from srbval.recordings.datasets.recognise import recognise
from srbval.recordings.loaders.ascii import load_ascii
from srbval.recordings.loaders.hdf5 import load_hdf5
from srbval.recordings.loaders.matlab_v5 import load_matlab_v5
from srbval.recordings.loaders.numpy_file import load_npy
from srbval.recordings.raw import RawFile
from srbval.recordings.reading import Channel, Reading
from srbval.recordings.recording import FloatArray, Recording
from srbval.recordings.settings import Settings, open_questions, settle
from srbval.recordings.sniff import FileKind, sniff

LOADERS: dict[FileKind, Callable[[Path], RawFile]] = {
    FileKind.MATLAB_V5: load_matlab_v5,
    FileKind.HDF5: load_hdf5,
    FileKind.NPY: load_npy,
    FileKind.TEXT: load_ascii,
}


def load_recording(
    path: str | Path,
    *,
    channel: str | None = None,
    fs_hz: float | None = None,
    unit: str | None = None,
    rpm: float | None = None,
) -> Recording:
    """Load one measured file, simulated run or stand-in.

    The format is told by the file's content, the data set by its variables. The options settle what the
    file leaves open and override what it says: `channel` by name, `fs_hz` the sampling rate [Hz], `unit`
    that of the samples in the file (see `amplitude.UNITS`), `rpm` the mean shaft speed [rpm].
    Raises `DataError` for anything that cannot be read or is ambiguous, `ConfigurationError` for an
    impossible option. Does not estimate a speed from the vibration, and does not look into the register for what
    was settled there (`registry.load_registered` does).
    """
    settings = Settings(channel=channel, fs_hz=fs_hz, unit=unit, rpm=rpm)
    file = Path(path)
    return _assemble(file, settle(file, read_file(file), settings), sha256_of(file))


def read_file(path: Path) -> Reading:
    """What the file holds, with open choices left open (`Reading.channel`, `Reading.fs_hz` may be None)."""
    return recognise(LOADERS[sniff(path)](path))


def read_and_hash(path: Path) -> tuple[Reading | DataError, str]:
    """`read_file` and the file's SHA-256; a refusal is returned, so that the hash is known all the same.

    The large MATLAB v5 files are read from the disk once for both. Raises `DataError` for a file that cannot be read
    at all.
    """
    try:
        if sniff(path) is FileKind.MATLAB_V5:
            contents, sha256 = contents_and_hash(path)
            return _or_refusal(lambda: recognise(load_matlab_v5(path, contents))), sha256
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}).") from None
    except DataError as error:
        return error, sha256_of(path)
    return _or_refusal(lambda: read_file(path)), sha256_of(path)


def _or_refusal(read: Callable[[], Reading]) -> Reading | DataError:
    try:
        return read()
    except DataError as error:
        return error


def contents_and_hash(path: Path) -> tuple[memoryview, str]:
    """The file's bytes, mapped, and their SHA-256, hexadecimal: nothing is copied.

    As with every mapped file, one that another program cuts short in this very moment ends the process; the register
    is written whole or not at all, so nothing of it is lost.
    """
    with path.open("rb") as stream:
        contents = memoryview(mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ))
    return contents, hashlib.sha256(contents).hexdigest()


def sha256_of(path: Path) -> str:
    """SHA-256 of the file, hexadecimal."""
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}).") from None


def _assemble(path: Path, reading: Reading, sha256: str) -> Recording:
    open_ = open_questions(reading)
    if open_ or reading.fs_hz is None:
        raise DataError(
            f"{path} leaves open: {'; '.join(open_)}. Give the option to `srbval analyse`, or once and for all to "
            "`srbval data add` (in Python: channel=, fs_hz=, unit=, rpm=)."
        )
    main = reading.channels[reading.channel or reading.axes[0]]  # type: ignore[index]
    stored = _stored_unit(main)
    same = {
        key: c
        for key, c in reading.channels.items()
        if len(c.samples) == len(main.samples) and _stored_unit(c) == stored
    }
    return Recording(
        name=reading.name or path.stem,
        origin=reading.origin,
        channels={key: _in_unit(c) for key, c in same.items()},
        fs_hz=reading.fs_hz,
        unit=stored,
        channel=reading.channel,
        axes=None if reading.channel is not None else reading.axes,
        speed=reading.speed,
        speed_signal=reading.speed_signal,
        bearing=main.bearing,
        state=main.state,
        radial_n=reading.radial_n,
        axial_n=reading.axial_n,
        nominal_rpm=reading.nominal_rpm,
        band_hz=_band(reading, reading.fs_hz, main),
        dataset=reading.dataset,
        file=str(path),
        sha256=sha256,
        notes=reading.notes,
    )


def _stored_unit(channel: Channel) -> str:
    """The unit a recording keeps the channel's samples in."""
    unit = channel.unit or "unknown"
    return UNITS.get(unit, (unit, 1.0))[0]


def _in_unit(channel: Channel) -> FloatArray:
    """The channel's own copy in the unit of the recording: a view would keep the whole file in memory."""
    factor = UNITS.get(channel.unit or "unknown", ("", 1.0))[1]
    return np.array(channel.samples) if factor == 1.0 else channel.samples * factor


def _band(reading: Reading, fs_hz: float, main: Channel) -> tuple[float, float] | None:
    if main.band_hz is not None or reading.dataset is None:
        return main.band_hz
    return dataset(reading.dataset).band_hz(fs_hz, reading.channel)
