"""Interpretation of files written by srbval (attribute ``srbval_kind``): runs, synthetic records, recordings."""

import dataclasses
import re
from typing import Any

from srbval.bearing import Bearing, Fault, FaultOrders
from srbval.errors import ConfigurationError, DataError, NoRecordingError
from srbval.models.run import USABLE
from srbval.recordings.raw import RawFile, printable
from srbval.recordings.reading import Channel, Reading, scaled
from srbval.recordings.recording import (
    KIND_ATTRIBUTE,
    RECORDING_KIND,
    SPEED_RATE,
    SPEED_TIME,
    SPEED_VARIABLE,
    Origin,
    Recording,
    SourceFacts,
    SpeedSignal,
)
from srbval.recordings.speed import prescribed_speed, profile_signal
from srbval.recordings.times import interpret_times
from srbval.storage.json_files import parse_json
from srbval.storage.tables import build

PREFIX = "acceleration"
SUFFIX = "_m_s2"
RUN_AXES = ("x", "y")
SENSOR_CHANNEL = "sensor"  # channel with the signal at the sensor, in a run with a path to the sensor
LONGEST_NOTE = 1000
ORDERS = ("bpfo", "bpfi", "bsf", "ftf")


def read_srbval_file(raw: RawFile) -> Reading | None:
    """Read a run, a synthetic record or a recording that this program wrote; None for files of other programs."""
    if KIND_ATTRIBUTE not in raw.attributes:
        return None
    fs_hz, kind = raw.number("fs_hz"), raw.text(KIND_ATTRIBUTE)
    if fs_hz and "time_s" in raw.variables and (against := interpret_times(raw, "time_s").rate_caution(fs_hz)):
        raise DataError(
            f"{raw.path}: {against} by the attribute fs_hz. Set it to the rate of the stored samples. If only every "
            "nth sample of a signal was stored, low-pass filter the signal and store it again."
        )
    if kind == RECORDING_KIND:
        return _recording(raw)
    if kind not in ("run", "stand-in"):
        raise NoRecordingError(
            f"{raw.path}: srbval_kind is {kind!r}; this version reads 'run', 'stand-in', 'recording'."
        )
    status = raw.text("status") or "ok"
    if status not in USABLE:
        raise DataError(f"{raw.path}: the run failed ({status}: {raw.text('reason')}); it is not a vibration record.")
    channels = _channels(raw)
    of_run = (SENSOR_CHANNEL,) if SENSOR_CHANNEL in channels else RUN_AXES
    wanted: tuple[str, ...] = (PREFIX,) if kind == "stand-in" else of_run
    if not set(wanted) <= set(channels):
        missing = " and ".join(wanted)
        raise DataError(f"{raw.path}: a {kind} without {missing} acceleration; it is incomplete.")
    speed_hz, speed_signal = raw.number("shaft_speed_hz"), None
    try:
        profile = parse_json(raw.text("scene") or "{}").get("speed_profile")
        if profile is not None and fs_hz:
            seconds = next(iter(channels.values())).samples.size / fs_hz
            speed_signal = profile_signal(profile["time_s"], profile["speed_rad_s"], seconds)
    except (ValueError, TypeError, KeyError, AttributeError):
        raise DataError(f"{raw.path}: the scene stored with the run cannot be read; simulate it again.") from None
    missing = printable(raw.text("not_validated") or "", LONGEST_NOTE)
    return Reading(
        channels=channels,
        origin=Origin.SIMULATED if kind == "run" else Origin.STAND_IN,
        channel=wanted[0] if len(wanted) == 1 else None,
        axes=None if len(wanted) == 1 else RUN_AXES,
        fs_hz=fs_hz,
        speed=None if speed_hz is None else prescribed_speed(speed_hz),
        speed_signal=speed_signal,
        radial_n=raw.number("radial_n"),
        axial_n=raw.number("axial_n"),
        nominal_rpm=raw.number("nominal_rpm"),
        own_bearing=_own_bearing(raw),
        cage_hz=None if speed_hz is None else scaled(raw.number("cage_ratio"), speed_hz),
        interval_means=kind == "run",
        name=printable(raw.text("name") or "") or None,
        notes=(
            f"{kind} written by srbval",
            *status_note(status, raw.text("reason") or ""),
            *([f"not validated: {missing}"] if missing else []),
        ),
    )


