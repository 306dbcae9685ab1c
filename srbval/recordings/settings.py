"""What the user states about a file: it decides what the file leaves open and overrides what the file itself says."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

from srbval.errors import ConfigurationError, DataError
from srbval.recordings.raw import printable
from srbval.recordings.reading import UNITS, Reading
from srbval.recordings.speed import stated_speed

USER_RPM_CI95 = 1.0  # a speed given by hand is taken as rounded to about 1 rpm
NAMED_CHANNELS = 16


@dataclass(frozen=True, kw_only=True)
class RecordingSettings:
    """Channel by name, sampling rate [Hz], unit of the samples (see `reading.UNITS`), mean shaft speed [rpm].

    Raises `ConfigurationError` for an impossible value.
    """

    channel: str | None = None
    fs_hz: float | None = None
    unit: str | None = None
    rpm: float | None = None

    def __post_init__(self) -> None:
        for name, value in (("sampling rate", self.fs_hz), ("shaft speed", self.rpm)):
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ConfigurationError(f"{name} {value} must be a positive number.")
        if self.unit is not None and self.unit not in UNITS:
            raise ConfigurationError(f"unit {self.unit!r} is not known; known: {', '.join(UNITS)}.")

    def __bool__(self) -> bool:
        return self != RecordingSettings()

    def over(self, stored: RecordingSettings) -> RecordingSettings:
        """These settings, and the `stored` ones where these are not given."""
        given = {key: value for key, value in dataclasses.asdict(self).items() if value is not None}
        return dataclasses.replace(stored, **given)


def apply_settings(path: Path, reading: Reading, settings: RecordingSettings) -> Reading:
    """`reading` with the user's settings; `DataError` where the file has no such channel."""
    notes = list(reading.notes)
    if settings.fs_hz is not None:
        notes.append(f"sampling rate {settings.fs_hz:g} Hz given by the user")
        # the time base of the file's own speed signal is discarded with its rate
        reading = dataclasses.replace(reading, fs_hz=settings.fs_hz, speed_signal=None)
    if settings.rpm is not None:
        notes.append(f"shaft speed {settings.rpm:g} rpm given by the user")
        speed = stated_speed(settings.rpm, USER_RPM_CI95)
        reading = dataclasses.replace(reading, speed=speed, speed_signal=None, speed_problem=None)
    if settings.unit is not None:
        notes.append(f"unit {settings.unit} given by the user")
        channels = {key: dataclasses.replace(c, unit=settings.unit) for key, c in reading.channels.items()}
        reading = dataclasses.replace(reading, channels=channels)
    if settings.channel is not None:
        notes.append(f"channel {printable(settings.channel)} chosen by the user")
        reading = dataclasses.replace(reading, channel=_find_channel(path, reading, settings.channel), axes=None)
    against = reading.time.against(reading.fs_hz) if reading.time and reading.fs_hz else None
    cautions = (*reading.cautions, *filter(None, (against,)))
    return dataclasses.replace(reading, notes=tuple(notes), cautions=cautions)


def open_questions(reading: Reading) -> tuple[str, ...]:
    """What neither the file nor the user states, each with the choices and the option that decides it."""
    questions = []
    if reading.channel is None and reading.axes is None:
        questions.append(f"which of {len(reading.channels)} channels: --channel {' | '.join(_names(reading))}")
    if reading.fs_hz is None:
        because = f" ({reading.rate_problem})" if reading.rate_problem else ""
        questions.append(f"no sampling rate{because}: --fs HZ")
    if any(c.unit is None for c in reading.channels.values()):
        questions.append(f"no unit: --unit {' | '.join(u for u in UNITS if u.isascii() and '^' not in u)}")
    if reading.speed_problem is not None:
        questions.append(f"{reading.speed_problem} State the speed: --rpm R")
    return tuple(questions)


def _find_channel(path: Path, reading: Reading, wanted: str) -> str:
    for name, channel in reading.channels.items():
        if wanted in (name, channel.variable):
            return name
    lower = [name for name in reading.channels if name.lower() == wanted.lower()]
    if len(lower) == 1:
        return lower[0]
    raise DataError(f"{path}: no channel {printable(wanted)!r}; it has {', '.join(_names(reading))}.")


def _names(reading: Reading) -> list[str]:
    names = [printable(name) for name in reading.channels]
    return names if len(names) <= NAMED_CHANNELS else [*names[:NAMED_CHANNELS], "..."]
