"""Statements of the user about a file, from options or from a table of labels; they take precedence over the file."""

from __future__ import annotations

import csv
import math
import os
import re
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from srbval.bearing import Fault
from srbval.errors import ConfigurationError, DataError, OpenQuestion, closest_word, did_you_mean
from srbval.recordings.raw import printable
from srbval.recordings.reading import N_PER_KN, Channel, Reading
from srbval.recordings.recording import Origin
from srbval.recordings.simulated import as_accelerations, as_rotation, mean_hz, resample_channels, without_settling
from srbval.recordings.speed import MOST_TOLERANCE_PCT, speed_from_user, with_tachometer
from srbval.recordings.times import PLAUSIBLE_HZ
from srbval.recordings.units import CONVERTER_COUNTS, DERIVATIVES, FINE_UNITS, UNITS, UNKNOWN, known_unit, split_unit
from srbval.storage.files import read_limited
from srbval.storage.json_files import to_json
from srbval.storage.tables import Limited, build, limited

FILE_COLUMN = "file"  # column of a table of labels
ROTATIONS = ("tacho", "cage_channel", "shaft_channel")  # settings that name a channel of a rotation
NAMED_CHANNELS = 16
LIKELY_HZ = 25600.0  # rate in the example of a question
LIKELY_UNITS = {"vel|geschw": "mm/s", "disp|prox|weg|pos": "um", "volt|spannung": "V", "press|mic": "Pa"}  # by name
VOLTAGES = ("V", "mV", "uV")
MV_PER_V = 1e3
DERIVATIVE_UNITS = {1: "m/s", 2: "m"}  # default units by the stated order of the derivative
NOTED = ("unit", "scale", "sensitivity_mv_per_g", "state", "bearing", "radial_kn", "axial_kn", "band_hz")
SETTING_LABELS = {"sensitivity_mv_per_g": "sensitivity [mV/g]", "band_hz": "demodulation band [Hz]"}
SETTING_LABELS |= {f"{direction}_kn": f"{direction} load [kN]" for direction in ("radial", "axial")}
BEARING_QUESTION = OpenQuestion("no bearing", "--bearing NAME | FILE.toml", "--bearing skf-22240")
SPEED_QUESTION = OpenQuestion("no shaft speed", "--rpm R, or --tacho CHANNEL --pulses-per-rev N", "--rpm 1480")


@dataclass(frozen=True, kw_only=True)
class RecordingSettings(Limited):
    """Statements of the user about a record; None if not stated. Raises `ConfigurationError` for an impossible value.

    The samples times `scale` have the unit `unit`; `sensitivity_mv_per_g` converts V or mV to g. `tacho` is the
    tachometer's channel. `rpm` is a measured speed or, if `rpm_tolerance_pct` is stated, a set point with this
    tolerance (95 %). `bearing` is a name or a TOML file. With `auto_band` the demodulation band is selected from the
    record.

    For simulated signals: `origin` states that they are simulated, if the file does not; `resample_hz` is the even
    sampling rate to which the uneven times of a variable-step solver are resampled; the first `skip_s` seconds are cut;
    `derivative` is 1 if the samples are velocities, 2 if they are positions; `cage_channel` and `shaft_channel` name
    the channels with the angle or speed of cage and shaft.
    """

    channel: str | None = None
    fs_hz: float | None = limited(above=0, default=None)
    unit: str | None = None
    rpm: float | None = limited(above=0, default=None)
    rpm_tolerance_pct: float | None = limited(above=0, most=MOST_TOLERANCE_PCT, default=None)
    scale: float | None = limited(above=0, default=None)
    sensitivity_mv_per_g: float | None = limited(above=0, default=None)
    tacho: str | None = None
    pulses_per_rev: float | None = limited(above=0, default=None)
    state: Fault | None = None
    bearing: str | None = None
    radial_kn: float | None = None
    axial_kn: float | None = None
    band_hz: tuple[float, float] | None = None
    auto_band: bool | None = None
    origin: Origin | None = None
    resample_hz: float | None = limited(above=0, default=None)
    skip_s: float | None = limited(least=0, default=None)
    derivative: int | None = limited(least=1, most=2, default=None)
    cage_channel: str | None = None
    shaft_channel: str | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rpm_tolerance_pct is not None and self.rpm is None:
            raise ConfigurationError(f"a speed tolerance, {self.rpm_tolerance_pct:g} %, needs the speed: --rpm R.")
        if self.unit is not None and self.unit not in UNITS:
            if (known := known_unit(self.unit)) not in UNITS:
                raise ConfigurationError(f"unit {self.unit!r} is not known; known: {', '.join(UNITS)}.")
            object.__setattr__(self, "unit", known)
        if self.band_hz is not None and not 0 < self.band_hz[0] < self.band_hz[1] < math.inf:
            edges = "{:g} to {:g} Hz".format(*self.band_hz)
            raise ConfigurationError(f"band {edges}: the second edge must be above the first, both above 0.")

    def __bool__(self) -> bool:
        return self != RecordingSettings()

    def over(self, stored: RecordingSettings) -> RecordingSettings:
        """Combine with `stored` settings; a stored setting is used if these settings do not state it."""
        given = {key: value for key, value in vars(self).items() if value is not None}
        if self.rpm is not None:  # a stored tolerance belongs to the stored speed
            given["rpm_tolerance_pct"] = self.rpm_tolerance_pct
        if self.band_hz or self.auto_band:  # one of them
            given |= {"band_hz": self.band_hz, "auto_band": self.auto_band}
        return replace(stored, **given)


