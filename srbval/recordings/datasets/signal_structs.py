"""Interpretation of files with one struct per quantity: ``Signal_k`` with ``x_values`` and ``y_values``.

Full recordings of the test rig at Politecnico di Torino have this layout (exported by LMS Test.Lab). The text
``y_values.quantity.label`` is the unit in which values are displayed; ``unit_transformation.factor`` converts stored
values, usually in SI units, to this unit.
"""

import math
import re
from typing import Any

from srbval.arrays import FloatArray
from srbval.errors import DataError
from srbval.recordings.datasets.description import DatasetDescription
from srbval.recordings.raw import RawFile, as_signal, orient_samples, printable
from srbval.recordings.reading import N_PER_KN, Channel, Reading, scaled
from srbval.recordings.recording import SpeedSignal
from srbval.recordings.speed import RPM_PER_HZ, tachometer_speed
from srbval.scene.parts import STANDARD_GRAVITY_M_S2

_STRUCT = re.compile(r"(Signal_?\d*)\.y_values\.values")
FACTOR_TOLERANCE = 2e-3  # 0.1020 for 1/9.80665 is off by 3e-4
IMPLAUSIBLE_RATIO = 3.0  # of the speed to the nominal motor speed; rpm instead of rad/s give 9.5

# Factors from a display unit to SI (m/s2, rad/s), by the label of a quantity.
ACCELERATION_TO_SI = {"g": STANDARD_GRAVITY_M_S2, "m/s2": 1.0, "m/s^2": 1.0}
ROTATION_TO_SI = {"rpm": math.pi / 30, "rad/s": 1.0, "Hz": 2 * math.pi}


StructSignal = tuple[list[FloatArray], float]  # samples [n] of each column in SI units, and sampling rate [Hz]


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
    known, speed, signal, note, problem = "label" in groups, None, None, "speed left open", None
    vectors = {n: (columns[0], rate_hz) for n, (columns, rate_hz) in rotations.items() if len(columns) == 1}
    if len(vectors) > 1:
        problem = f"{len(vectors)} speed signals: {', '.join(vectors)}."
    elif not vectors:
        speed, note = description.set_point(nominal_rpm), "no speed signal in the file"
    else:
        ((source, (values_rad_s, rate_hz)),) = vectors.items()
        values_hz = values_rad_s * (1 / (2 * math.pi))
        speed, note = tachometer_speed(values_hz, rate_hz), f"speed from {source}, {rate_hz:g} Hz"
        found_rpm = speed.value_hz * RPM_PER_HZ
        if nominal_rpm and not 1 / IMPLAUSIBLE_RATIO < found_rpm / nominal_rpm < IMPLAUSIBLE_RATIO:
            problem = f"{source} measures {found_rpm:.6g} rpm, the file's name states {nominal_rpm:g}: a wrong unit."
        else:
            signal = SpeedSignal(values_hz=values_hz, rate_hz=rate_hz)
    first = next(iter(accelerations))
    sensors, tested = _sensors(raw, accelerations, description if known else None)
    of_the_set = [name for name in sensors if known and tested in (None, name)]
    tested_bearing: dict[str, Any] = {
        "bearing": next((rule.bearing for rule in description.channels if rule.analyse), None),
        "state": description.state_of(groups.get("label")),
    }
    return Reading(
        dataset=description.name if known else None,
        channels={
            name: Channel(samples=samples, unit="m/s2", variable=name, **tested_bearing if name in of_the_set else {})
            for name, samples in sensors.items()
        },
        channel=tested,
        fs_hz=accelerations[first][1],
        speed=speed,
        speed_signal=signal,
        speed_problem=problem,
        radial_n=scaled(groups.get("radial_kn"), N_PER_KN),
        axial_n=scaled(groups.get("axial_kn"), N_PER_KN),
        nominal_rpm=nominal_rpm,
        notes=(f"acceleration from {first}", note, *(description.notes if known else ()), *said),
    )


def _signal(raw: RawFile, name: str, labels: dict[str, float]) -> StructSignal | None:
    """Read struct `name`; None if its display unit is not in `labels`, which maps display units to factors to SI."""
    label = (raw.text(f"{name}.y_values.quantity.label") or "").strip()
    if label not in labels:
        return None
    raw.check_usable(f"{name}.y_values.values")
    values = raw.array(f"{name}.y_values.values")
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
