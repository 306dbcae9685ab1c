"""`load_recording`: from a path to a `Recording`, whatever the format of the file."""

import hashlib
from pathlib import Path

from srbval.errors import DataError
from srbval.recordings.datasets import recognise
from srbval.recordings.datasets.description import dataset
from srbval.recordings.loaders import detect_format
from srbval.recordings.reading import Channel, Reading
from srbval.recordings.recording import Recording
from srbval.recordings.settings import RecordingSettings, apply_settings, open_questions


def load_recording(
    path: str | Path,
    *,
    channel: str | None = None,
    fs_hz: float | None = None,
    unit: str | None = None,
    rpm: float | None = None,
) -> Recording:
    """Load one measured file, simulated run or stand-in.

    The format is recognised by the file's first bytes, the data set by its variables. The options decide what the
    file leaves open and override what it says: `channel` by name, `fs_hz` the sampling rate [Hz], `unit`
    that of the samples in the file (see `reading.UNITS`), `rpm` the mean shaft speed [rpm].
    Raises `DataError` for anything that cannot be read or is ambiguous, `ConfigurationError` for an
    impossible option. Does not estimate a speed from the vibration, and does not use the settings kept in the
    register (`registry.load_registered` does).
    """
    settings = RecordingSettings(channel=channel, fs_hz=fs_hz, unit=unit, rpm=rpm)
    file = Path(path)
    return _assemble(file, apply_settings(file, read_file(file), settings), sha256_of(file))


def read_file(path: Path) -> Reading:
    """Contents of the file, with open choices left open (`Reading.channel`, `Reading.fs_hz` may be None)."""
    return recognise(detect_format(path).load(path))


def sha256_of(path: Path) -> str:
    """SHA-256 of the file, hexadecimal."""
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}).") from None


def _assemble(path: Path, reading: Reading, sha256: str) -> Recording:
    questions = open_questions(reading)
    if questions or reading.fs_hz is None:
        raise DataError(
            f"{path} leaves open: {'; '.join(questions)}. Give the option to `srbval analyse`, or permanently to "
            "`srbval data add` (in Python: channel=, fs_hz=, unit=, rpm=)."
        )
    main = reading.channels[reading.channel or reading.axes[0]]  # type: ignore[index]
    same = {
        key: c
        for key, c in reading.channels.items()
        if len(c.samples) == len(main.samples) and c.recording_unit == main.recording_unit
    }
    return Recording(
        name=reading.name or path.stem,
        origin=reading.origin,
        channels={key: c.converted() for key, c in same.items()},
        fs_hz=reading.fs_hz,
        unit=main.recording_unit,
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


def _band(reading: Reading, fs_hz: float, main: Channel) -> tuple[float, float] | None:
    if main.band_hz is not None or reading.dataset is None:
        return main.band_hz
    return dataset(reading.dataset).band_hz(fs_hz, reading.channel)
