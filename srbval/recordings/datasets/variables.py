"""Recognisers for data sets of plain named variables, by the rules of the description.

The records of Case Western Reserve University state no sampling rate, label or unit; the record number in the variable
names (``X105_DE_time``) gives all three from the data set's list (`records` of the description).
"""

import re

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings.datasets.description import DatasetDescription, RecordRange
from srbval.recordings.raw import RawFile, printable
from srbval.recordings.reading import N_PER_KN, Channel, Reading, scaled
from srbval.recordings.recording import ShaftSpeed, SpeedSignal
from srbval.recordings.speed import RPM_PER_HZ, tachometer_speed

N_PER_LBF = 4.4482216152605
HZ_PER_KHZ = 1e3
LONGEST_NOTE = 300
_CWRU_SIGNAL = re.compile(r"X(\d+)_(DE|FE|BA)_time")


def read_variables(raw: RawFile, description: DatasetDescription) -> Reading | None:
    """Apply the description's rules; None if the file is not of this set."""
    groups = description.match.groups(raw)
    if groups is None:
        return None
    state = description.state_of(groups.get("label"))
    channels = _channels(raw, description, state)
    if not channels:
        return None
    rule, rate, said = description.speed, description.rate, dict(groups)
    load, nominal_hz = description.load_lbf_variable, rule.nominal_hz_variable
    radial_kn, axial_kn = (said.get(key, getattr(description, key)) for key in ("radial_kn", "axial_kn"))
    radial_n = scaled(raw.number(load), N_PER_LBF) if load else scaled(radial_kn, N_PER_KN)
    nominal_rpm = float(said["rpm"]) if "rpm" in said else rule.nominal_rpm
    if nominal_hz is not None:
        nominal_rpm = scaled(raw.number(nominal_hz), RPM_PER_HZ)
    fs_hz = (raw.number(rate.variable) if rate.variable else None) or rate.value_hz
    speed_signal = None
    if rule.tachometer_rpm and raw.array(rule.tachometer_rpm) is not None:
        tachometer_hz = raw.signal(rule.tachometer_rpm) / RPM_PER_HZ
        if fs_hz is not None:  # over the whole record, whatever its own rate
            seconds = max(c.samples.size for c in channels.values()) / fs_hz
            speed_signal = SpeedSignal(values_hz=tachometer_hz, rate_hz=tachometer_hz.size / seconds)
        rate_hz = None if speed_signal is None else speed_signal.rate_hz
        speed: ShaftSpeed | None = tachometer_speed(tachometer_hz, rate_hz)
    else:
        speed = rule.speed(raw.number(rule.stated_rpm) if rule.stated_rpm else None, nominal_rpm)
    used = [rule for rule in description.channels if rule.name in channels]
    marked = [rule.name for rule in used if rule.analyse]
    original = raw.attributes.get("copy_of")  # of a compact copy, such as the records that come with the program
    notes = [*description.notes, *(f"{rule.name}: {rule.note}" for rule in used if rule.note)]
    notes += [rate.note] if rate.note else []
    notes += [f"compact copy of {printable(original, LONGEST_NOTE)}"] if isinstance(original, str) else []
    return Reading(
        dataset=description.name,
        channels=channels,
        channel=marked[0] if marked else next(iter(channels)) if len(channels) == 1 else None,
        fs_hz=fs_hz,
        speed=speed,
        speed_signal=speed_signal,
        radial_n=radial_n,
        axial_n=scaled(axial_kn, N_PER_KN),
        nominal_rpm=nominal_rpm,
        notes=tuple(notes),
    )


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


def read_cwru(raw: RawFile, description: DatasetDescription) -> Reading | None:
    """Drive-end channel, or fan-end if the fault is there; stray arrays and other records are left out."""
    groups = description.match.groups(raw)
    if groups is None:
        return None
    numbers = sorted({int(m[1]) for name in raw.variables if (m := _CWRU_SIGNAL.fullmatch(name))})
    number = numbers[0] if len(numbers) == 1 else int(groups.get("record", -1))
    if number not in numbers:
        raise DataError(
            f"{raw.path}: holds CWRU records {', '.join(map(str, numbers))} and its name gives none of them; "
            f"name the file after the record to read, for instance {numbers[0]}.mat."
        )
    entry = next((r for r in description.records if r.first <= number <= r.last), None)
    others = [f"{n:03d}" for n in numbers if n != number]
    state = description.state_of(groups.get("label") or (entry.label if entry else None))
    end = (groups.get("end") or (entry.end if entry else None) or "DE").upper()
    channels = {}
    for rule in description.channels:
        variable = f"X{number:03d}_{rule.name}_time"
        if raw.array(variable) is not None:
            here = state if rule.name == end or state is Fault.HEALTHY else None
            channels[rule.name] = rule.channel(raw, variable, here)
    if not channels:
        raise DataError(f"{raw.path}: CWRU record {number} without a numeric signal.")
    named_hz = scaled(groups.get("rate_khz"), HZ_PER_KHZ)
    if named_hz and entry and named_hz != entry.fs_hz:
        raise DataError(
            f"{raw.path}: its name says {named_hz:g} Hz, the data set's list {entry.fs_hz:g} Hz for this record; "
            "rename the file or correct the list."
        )
    nominal_rpm = _cwru_nominal_rpm(number, groups, entry, description.speed.nominal_rpm_by_load)
    return Reading(
        dataset=description.name,
        channels=channels,
        channel=end if end in channels else next(iter(channels)),
        fs_hz=named_hz or (entry.fs_hz if entry else None),
        speed=description.speed.speed(raw.number(f"X{number:03d}RPM"), nominal_rpm),
        nominal_rpm=nominal_rpm,
        notes=(
            f"record {number} by its variables' names",
            *description.notes,
            *((entry.note,) if entry and entry.note else ()),
            *((f"left out: signals of record {', '.join(others)}",) if others else ()),
        ),
        cautions=tuple(
            f"its name says {groups[key]}, the data set's list {value} for record {number}: the name is used"
            for key, value in (("label", entry and entry.label), ("end", entry and entry.end))
            if value and groups.get(key, value).upper() != value.upper()
        ),
    )


def _cwru_nominal_rpm(
    number: int, groups: dict[str, str], entry: RecordRange | None, by_load: tuple[float, ...]
) -> float | None:
    """Set speed of the motor load, from the file's name or the record's position among its four loads."""
    if "hp" in groups:
        load = int(groups["hp"])
    elif entry is not None and entry.last - entry.first == len(by_load) - 1:
        load = number - entry.first
    else:
        return None
    return by_load[load] if load < len(by_load) else None
