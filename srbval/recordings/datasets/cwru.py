"""Recogniser for the Case Western Reserve University records: ``X105_DE_time``, ``X105RPM``.

The files state no sampling rate, label or unit. The record number in the variable names gives all three,
from the data set's own list (`records` of the description); the file's name, where it states the same
things, is checked against it.
"""

import re

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings.datasets.description import DatasetDescription, RecordRange
from srbval.recordings.raw import RawFile
from srbval.recordings.reading import Channel, Reading

_SIGNAL = re.compile(r"X(\d+)_(DE|FE|BA)_time")
HZ_PER_KHZ = 1e3


def read_cwru(raw: RawFile, description: DatasetDescription) -> Reading | None:
    """Drive-end channel, or fan-end if the fault is there; stray arrays and other records are left out."""
    groups = description.match.groups(raw)
    if groups is None:
        return None
    number = _record_number(raw, groups)
    entry = next((r for r in description.records if r.first <= number <= r.last), None)
    others = {m[1] for name in raw.variables if (m := _SIGNAL.fullmatch(name)) and int(m[1]) != number}
    label = groups.get("label") or (entry.label if entry else None)
    end = groups.get("end") or (entry.end if entry else None) or "DE"
    channels = _channels(raw, number, end.upper(), label, description)
    nominal_rpm = _nominal_rpm(number, groups, entry, description)
    return Reading(
        dataset=description.name,
        channels=channels,
        channel=end.upper() if end.upper() in channels else next(iter(channels)),
        fs_hz=_rate(raw, groups, entry),
        speed=description.speed.speed(raw.number(f"X{number:03d}RPM"), nominal_rpm),
        nominal_rpm=nominal_rpm,
        notes=(
            f"record {number} by its variables' names",
            *description.notes,
            *((entry.note,) if entry and entry.note else ()),
            *((f"left out: signals of record {', '.join(sorted(others))}",) if others else ()),
        ),
        cautions=tuple(
            f"its name says {groups[key]}, the data set's list {value} for record {number}: the name is used"
            for key, value in (("label", entry and entry.label), ("end", entry and entry.end))
            if value and groups.get(key, value).upper() != value.upper()
        ),
    )


def _record_number(raw: RawFile, groups: dict[str, str]) -> int:
    """The record whose signals the file holds; of several, the one in its name."""
    numbers = sorted({int(m[1]) for name in raw.variables if (m := _SIGNAL.fullmatch(name))})
    named = int(groups.get("record", -1))
    if len(numbers) == 1:
        return numbers[0]
    if named in numbers:
        return named
    raise DataError(
        f"{raw.path}: holds CWRU records {', '.join(map(str, numbers))} and its name gives none of them; "
        f"name the file after the record to read, for instance {numbers[0]}.mat."
    )


def _channels(
    raw: RawFile, number: int, end: str, label: str | None, description: DatasetDescription
) -> dict[str, Channel]:
    state = description.state_of(label)
    channels = {}
    for rule in description.channels:
        variable = f"X{number:03d}_{rule.name}_time"
        if raw.array(variable) is None:
            continue
        here = state if rule.name == end or state is Fault.HEALTHY else None
        channels[rule.name] = rule.channel(raw, variable, here)
    if not channels:
        raise DataError(f"{raw.path}: CWRU record {number} without a numeric signal.")
    return channels


def _rate(raw: RawFile, groups: dict[str, str], entry: RecordRange | None) -> float | None:
    named = float(groups["rate_khz"]) * HZ_PER_KHZ if "rate_khz" in groups else None
    listed = entry.fs_hz if entry else None
    if named and listed and named != listed:
        raise DataError(
            f"{raw.path}: its name says {named:g} Hz, the data set's list {listed:g} Hz for this record; "
            "rename the file or correct the list."
        )
    return named or listed


def _nominal_rpm(
    number: int, groups: dict[str, str], entry: RecordRange | None, description: DatasetDescription
) -> float | None:
    """Set speed of the motor load, from the file's name or the record's position among its four loads."""
    by_load = description.speed.nominal_rpm_by_load
    if "hp" in groups:
        load = int(groups["hp"])
    elif entry is not None and entry.last - entry.first == len(by_load) - 1:
        load = number - entry.first
    else:
        return None
    return by_load[load] if load < len(by_load) else None
