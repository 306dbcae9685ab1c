"""Interpretation of files of known data sets, by the rules of a `DatasetDescription`.

In a data set with numbered records, variable names contain the number (``X105_DE_time``). A label or an end in the
file's name is preferred to the one in the description's list `records`; a different sampling rate is an error.

Full recordings of the test rig at Politecnico di Torino have structs ``Signal_k`` with ``x_values`` and ``y_values``
(exported by LMS Test.Lab). The text ``y_values.quantity.label`` is the unit in which values are displayed;
``unit_transformation.factor`` converts stored values, usually in SI units, to this unit.
"""

import math
import re
from collections.abc import Callable, Iterator
from typing import Any

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings.datasets.description import ChannelRule, DatasetDescription
from srbval.recordings.raw import RawFile, as_signal, orient_samples, printable
from srbval.recordings.reading import N_PER_KN, Channel, Reading, scaled
from srbval.recordings.speed import RPM_PER_HZ, stated_speed, with_tachometer
from srbval.scene.parts import STANDARD_GRAVITY_M_S2

N_PER_LBF = 4.4482216152605
HZ_PER_KHZ = 1e3
MAX_COPY_NOTE_LENGTH = 300
_STRUCT = re.compile(r"(Signal_?\d*)\.y_values\.values")
FACTOR_TOLERANCE = 2e-3  # 0.1020 for 1/9.80665 is off by 3e-4
# Factors from a display unit to SI (m/s2, rad/s), by the label of a quantity.
ACCELERATION_TO_SI = {"g": STANDARD_GRAVITY_M_S2, "m/s2": 1.0, "m/s^2": 1.0}
ROTATION_TO_SI = {"rpm": math.pi / 30, "rad/s": 1.0, "Hz": 2 * math.pi}
StructSignal = tuple[list[FloatArray], float]  # samples [n] of each column in SI units, and sampling rate [Hz]


def read_variables(raw: RawFile, description: DatasetDescription) -> Reading | None:
    """Interpret a file by the rules of the description; None if the file does not belong to this data set."""
    named = description.match.groups(raw)
    if named is None:
        return None
    record, others = _record_number(raw, description, named)
    listed = next((r for r in description.records if record and r["first"] <= int(record) <= r["last"]), {})
    places = {fact: variable.format(record=record) for fact, variable in description.fact_variables.items()}
    stated = {fact: raw.text(place) if fact == "label" else raw.number(place) for fact, place in places.items()}
    facts = {**description.constants, **listed, **named}
    facts |= {fact: value for fact, value in stated.items() if value not in (None, "")}
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
    named_hz, listed_hz = scaled(facts.get("rate_khz"), HZ_PER_KHZ), listed.get("fs_hz")
    if named_hz and listed_hz and named_hz != listed_hz:
        raise DataError(
            f"{raw.path}: its name states {named_hz:g} Hz, the data set's list {listed_hz:g} Hz for this record; "
            "rename the file or correct the list."
        )
    fs_hz = named_hz or facts.get("fs_hz")
    nominal_rpm = _nominal_rpm(description, facts, record)
    rpm, radial_n = facts.get("mean_rpm"), scaled(facts.get("radial_kn"), N_PER_KN)
    if "radial_lbf" in facts:
        radial_n = scaled(facts["radial_lbf"], N_PER_LBF)
    original = raw.attributes.get("copy_of")  # in a compact copy, such as the shipped records
    notes = [f"record {int(record)} by its variables' names"] if record else []
    notes += [*description.notes, *(f"{rule.name}: {rule.note}" for rule in used if rule.note)]
    notes += [listed["note"]] if "note" in listed else []
    notes += [f"left out: signals of record {', '.join(others)}"] if others else []
    notes += [f"compact copy of {printable(original, MAX_COPY_NOTE_LENGTH)}"] if isinstance(original, str) else []
    reading = Reading(
        dataset=description.name,
        channels=channels,
        channel=marked[0] if marked else next(iter(channels)) if len(channels) == 1 else None,
        fs_hz=fs_hz,
        speed=description.set_point(nominal_rpm) if rpm is None else stated_speed(rpm),
        radial_n=radial_n,
        axial_n=scaled(facts.get("axial_kn"), N_PER_KN),
        nominal_rpm=nominal_rpm,
        notes=tuple(notes),
        cautions=tuple(
            f"its name states {facts[key]}, the data set's list {listed[key]} for record {int(record)}: "
            "the name is used"
            for key in ("label", "end")
            if key in listed and facts[key].upper() != listed[key].upper()
        ),
    )
    if (tachometer := description.tachometer_rpm) is None or tachometer not in raw.arrays:
        return reading
    values_hz = raw.signal(tachometer) / RPM_PER_HZ
    rate_hz = values_hz.size / (reading.main.samples.size / fs_hz) if fs_hz else None  # it covers the whole record
    rotation = Channel(samples=values_hz, unit="Hz", variable=tachometer, fs_hz=rate_hz)
    return with_tachometer(reading, rotation, pulses_per_rev=None, rpm=None)


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
    arrays = {name: array for name, array in raw.arrays.items() if array.size > 1}
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


def _nominal_rpm(description: DatasetDescription, facts: dict[str, Any], record: str) -> float | None:
    """Nominal speed [rpm], as `facts` state, else by the motor load."""
    if "nominal_hz" in facts:
        return scaled(facts["nominal_hz"], RPM_PER_HZ)
    by_load = description.nominal_rpm_by_load
    load = int(facts.get("hp", len(by_load)))
    if "hp" not in facts and "first" in facts and facts["last"] - facts["first"] == len(by_load) - 1:
        load = int(record) - facts["first"]
    return by_load[load] if load < len(by_load) else scaled(facts.get("rpm"), 1.0)