def settings_of(stated: Mapping[str, Any]) -> RecordingSettings:
    """Create settings from the keyword arguments `stated`; None means not stated, a text may replace an enum member."""
    given = {key: to_json(value) for key, value in stated.items() if value is not None}
    return build(RecordingSettings, given, "keywords")


# Settings by the names of their options, which contain no units.
ALIASES = {re.sub("_(hz|pct|s|mv_per_g)$", "", field.name): field.name for field in fields(RecordingSettings)}
# Keywords of options that are named neither like a setting nor like the option.
KEYWORDS = {"tolerance": "tolerance_pct", "cage-slip": "largest_slip_pct", "wait": "wait_s", "seconds": "duration_s"}
KEYWORDS |= {"least-limit": "least_limit_s", "dt": 'solver={"step": ...}', "solver": 'solver={"name": ...}'}
KEYWORDS |= {kind: f'bearing="{kind} ..."' for kind in ("elements", "orders")}
KEYWORDS |= {"cluster-option": "cluster_options", "cross-from": "cross", "no-pdf": 'formats=("html", "json")'}
KEYWORDS |= {"cluster-class": "engine", "scheduler": "engine"}
# Words after an option that are its value; others continue the sentence.
OPTION_VALUES = "|".join(map(re.escape, sorted({*UNITS, *(fault.value for fault in Fault)} - {"in"}, reverse=True)))
OPTION_VALUES += r"|auto|dask|full|impulse|kinematic|line|local|planar|slices|dask_jobqueue\.\w+|\w+-\d+"
OPTION = re.compile(
    r"`[^`]*`|\bsrbval [a-z]+ [^;]*?(?=[;)]|\. |\.?$)|(?<![\w-])(?:-o\b|--([a-z][a-z-]*)"
    rf"( (?:LO HI|(?:{OPTION_VALUES})(?![\w/|]| \|)|(?=[A-Z\d']|\S+ \|)))?)"
)


def with_keywords(text: str) -> str:
    """Replace options in an error message by keyword arguments (``--rpm R`` by ``rpm=R``), not in quoted commands."""

    def keyword(found: re.Match[str]) -> str:
        option, value = found[1], (found[2] or " ...").strip()
        if option is None:
            return "folder" if found[0] == "-o" else found[0]
        word = KEYWORDS.get(option) or ALIASES.get(option.replace("-", "_"), option.replace("-", "_"))
        value = "(LO, HI)" if value == "LO HI" else f'"{value}"' if value.strip(".") else value
        return word if "=" in word or " " in word else f"{word}={value}"

    return OPTION.sub(keyword, text)


