"""Interpretation of files with named variables by the rules of a `DatasetDescription`.

In a data set with numbered records, variable names contain the number (``X105_DE_time``). For each record number,
the description's list `records` states fault label, sampling rate and the motor end with the faulty bearing; a label
or an end in the file's name is preferred, a different sampling rate in the name is an error.
"""

import re
from collections.abc import Iterator
from typing import Any

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings.datasets.description import ChannelRule, DatasetDescription
from srbval.recordings.raw import RawFile, printable
from srbval.recordings.reading import N_PER_KN, Channel, Reading, scaled
from srbval.recordings.recording import ShaftSpeed, SpeedSignal
from srbval.recordings.speed import RPM_PER_HZ, stated_speed, tachometer_speed

N_PER_LBF = 4.4482216152605
HZ_PER_KHZ = 1e3
MAX_COPY_NOTE_LENGTH = 300


def read_variables(raw: RawFile, description: DatasetDescription) -> Reading | None:
    """Interpret a file by the rules of the description; None if the file does not belong to this data set."""
    named = description.match.groups(raw)
    if named is None:
        return None
    record, others = _record_number(raw, description, named)
    listed = next((r for r in description.records if record and r["first"] <= int(record) <= r["last"]), {})
    facts = {**listed, **named}
    state, end = description.state_of(facts.get("label")), facts.get("end", "").upper()
    used = dict(_match_channels(raw, description, record))
    channels = {
        rule.name: Channel(
            samples=raw.signal(variable),
            unit=rule.unit,
            bearing=rule.bearing,
            state=state if state is Fault.HEALTHY or end in ("", rule.name) else None,
            variable=variable,
        )
        for rule, variable in used.items()
    }
    if not channels:
        return None
    marked = [name for name in (end, *(rule.name for rule in used if rule.analyse)) if name in channels]
    fs_hz, nominal_rpm = _rate_hz(raw, description, facts), _nominal_rpm(raw, description, facts, record)
    seconds = None if fs_hz is None else max(c.samples.size for c in channels.values()) / fs_hz
    speed, speed_signal = _speed(raw, description, record, nominal_rpm, seconds)
    radial_n = scaled(facts.get("radial_kn", description.radial_kn), N_PER_KN)
    if description.load_lbf_variable is not None:
        radial_n = scaled(raw.number(description.load_lbf_variable), N_PER_LBF)
    original = raw.attributes.get("copy_of")  # in a compact copy, such as the shipped records
    notes = [f"record {int(record)} by its variables' names"] if record else []
    notes += [*description.notes, *(f"{rule.name}: {rule.note}" for rule in used if rule.note)]
    notes += [listed["note"]] if "note" in listed else []
    notes += [f"left out: signals of record {', '.join(others)}"] if others else []
    notes += [f"compact copy of {printable(original, MAX_COPY_NOTE_LENGTH)}"] if isinstance(original, str) else []
    return Reading(
        dataset=description.name,
        channels=channels,
        channel=marked[0] if marked else next(iter(channels)) if len(channels) == 1 else None,
        fs_hz=fs_hz,
        speed=speed,
        speed_signal=speed_signal,
        radial_n=radial_n,
        axial_n=scaled(facts.get("axial_kn", description.axial_kn), N_PER_KN),
        nominal_rpm=nominal_rpm,
        notes=tuple(notes),
        cautions=tuple(
            f"its name states {facts[key]}, the data set's list {listed[key]} for record {int(record)}: "
            "the name is used"
            for key in ("label", "end")
            if key in listed and facts[key].upper() != listed[key].upper()
        ),
    )


def _record_number(raw: RawFile, description: DatasetDescription, named: dict[str, str]) -> tuple[str, list[str]]:
    """Return the record number to read (empty if no variable name contains a number), and other record numbers."""
    rules = description.channels if description.records else ()
    found = (re.fullmatch(rule.variable, name) for rule in rules for name in raw.variables)
    numbers = sorted({match["record"] for match in found if match})
    chosen = numbers if len(numbers) < 2 else [n for n in numbers if int(n) == int(named.get("record", -1))]
    if numbers and not chosen:
        several = ", ".join(str(int(n)) for n in numbers)
        raise DataError(
            f"{raw.path}: contains {description.name} records {several}, and its name states none of them; name the "
            f"file after the record to read, for instance {int(numbers[0])}.mat."
        )
    return "".join(chosen), [n for n in numbers if n not in chosen]


def _match_channels(raw: RawFile, description: DatasetDescription, record: str) -> Iterator[tuple[ChannelRule, str]]:
    """Yield the rule and the variable name of each channel of `record` in the file."""
    arrays = {name: array for name in raw.variables if (array := raw.array(name)) is not None and array.size > 1}
    for rule in description.channels:
        matches = [match for name in arrays if (match := re.fullmatch(rule.variable, name))]
        names = [match[0] for match in matches if match.groupdict().get("record", record) == record]
        if len(names) > 1:
            raise DataError(f"{raw.path}: variables {names[0]} and {names[1]} both match channel {rule.name}.")
        for name in names:
            shape = arrays[name].shape
            if max(shape) != arrays[name].size:
                raise DataError(f"{raw.path}: {name} has shape {shape}; one vector of samples is needed.")
            yield rule, name


def _rate_hz(raw: RawFile, description: DatasetDescription, facts: dict[str, Any]) -> float | None:
    """Sampling rate [Hz]: stated in `facts` about the file, otherwise in its variables, otherwise in `description`."""
    named_hz, listed_hz = scaled(facts.get("rate_khz"), HZ_PER_KHZ), facts.get("fs_hz")
    if named_hz and listed_hz and named_hz != listed_hz:
        raise DataError(
            f"{raw.path}: its name states {named_hz:g} Hz, the data set's list {listed_hz:g} Hz for this record; "
            "rename the file or correct the list."
        )
    stated_hz = raw.number(description.rate_variable) if description.rate_variable else None
    return named_hz or listed_hz or stated_hz or description.rate_hz


def _nominal_rpm(raw: RawFile, description: DatasetDescription, facts: dict[str, Any], record: str) -> float | None:
    """Nominal speed [rpm], as `description` states: from a variable, the motor load, the file's name or a constant."""
    if description.nominal_hz_variable is not None:
        return scaled(raw.number(description.nominal_hz_variable), RPM_PER_HZ)
    by_load = description.nominal_rpm_by_load
    load = int(facts.get("hp", len(by_load)))
    if "hp" not in facts and "first" in facts and facts["last"] - facts["first"] == len(by_load) - 1:
        load = int(record) - facts["first"]
    return by_load[load] if load < len(by_load) else scaled(facts.get("rpm", description.nominal_rpm), 1.0)


def _speed(
    raw: RawFile, description: DatasetDescription, record: str, nominal_rpm: float | None, seconds: float | None
) -> tuple[ShaftSpeed | None, SpeedSignal | None]:
    """Shaft speed (from a tachometer, else stated, else nominal) and tachometer signal; `seconds` is the duration."""
    tachometer, stated = description.tachometer_rpm, description.stated_rpm
    if tachometer and raw.array(tachometer) is not None:
        values_hz, signal = raw.signal(tachometer) / RPM_PER_HZ, None
        if seconds is not None:  # its samples cover the whole record at any rate
            signal = SpeedSignal(values_hz=values_hz, rate_hz=values_hz.size / seconds)
        return tachometer_speed(values_hz, None if signal is None else signal.rate_hz), signal
    rpm = raw.number(stated.format(record=record)) if stated else None
    return description.set_point(nominal_rpm) if rpm is None else stated_speed(rpm), None