def read_signal_structs(raw: RawFile, description: DatasetDescription) -> Reading | None:
    """Read acceleration and speed from the structs of a file; None if no struct contains an acceleration.

    Other rigs export the same layout, so the bearing is known only if the file's name matches `description`. The user
    must choose the channel if there are several and `description` does not list them.
    """
    names = [m[1] for variable in raw.variables if (m := _STRUCT.fullmatch(variable))]
    accelerations = {n: one for n in names if (one := _signal(raw, n, ACCELERATION_TO_SI))}
    if not accelerations:
        return None
    groups = description.match.groups(raw) or {}
    nominal_rpm = float(groups["rpm"]) if "rpm" in groups else None
    rotations = {n: one for n in names if (one := _signal(raw, n, ROTATION_TO_SI))}
    others = [n for n in names if n not in accelerations | rotations]
    left = [f"{n} ({printable(raw.text(f'{n}.y_values.quantity.label') or '')})" for n in others]
    said = (f"left out: {', '.join(left)}",) if left else ()
    vectors = {n: (columns[0], rate_hz) for n, (columns, rate_hz) in rotations.items() if len(columns) == 1}
    known, first = "label" in groups, next(iter(accelerations))
    sensors, tested = _sensors(raw, accelerations, description if known else None)
    of_the_set = [name for name in sensors if known and tested in (None, name)]
    tested_bearing: dict[str, Any] = {
        "bearing": next((rule.bearing for rule in description.channels if rule.analyse), None),
        "state": description.state_of(groups.get("label")),
    }
    reading = Reading(
        dataset=description.name if known else None,
        channels={
            name: Channel(samples=samples, unit="m/s2", variable=name, **tested_bearing if name in of_the_set else {})
            for name, samples in sensors.items()
        },
        channel=tested,
        fs_hz=accelerations[first][1],
        speed=None if vectors else description.set_point(nominal_rpm),
        speed_problem=f"{len(vectors)} speed signals: {', '.join(vectors)}." if len(vectors) > 1 else None,
        radial_n=scaled(groups.get("radial_kn"), N_PER_KN),
        axial_n=scaled(groups.get("axial_kn"), N_PER_KN),
        nominal_rpm=nominal_rpm,
        notes=(f"acceleration from {first}", *(description.notes if known else ()), *said),
    )
    if len(vectors) != 1:
        return reading
    ((source, (values_rad_s, rate_hz)),) = vectors.items()
    rotation = Channel(samples=values_rad_s * (1 / (2 * math.pi)), unit="Hz", variable=source, fs_hz=rate_hz)
    return with_tachometer(reading, rotation, pulses_per_rev=None, rpm=nominal_rpm)


def _signal(raw: RawFile, name: str, labels: dict[str, float]) -> StructSignal | None:
    """Read struct `name`; None if its display unit is not in `labels`, which maps display units to factors to SI."""
    label = (raw.text(f"{name}.y_values.quantity.label") or "").strip()
    if label not in labels:
        return None
    raw.check_usable(f"{name}.y_values.values")
    values = raw.arrays.get(f"{name}.y_values.values")
    if values is None or values.size == 0:
        raise DataError(f"{raw.path}: {name} ({label}) contains no values.")
    increment = raw.number(f"{name}.x_values.increment")
    if increment is None or increment <= 0:
        raise DataError(f"{raw.path}: {name}.x_values.increment must be a positive time step in seconds.")
    matrix = orient_samples(values)
    count = raw.number(f"{name}.x_values.number_of_values")
    if count is not None and int(count) != len(matrix):
        raise DataError(f"{raw.path}: {name} states {count:.0f} values and contains {len(matrix)}: truncated.")
    columns = [as_signal(column, f"{raw.path}: {name}[{i}]") for i, column in enumerate(matrix.T, 1)]
    factor = raw.number(f"{name}.y_values.quantity.unit_transformation.factor")
    to_si = {1 / labels[label]: 1.0, 1.0: labels[label]}  # by the factor from the stored unit to the display unit
    fitting = [to_si[f] for f in to_si if factor is None or abs(factor / f - 1) < FACTOR_TOLERANCE]
    if not fitting:
        expected = " or ".join(f"{f:.4f}" for f in to_si)
        raise DataError(f"{raw.path}: {name} converts to {label!r} by the factor {factor}; it must be {expected}.")
    in_si = columns if fitting[0] == 1 else [column * fitting[0] for column in columns]
    return in_si, round(1 / increment, 6)


def _sensors(
    raw: RawFile, signals: dict[str, StructSignal], description: DatasetDescription | None
) -> tuple[dict[str, FloatArray], str | None]:
    """Samples by channel; channel to analyse: the sensor at the tested bearing or the only channel, None if unknown."""
    rates = {rate_hz for _, rate_hz in signals.values()}
    if len(rates) > 1:
        raise DataError(f"{raw.path}: several sampling rates, {sorted(rates)} Hz; export signals of one rate per file.")
    layout = description.channels if description is not None else ()
    named = {f"{name}[{i}]": c for name, (columns, _) in signals.items() for i, c in enumerate(columns, 1)}
    if len(signals) == 1 and len(named) == len(layout):
        tested = next(rule.name for rule in layout if rule.analyse)
        return dict(zip((rule.name for rule in layout), named.values(), strict=True)), tested
    return named, next(iter(named)) if len(named) == 1 else None


READERS: dict[str, Callable[[RawFile, DatasetDescription], Reading | None]] = {  # by `reader` of a description
    "variables": read_variables,
    "signal-structs": read_signal_structs,
}