def apply_settings(path: Path, reading: Reading, settings: RecordingSettings) -> Reading:
    """Apply the user's settings to `reading`; `DataError` if a setting does not fit the contents of the file."""
    reading = _with_origin(path, reading, settings.origin)
    changes: dict[str, Any] = {"channels": _apply_to_channels(path, reading, settings)}
    notes = []
    stated = {key: name for key in ROTATIONS if (name := getattr(settings, key)) is not None}
    rotations = {key: _find_channel(path, reading, name) for key, name in stated.items()}
    if settings.channel is not None:
        notes.append(f"channel {printable(settings.channel)} chosen by the user")
        changes |= {"channel": _find_channel(path, reading, settings.channel), "axes": None}
    elif rotations and reading.channel is None and reading.axes is None:
        others = [name for name in reading.vibrations if name not in rotations.values()]
        changes["channel"] = others[0] if len(others) == 1 else None
    changes |= _sampling_rate(path, replace(reading, **changes), settings)
    if settings.fs_hz is not None:
        notes.append(f"sampling rate {settings.fs_hz:g} Hz given by the user")
    given = {SETTING_LABELS.get(key, key): getattr(settings, key) for key in NOTED}
    notes += [f"{label} {value} given by the user" for label, value in given.items() if value is not None]
    if settings.rpm is not None:
        changes["speed"], how = speed_from_user(settings.rpm, settings.rpm_tolerance_pct, reading)
        changes |= {"speed_signal": None, "speed_problem": None}
        notes.append(f"shaft speed {settings.rpm:g} rpm given by the user{how}")
    loads_kn = {"radial_n": settings.radial_kn, "axial_n": settings.axial_kn}
    changes |= {key: load_kn * N_PER_KN for key, load_kn in loads_kn.items() if load_kn is not None}
    states = {c.state for c in reading.channels.values()} - {None, settings.state} if settings.state else ()
    cautions = [f"the file or its data set states {s}, the user {settings.state}: the latter is used" for s in states]
    changed = replace(reading, **changes, notes=(*reading.notes, *notes))
    if (time := changed.time) and changed.fs_hz and (against := time.rate_caution(changed.fs_hz)):
        cautions += [] if time.uneven and settings.resample_hz else [against]
    if time is not None and (places := time.places) is not None:
        cautions.append(time.missing_caution())
        changed = changed.with_samples(lambda samples: np.interp(np.arange(places[-1] + 1), places, samples))
    changed = _prepare_signals(path, replace(changed, cautions=(*reading.cautions, *cautions)), settings, rotations)
    if "tacho" in rotations:
        tacho = changed.channels[rotations["tacho"]]
        tacho = as_rotation(path, tacho) if tacho.rotates else tacho
        changed = with_tachometer(changed, tacho, pulses_per_rev=settings.pulses_per_rev, rpm=settings.rpm)
    return changed


def _with_origin(path: Path, reading: Reading, stated: Origin | None) -> Reading:
    """Set the origin that the user states; `DataError` if the file states that it is simulated or synthetic."""
    if stated in (None, reading.origin):
        return reading
    if reading.origin is not Origin.MEASURED:
        raise DataError(f"{path}: the file states that it is {reading.origin}; it cannot be declared {stated}.")
    channels = {name: replace(c, cautions=()) for name, c in reading.channels.items()}
    return replace(reading, origin=stated, channels=channels)


def _sampling_rate(path: Path, reading: Reading, settings: RecordingSettings) -> dict[str, Any]:
    """Fields of `Reading` that state the sampling rate (from user, file, times or channel) or why it is unknown."""
    time = reading.time
    if settings.fs_hz is not None:
        if settings.resample_hz and time is not None and time.times_s is not None:
            raise DataError(f"{path}: {time.problem}, but --fs assumes even times. Give --resample without --fs.")
        # the time base of the file's own speed signal is discarded with its rate
        return {"fs_hz": settings.fs_hz, "speed_signal": None}
    problem = "; ".join(filter(None, (reading.rate_problem, time.problem if time else None)))
    by_times = time.rates_hz[0] if time is not None and time.rates_hz and not problem else None
    by_channel = None if reading.channel is None else reading.main.fs_hz
    return {"fs_hz": reading.fs_hz or by_times or by_channel, "rate_problem": problem or None}