def _recording(raw: RawFile) -> Reading:
    """Read a recording that `Recording.to_xarray` converted."""
    arrays = {name: raw.signal(name) for name in raw.arrays}
    samples = {name: values for name, values in arrays.items() if name not in ("time_s", SPEED_TIME, SPEED_VARIABLE)}
    rate_hz, course = raw.number(SPEED_RATE), arrays.get(SPEED_VARIABLE)
    signal = SpeedSignal(values_hz=course, rate_hz=rate_hz) if rate_hz and course is not None else None
    try:
        facts = parse_json(raw.text("facts") or "")
        stated = build(Recording, facts | {"channels": samples}, "facts")
    except (ValueError, TypeError, ConfigurationError) as error:
        raise DataError(f"{raw.path}: the facts about the recording cannot be read ({error}).") from None
    of_channel = {key: getattr(stated, key) for key in ("bearing", "band_hz", "state")}
    unit = "V" if stated.scale_missing else stated.unit  # any unit, as its whole numbers are not used as amounts
    channels = {
        name: Channel(samples=values, unit=unit, whole_numbers=stated.scale_missing, variable=name, **of_channel)
        for name, values in stated.channels.items()
    }
    own = {field.name: getattr(stated, field.name) for field in dataclasses.fields(SourceFacts)}
    return Reading(**own | {"speed_signal": signal}, channels=channels, fs_hz=stated.fs_hz, name=stated.name)


def _own_bearing(raw: RawFile) -> Bearing | None:
    """Bearing stored with a run (name, fault orders, number of rolling elements); None if a file lacks them."""
    numbers = [raw.number(f"bearing_{name}") for name in (*ORDERS, "rolling_elements")]
    known = [number for number in numbers if number is not None]
    if len(known) < len(numbers):
        return None
    try:
        orders = FaultOrders(**dict(zip(ORDERS, known, strict=False)))
    except ConfigurationError as error:
        raise DataError(f"{raw.path}: the bearing stored with the run: {error}") from None
    name, title, source = (printable(raw.text(f"bearing_{key}") or "?") for key in ("name", "title", "source"))
    return Bearing(name=name, title=title, source=source, rolling_elements=round(known[-1]), orders=orders)


def status_note(status: str, reason: str) -> tuple[str, ...]:
    """Note with the status of a simulation and the reason for it; no note if the status is ``ok``."""
    return () if status == "ok" else (f"the run ended {status}: {printable(reason, LONGEST_NOTE)}",)


def _channels(raw: RawFile) -> dict[str, Channel]:
    channels = {}
    low, high = raw.number("band_low_hz"), raw.number("band_high_hz")
    bearing, state = raw.text("bearing"), raw.text("state")
    if state is not None and state not in tuple(Fault):
        raise DataError(f"{raw.path}: state {state!r} is not one of {', '.join(Fault)}.")
    # A path is ignored, so that no file makes the program open another file.
    named = bearing and re.fullmatch(r"[\w .+-]{1,80}", bearing) and not bearing.endswith(".toml")
    facts: dict[str, Any] = {"bearing": bearing if named else None, "state": None if state is None else Fault(state)}
    facts |= {"band_hz": (low, high)} if low is not None and high is not None else {}
    for variable in raw.arrays:
        if variable.startswith(PREFIX) and variable.endswith(SUFFIX):
            name = variable.removesuffix(SUFFIX).removeprefix(PREFIX + "_") or PREFIX
            channels[name] = Channel(samples=raw.signal(variable), unit="m/s2", variable=variable, **facts)
    return channels
