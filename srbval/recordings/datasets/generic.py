"""Recogniser for files of no known data set: named vectors, with rate and speed from variables of known names."""

import re
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from srbval.errors import DataError
from srbval.recordings.raw import RawFile, as_signal, printable, samples_down
from srbval.recordings.reading import UNITS, Channel, Reading
from srbval.recordings.speed import stated_speed

MIN_SAMPLES = 256
MAX_COLUMNS = 64
UNEVEN = 1e-3  # of a time step: the rounding in a text file
STATED_CI95_RPM = 1.0
_RATE = re.compile(r"(?:.*\.)?(?:fs|sr|fs_hz|fs_acc|sampl(?:e|ing)_?(?:rate|frequency)(?:_hz)?)")
_TIME = re.compile(r"(?:.*\.)?(?:t|time|time_s|time_acc|timestamps?)")
_RPM = re.compile(r"(?:.*\.)?(?:rpm|mean_rpm|speed_rpm|shaft_rpm)")


def read_generic(raw: RawFile) -> Reading:
    """Every numeric vector of at least 256 samples is a candidate channel, a matrix is one per column.

    Nothing is guessed: what no variable or attribute names stays open. Raises `DataError` if there is no
    numeric vector at all.
    """
    channels: dict[str, Channel] = {}
    for name, channel in _candidates(raw):
        channels[name if name not in channels else f"{name} ({len(channels) + 1})"] = channel
    if not channels:
        held = ", ".join(f"{printable(k)} {getattr(v, 'shape', 'text')}" for k, v in list(raw.variables.items())[:6])
        raise DataError(
            f"{raw.path}: a {raw.format} file without a numeric vector of at least {MIN_SAMPLES} samples; "
            f"it holds {held or 'nothing'}."
        )
    rpm = _named_number(raw, _RPM)
    return Reading(
        channels=channels,
        channel=next(iter(channels)) if len(channels) == 1 else None,
        fs_hz=_named_number(raw, _RATE) or _rate_from_time(raw),
        speed=None if rpm is None else stated_speed(rpm, STATED_CI95_RPM),
        notes=(f"{raw.format} file of no known data set: read by the names of its variables",),
    )


def _candidates(raw: RawFile) -> Iterator[tuple[str, Channel]]:
    unit = raw.text("unit")
    for name, column in _vectors(raw):
        if _TIME.fullmatch(name.lower()) or _RPM.fullmatch(name.lower()):
            continue
        samples = as_signal(column, f"{raw.path}: {name}")
        yield printable(name), Channel(samples=samples, unit=unit if unit in UNITS else None, variable=name)


def _vectors(raw: RawFile) -> Iterator[tuple[str, NDArray[np.generic]]]:
    for name in raw.variables:
        array = raw.array(name)
        if array is None or array.dtype.kind not in "fiu" or array.size < MIN_SAMPLES:
            continue
        if max(array.shape) == array.size:
            yield name, array
        elif array.ndim == 2 and min(array.shape) <= MAX_COLUMNS and max(array.shape) >= MIN_SAMPLES:
            yield from ((f"{name}[{i}]", column) for i, column in enumerate(samples_down(array).T, 1))


def _named_number(raw: RawFile, pattern: re.Pattern[str]) -> float | None:
    names = [n for n in (*raw.variables, *raw.attributes) if pattern.fullmatch(n.lower())]
    values = {v for v in map(raw.number, names) if v is not None and v > 0}
    return values.pop() if len(values) == 1 else None


def _rate_from_time(raw: RawFile) -> float | None:
    """Rate of an evenly spaced time vector in seconds; an uneven one gives no sampling rate."""
    for name in raw.variables:
        array = raw.array(name)
        if array is None or array.size < MIN_SAMPLES or not _TIME.fullmatch(name.lower()):
            continue
        steps = np.diff(raw.signal(name))
        mean = float(np.mean(steps))
        if mean > 0 and float(np.max(np.abs(steps - mean))) < max(UNEVEN * mean, 1e-6):
            return round(1 / mean, 6)
    return None