def _prepare_signals(
    path: Path, reading: Reading, settings: RecordingSettings, rotations: Mapping[str, str]
) -> Reading:
    """Cut, resample and differentiate channels; the channels in `rotations` become the cage and shaft speeds."""
    cage, shaft = (rotations.get(key) for key in ROTATIONS[1:])
    turning = {name: as_rotation(path, reading.channels[name]) for name in (cage, shaft) if name is not None}
    reading = replace(reading, channels={**reading.channels, **turning})
    if reading.channel in turning or not set(reading.channels) - set(turning):
        raise DataError(f"{path}: no vibration to analyse, only {' and '.join(turning)}; choose another --channel.")
    wanted, unit, time = settings.derivative, reading.main.recording_unit, reading.time
    if wanted is not None and DERIVATIVES.get(unit) != wanted:
        fitting = " or ".join(f"{order} for {name}" for name, order in DERIVATIVES.items())
        raise DataError(
            f"{path}: --derivative {wanted} does not fit samples in {unit}; use {fitting}, or another --unit."
        )
    derivatives = DERIVATIVES if wanted is not None or reading.origin is Origin.SIMULATED else {}
    times_s = time.times_s if time is not None and settings.resample_hz else None
    is_other_rate = times_s is not None or settings.resample_hz != reading.fs_hz
    if times_s is None:
        if reading.fs_hz is None:  # an open question
            return reading
        needed = settings.skip_s or cage is not None or (settings.resample_hz and is_other_rate)
        times_s = np.arange(reading.main.samples.size if needed else 0) / reading.fs_hz
    if settings.skip_s:
        reading = without_settling(path, reading, times_s, settings.skip_s)
        times_s = times_s[-reading.main.samples.size :]
    if cage is not None:
        cage_hz, notes = mean_hz(path, reading.channels[cage], times_s), (*reading.notes, f"cage speed from {cage}")
        reading = replace(reading, cage_hz=cage_hz, notes=notes)
    if settings.resample_hz and is_other_rate:
        reading = resample_channels(path, reading, times_s, settings.resample_hz, derivatives)
    if shaft is not None:
        reading = with_tachometer(reading, reading.channels[shaft], pulses_per_rev=None, rpm=settings.rpm)
    vibrations = {name: channel for name, channel in reading.channels.items() if name not in turning}
    return as_accelerations(replace(reading, channels=vibrations), derivatives)


def _apply_to_channels(path: Path, reading: Reading, settings: RecordingSettings) -> dict[str, Channel]:
    """Channels of `reading` with the unit, scale, sensitivity, state, bearing and band that the user states."""
    given = {key: value for key in ("state", "bearing", "band_hz") if (value := getattr(settings, key))}
    given |= {"factor": settings.scale, "whole_numbers": False} if settings.scale else {}
    channels = {}
    for name, own in reading.channels.items():
        c = replace(own, **given | ({} if own.rotates else _unit_changes(path, name, own, settings)))
        caution = (
            f"its samples are whole numbers of a converter, and no --scale converts them to {c.unit}: levels are "
            "unknown and are not compared with other records"
        )
        channels[name] = replace(c, cautions=(*c.cautions, caution)) if c.scale_missing else c
    if (per_g := settings.sensitivity_mv_per_g) is None:
        return channels
    in_volt = {name: c for name, c in channels.items() if c.unit in VOLTAGES}
    if not in_volt and all(c.unit is not None for c in channels.values()):
        units = ", ".join(sorted({c.unit or "" for c in channels.values()}))
        raise DataError(
            f"{path}: a sensitivity of {per_g:g} mV/g needs samples in V or mV; they are in {units}. "
            "Leave it out, or state --unit V or mV."
        )
    for name, c in in_volt.items():
        factor = c.factor * UNITS[c.unit or ""][1] * MV_PER_V / per_g
        channels[name] = replace(c, unit="g", factor=factor)
    return channels


