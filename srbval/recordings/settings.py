"""What the user states about a file: it decides what the file leaves open and overrides what the file itself says."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

from srbval.errors import ConfigurationError, DataError
from srbval.recordings.raw import printable
from srbval.recordings.reading import UNITS, Reading
from srbval.recordings.recording import ShaftSpeed, SpeedSource
from srbval.recordings.speed import nominal_speed, stated_speed

USER_RPM_CI95 = 1.0  # a speed given by hand is taken as rounded to about 1 rpm
MOST_TOLERANCE_PCT = 10.0  # a record is searched no wider
NAMED_CHANNELS = 16


@dataclass(frozen=True, kw_only=True)
class RecordingSettings:
    """Channel by name, sampling rate [Hz], unit of the samples (see `reading.UNITS`), mean shaft speed [rpm].

    With `rpm_tolerance_pct` [%] the speed is a set point that the shaft keeps within it (95 %), else a measured one.
    Raises `ConfigurationError` for an impossible value.
    """

    channel: str | None = None
    fs_hz: float | None = None
    unit: str | None = None
    rpm: float | None = None
    rpm_tolerance_pct: float | None = None

    def __post_init__(self) -> None:
        given = {"sampling rate": self.fs_hz, "shaft speed": self.rpm, "tolerance of the speed": self.rpm_tolerance_pct}
        for name, value in given.items():
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ConfigurationError(f"{name} {value} must be a positive number.")
        if self.rpm_tolerance_pct is not None and (self.rpm is None or self.rpm_tolerance_pct > MOST_TOLERANCE_PCT):
            raise ConfigurationError(
                f"a tolerance of {self.rpm_tolerance_pct:g} % belongs to a speed of --rpm and is at most "
                f"{MOST_TOLERANCE_PCT:g} %; --rpm is {'not given' if self.rpm is None else f'{self.rpm:g}'}."
            )
        if self.unit is not None and self.unit not in UNITS:
            raise ConfigurationError(f"unit {self.unit!r} is not known; known: {', '.join(UNITS)}.")

    def __bool__(self) -> bool:
        return self != RecordingSettings()

    def over(self, stored: RecordingSettings) -> RecordingSettings:
        """These settings, and the `stored` ones where these are not given."""
        given = {key: value for key, value in dataclasses.asdict(self).items() if value is not None}
        if self.rpm is not None:  # a stored tolerance is that of the stored speed
            given["rpm_tolerance_pct"] = self.rpm_tolerance_pct
        return dataclasses.replace(stored, **given)


def apply_settings(path: Path, reading: Reading, settings: RecordingSettings) -> Reading:
    """`reading` with the user's settings; `DataError` where the file has no such channel."""
    notes = list(reading.notes)
    if settings.fs_hz is not None:
        notes.append(f"sampling rate {settings.fs_hz:g} Hz given by the user")
        # the time base of the file's own speed signal is discarded with its rate
        reading = dataclasses.replace(reading, fs_hz=settings.fs_hz, speed_signal=None)
    if settings.rpm is not None:
        speed, said = _given_speed(settings.rpm, settings.rpm_tolerance_pct, reading)
        notes.append(f"shaft speed {settings.rpm:g} rpm given by the user{said}")
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


def _given_speed(rpm: float, tolerance_pct: float | None, reading: Reading) -> tuple[ShaftSpeed, str]:
    """The user's speed: a set point where a tolerance is given or it repeats the file's own, else a measured one."""
    own = reading.speed
    if tolerance_pct is not None:
        return nominal_speed(rpm, tolerance_pct), f", a set point kept within {tolerance_pct:g} %"
    if own is not None and own.source is SpeedSource.NOMINAL and abs(rpm - 60 * own.value_hz) < USER_RPM_CI95:
        return own, f", the set point that the file states: kept within {100 * own.ci95_hz / own.value_hz:.2g} %"
    return stated_speed(rpm, USER_RPM_CI95), ""


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
