"""Recogniser for data sets of plain named variables: it only applies the rules of the description."""

import re

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings.datasets.description import DatasetDescription, SpeedRule
from srbval.recordings.raw import RawFile, printable
from srbval.recordings.reading import N_PER_KN, Channel, Reading
from srbval.recordings.recording import SpeedSignal
from srbval.recordings.speed import RPM_PER_HZ, tachometer_speed

N_PER_LBF = 4.4482216152605
LONGEST_NOTE = 300


def read_variables(raw: RawFile, description: DatasetDescription) -> Reading | None:
    """Apply the description's rules; None if the file is not of this set."""
    groups = description.match.groups(raw)
    if groups is None:
        return None
    state = description.state_of(groups.get("label"))
    channels = _channels(raw, description, state)
    if not channels:
        return None
    nominal_rpm = _nominal_rpm(raw, groups, description.speed)
    rate, tachometer_rpm = description.rate, description.speed.tachometer_rpm
    fs_hz = (raw.number(rate.variable) if rate.variable else None) or rate.value_hz
    measured = tachometer_rpm is not None and raw.array(tachometer_rpm) is not None
    tachometer = raw.signal(tachometer_rpm) / RPM_PER_HZ if tachometer_rpm and measured else None
    if tachometer is None:
        stated = description.speed.stated_rpm
        speed = description.speed.speed(raw.number(stated) if stated else None, nominal_rpm)
    else:
        speed = tachometer_speed(tachometer)
    speed_signal = None
    if tachometer is not None and fs_hz is not None:  # over the whole record, whatever its own rate
        seconds = max(c.samples.size for c in channels.values()) / fs_hz
        speed_signal = SpeedSignal(values_hz=tachometer, rate_hz=tachometer.size / seconds)
    marked = [rule.name for rule in description.channels if rule.analyse and rule.name in channels]
    used = [rule for rule in description.channels if rule.name in channels and rule.note]
    notes = (*description.notes, *(f"{rule.name}: {rule.note}" for rule in used))
    return Reading(
        dataset=description.name,
        channels=channels,
        channel=marked[0] if marked else next(iter(channels)) if len(channels) == 1 else None,
        fs_hz=fs_hz,
        speed=speed,
        speed_signal=speed_signal,
        radial_n=_radial_n(raw, groups, description),
        axial_n=_kn(groups.get("axial_kn", description.axial_kn)),
        nominal_rpm=nominal_rpm,
        notes=notes + ((description.rate.note,) if description.rate.note else ()) + _copy_of(raw),
    )


def _copy_of(raw: RawFile) -> tuple[str, ...]:
    """What the compact copy of a published file says of it, as those that come with the program do."""
    original = raw.attributes.get("copy_of")
    return (f"compact copy of {printable(original, LONGEST_NOTE)}",) if isinstance(original, str) else ()


def _channels(raw: RawFile, description: DatasetDescription, state: Fault | None) -> dict[str, Channel]:
    channels: dict[str, Channel] = {}
    for rule in description.channels:
        for name in raw.variables:
            array = raw.array(name)
            if array is None or array.size < 2 or not re.fullmatch(rule.variable, name):
                continue
            if rule.name in channels:
                first = channels[rule.name].variable
                raise DataError(f"{raw.path}: both {first} and {name} could be {rule.name}.")
            if max(array.shape) != array.size:
                raise DataError(f"{raw.path}: {name} has shape {array.shape}; one vector of samples is needed.")
            channels[rule.name] = rule.channel(raw, name, state)
    return channels


def _nominal_rpm(raw: RawFile, groups: dict[str, str], rule: SpeedRule) -> float | None:
    if rule.nominal_hz_variable is not None:
        nominal_hz = raw.number(rule.nominal_hz_variable)
        return None if nominal_hz is None else nominal_hz * RPM_PER_HZ
    return float(groups["rpm"]) if "rpm" in groups else rule.nominal_rpm


def _radial_n(raw: RawFile, groups: dict[str, str], description: DatasetDescription) -> float | None:
    if description.load_lbf_variable is not None:
        load_lbf = raw.number(description.load_lbf_variable)
        return None if load_lbf is None else load_lbf * N_PER_LBF
    return _kn(groups.get("radial_kn", description.radial_kn))


def _kn(load: str | float | None) -> float | None:
    return None if load is None else float(load) * N_PER_KN