def _unit_changes(path: Path, name: str, channel: Channel, settings: RecordingSettings) -> dict[str, Any]:
    """Fields of a channel that the user's unit changes, with a caution or problem if the file states another unit."""
    unit, own = settings.unit, channel.unit
    if unit is None and own is None and settings.derivative is not None:
        unit = DERIVATIVE_UNITS[settings.derivative]
    if unit is None or unit == own:
        return {}
    said = f"the file states {own} for {printable(name)}, --unit {unit}"
    if own == CONVERTER_COUNTS and not settings.scale:
        return {"unit": unit, "whole_numbers": True}
    if own not in (None, UNKNOWN) and unit != UNKNOWN and not settings.scale:
        if UNITS[unit][0] != channel.recording_unit and not channel.scale_missing:
            remedy = f"leave --unit out, or add the factor from the samples to {unit}, --scale F"
            return {"problem": channel.problem or f"{path}: {said} contradicts it: {remedy}."}
        return {"unit": unit, "cautions": (*channel.cautions, f"{said} is used")}
    whole = channel.whole_numbers and not (unit in FINE_UNITS and bool((channel.samples % 1 == 0).all()))
    return {"unit": unit, "whole_numbers": whole and not settings.scale}


def open_questions(reading: Reading) -> tuple[OpenQuestion, ...]:
    """Questions about channel, rate, unit and speed that neither the file nor the user answers."""
    questions, names = list[OpenQuestion](), reading.vibrations or tuple(reading.channels)
    if reading.channel is None and reading.axes is None:
        known = _printable_names(names)
        options = f"--channel {' | '.join(known)}", f"--channel {shlex.quote(known[0])}"
        questions.append(OpenQuestion(f"which of {len(names)} channels", *options))
    main = [reading.channels[name] for name in ((reading.channel,) if reading.channel is not None else names)]
    if reading.fs_hz is None and not all(c.fs_hz for c in main):
        questions.append(_rate_question(reading))
    if unstated := [c for c in main if c.unit is None]:
        text = next((c.unknown_unit for c in unstated if c.unknown_unit), None)
        because = f" (the file states {text!r}, which is not known)" if text else ""
        options = f"--unit {' | '.join(UNITS)}", f"--unit {_likely_unit(main[0])}"
        questions.append(OpenQuestion(f"no unit{because}", *options))
    if reading.speed_problem is not None:
        questions.append(OpenQuestion(f"{reading.speed_problem} State the speed", "--rpm R", "--rpm 1480"))
    return tuple(questions)


def _rate_question(reading: Reading) -> OpenQuestion:
    """Question for the missing sampling rate; its example of an answer agrees with the times in the file."""
    because, time = f" ({reading.rate_problem})" if reading.rate_problem else "", reading.time
    if time is None or not time.uneven:
        possible = (rate for rate in (time.rates_hz if time else ()) if PLAUSIBLE_HZ[0] <= rate <= PLAUSIBLE_HZ[1])
        likely = (time and time.likely_hz) or next(possible, LIKELY_HZ)
        return OpenQuestion(f"no sampling rate{because}", "--fs HZ", f"--fs {likely:.6g}")
    if time.times_s is not None:
        likely = (time.times_s.size - 1) / float(time.times_s[-1] - time.times_s[0])
        return OpenQuestion(f"no even times{because}", "--resample HZ", f"--resample {likely:.4g}")
    again = "export them again, rising, with all their digits and their unit, as in 'time [s]'"
    return OpenQuestion(f"no even times{because}", again, "")


def _likely_unit(channel: Channel) -> str:
    """Unit to propose to the user for a channel without a unit, guessed from the channel's name."""
    if channel.whole_numbers or channel.unknown_unit:
        return UNKNOWN
    name = (channel.variable or "").lower()
    return next((unit for words, unit in LIKELY_UNITS.items() if re.search(words, name)), "g")


