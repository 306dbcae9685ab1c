"""Recogniser for data sets of plain named variables: all it knows is in the description."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings.datasets.description import ChannelRule, DatasetDescription, MatchRule, SpeedRule
from srbval.recordings.raw import RawFile, as_signal
from srbval.recordings.reading import Channel, Reading
from srbval.recordings.recording import ShaftSpeed, SpeedSignal
from srbval.recordings.speed import RPM_PER_HZ, nominal_speed, stated_speed, tachometer_speed

N_PER_KN = 1e3
N_PER_LBF = 4.4482216152605


def read_variables(raw: RawFile, description: DatasetDescription) -> Reading | None:
    """Apply the description's rules; None if the file is not of this set."""
    groups = match_groups(raw, description)
    if groups is None:
        return None
    state = state_of(groups.get("label"), description)
    channels = _channels(raw, description, state)
    if not channels:
        return None
    nominal_rpm = _nominal_rpm(raw, groups, description.speed)
    tachometer, fs_hz = _tachometer_hz(raw, description.speed), _rate(raw, description)
    speed = _speed(raw, description.speed, nominal_rpm) if tachometer is None else tachometer_speed(tachometer)
    marked = [rule.name for rule in description.channels if rule.analyse and rule.name in channels]
    used = [rule for rule in description.channels if rule.name in channels and rule.note]
    notes = (*description.notes, *(f"{rule.name}: {rule.note}" for rule in used))
    return Reading(
        dataset=description.name,
        channels=channels,
        channel=marked[0] if marked else next(iter(channels)) if len(channels) == 1 else None,
        fs_hz=fs_hz,
        speed=speed,
        speed_signal=_speed_signal(tachometer, channels, fs_hz),
        radial_n=_radial_n(raw, groups, description),
        axial_n=_kn(groups.get("axial_kn", description.axial_kn)),
        nominal_rpm=nominal_rpm,
        notes=notes + ((description.rate.note,) if description.rate.note else ()),
    )


def match_groups(raw: RawFile, description: DatasetDescription) -> dict[str, str] | None:
    """What the file's name says (empty if renamed); None if the file is not of this set."""
    rule = description.match
    found = re.search(rule.file, raw.path.name, re.IGNORECASE) if rule.file else None
    if found is None and rule.file_required:
        return None
    if rule.columns and not (raw.format == "text" and len(raw.variables) in rule.columns):
        return None
    if not all(any(re.fullmatch(p, name) for name in raw.variables) for p in rule.variables):
        return None
    if rule.vectors is not None and sum(_is_vector(raw, name) for name in raw.variables) != rule.vectors:
        return None
    groups = {key: value for key, value in found.groupdict().items() if value is not None} if found else {}
    return groups | _inside(raw, rule)


def _is_vector(raw: RawFile, name: str) -> bool:
    array = raw.array(name)
    return array is not None and array.size > 1


def _inside(raw: RawFile, rule: MatchRule) -> dict[str, str]:
    """What the file itself says of its label and nominal speed."""
    label = raw.text(rule.label_variable) if rule.label_variable else None
    rpm = raw.number(rule.nominal_rpm_variable) if rule.nominal_rpm_variable else None
    return ({"label": label} if label else {}) | ({"rpm": str(rpm)} if rpm else {})


def state_of(label: str | None, description: DatasetDescription) -> Fault | None:
    """State for a label of the file's name or of the file, by the description's table."""
    rules = description.labels if label is not None else ()
    return next((r.state for r in rules if re.search(r.label, label or "", re.IGNORECASE)), None)


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
            channels[rule.name] = _channel(raw, rule, name, state)
    return channels


def _channel(raw: RawFile, rule: ChannelRule, variable: str, state: Fault | None) -> Channel:
    array = raw.variables[variable]
    assert not isinstance(array, str)
    if max(array.shape) != array.size:
        raise DataError(f"{raw.path}: {variable} has shape {array.shape}; one vector of samples is needed.")
    samples = as_signal(array, f"{raw.path}: {variable}")
    return Channel(samples=samples, unit=rule.unit, bearing=rule.bearing, state=state, variable=variable)


def _rate(raw: RawFile, description: DatasetDescription) -> float | None:
    variable = description.rate.variable
    return (raw.number(variable) if variable else None) or description.rate.value_hz


def _nominal_rpm(raw: RawFile, groups: dict[str, str], rule: SpeedRule) -> float | None:
    if rule.nominal_hz_variable is not None:
        nominal_hz = raw.number(rule.nominal_hz_variable)
        return None if nominal_hz is None else nominal_hz * RPM_PER_HZ
    return float(groups["rpm"]) if "rpm" in groups else rule.nominal_rpm


def _tachometer_hz(raw: RawFile, rule: SpeedRule) -> NDArray[np.float64] | None:
    signal = raw.array(rule.tachometer_rpm) if rule.tachometer_rpm else None
    return None if signal is None else as_signal(signal, f"{raw.path}: {rule.tachometer_rpm}") / RPM_PER_HZ


def _speed_signal(
    tachometer: NDArray[np.float64] | None, channels: dict[str, Channel], fs_hz: float | None
) -> SpeedSignal | None:
    """The tachometer over the whole record, whatever its own rate is."""
    if tachometer is None or fs_hz is None:
        return None
    seconds = max(c.samples.size for c in channels.values()) / fs_hz
    return SpeedSignal(values_hz=tachometer, rate_hz=tachometer.size / seconds)


def _speed(raw: RawFile, rule: SpeedRule, nominal_rpm: float | None) -> ShaftSpeed | None:
    stated = raw.number(rule.stated_rpm) if rule.stated_rpm else None
    if stated is not None:
        return stated_speed(stated, rule.stated_ci95_rpm)
    return None if nominal_rpm is None else nominal_speed(nominal_rpm, rule.nominal_ci95_pct)


def _radial_n(raw: RawFile, groups: dict[str, str], description: DatasetDescription) -> float | None:
    if description.load_lbf_variable is not None:
        load_lbf = raw.number(description.load_lbf_variable)
        return None if load_lbf is None else load_lbf * N_PER_LBF
    return _kn(groups.get("radial_kn", description.radial_kn))


def _kn(load: str | float | None) -> float | None:
    return None if load is None else float(load) * N_PER_KN