def open_for_analysis(reading: Reading) -> tuple[OpenQuestion, ...]:
    """Questions about a missing bearing or speed, which are needed for an analysis, not for a recording."""
    bearing = () if reading.main.bearing or reading.own_bearing else (BEARING_QUESTION,)
    return bearing if reading.speed or reading.speed_problem else (*bearing, SPEED_QUESTION)


def _find_channel(path: Path, reading: Reading, wanted: str) -> str:
    exact = [name for name, channel in reading.channels.items() if wanted in (name, channel.variable)]
    lower = [name for name in reading.channels if wanted.lower() in (name.lower(), split_unit(name)[0].lower())]
    if exact or len(lower) == 1:
        return (exact or lower)[0]
    close, held = closest_word(wanted, reading.channels), ", ".join(_printable_names(reading.channels))
    hint = f" Did you mean {printable(close)!r}?" if close else ""
    raise DataError(f"{path}: no channel {printable(wanted)!r}; it has {held}.{hint}")


def _printable_names(channels: Iterable[str]) -> list[str]:
    names = [printable(name) for name in channels]
    return names if len(names) <= NAMED_CHANNELS else [*names[:NAMED_CHANNELS], "..."]


def label_table(table: Path, folder: Path, common: RecordingSettings) -> dict[str, RecordingSettings]:
    """Read a CSV table with settings of files below `folder`, one file per row; return the settings by file.

    The columns are ``file`` and fields of `RecordingSettings`; for an empty field the value in `common` is used. If
    semicolons or tabs separate the columns, decimals may have commas. `ConfigurationError` lists all errors in the
    table.
    """
    types = {field.name: str(field.type) for field in fields(RecordingSettings)}
    columns = (FILE_COLUMN, *(name for name in types if name != "auto_band"))
    lines = read_limited(table).decode("utf-8-sig", "replace").splitlines()
    rows = [line for line in lines if line.strip() and not line.startswith("#")]
    separator = next((mark for mark in (";", "\t") if rows and mark in rows[0]), ",")
    header, *body = list(csv.reader(rows, delimiter=separator, skipinitialspace=True)) or [[]]
    names = [ALIASES.get(name.strip().lower(), name.strip().lower()) for name in header]
    wrong = [f"unknown column {name!r}{did_you_mean(name, columns)}" for name in names if name not in columns]
    if FILE_COLUMN not in names or len(set(names)) < len(names):
        wrong.append(f"each column must occur once, and {FILE_COLUMN!r} is required")
    if wrong or not body:
        raise ConfigurationError(f"{table}: {'; '.join(wrong) or 'the table has no row below its header'}.")
    found: dict[str, RecordingSettings] = {}
    for number, row in enumerate(body, 1):
        try:
            if len(row) != len(names):
                raise ConfigurationError(f"the row has {len(row)} fields, the header {len(names)}; make them equal")
            stated: dict[str, Any] = {k: v.strip() for k, v in zip(names, row, strict=True) if v.strip()}
            file = os.path.abspath(folder / stated.pop(FILE_COLUMN, ""))
            if not os.path.isfile(file):
                raise ConfigurationError(f"{file}: no such file")
            for key, text in stated.items():
                point = text.replace(",", ".") if separator != "," and "float" in types[key] else text
                stated[key] = point.split() if "tuple" in types[key] else point  # both edges of a band
                if "int" in types[key] and text.isdecimal():
                    stated[key] = int(text)
            settings = build(RecordingSettings, stated, "row")
            if file in found:
                raise ConfigurationError(f"{os.path.basename(file)} is named twice in the table; delete one row")
            found[file] = settings.over(common)
        except ConfigurationError as error:
            wrong.append(f"row {number}: {error}")
    if wrong:
        raise ConfigurationError(f"{table}: {len(wrong)} of {len(body)} rows cannot be used: {'; '.join(wrong)}")
    return found
