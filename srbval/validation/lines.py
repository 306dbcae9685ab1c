"""The lines of a bearing in a recording: race, roller and cage lines, their harmonics and sidebands."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from srbval.bearing import Bearing
from srbval.recordings.recording import ShaftSpeed
from srbval.signal import LineReading, Periodogram, read_comb
from srbval.validation.families import Family, Found, families_of, find_families


@dataclass(frozen=True, kw_only=True)
class Line:
    """One line. `ci95_hz` is the reading's own 95 % half width; the speed's enters only the deviation's.

    `snr` is power over local mean noise power in the squared envelope spectrum, `depth` the line's amplitude
    there over the squared envelope's mean. The first harmonic comes from the joint fit of all, and so does
    its `false_alarm`; the others are read one by one. A sideband counts only with its own line.
    `explained_by` names the stronger line whose frequency this one is a simple multiple of. Values are
    None where the line is out of the record's reach.
    """

    name: str
    harmonic: int
    kinematic_hz: float
    found_hz: float | None = None
    ci95_hz: float | None = None
    deviation_pct: float | None = None
    deviation_ci95_pct: float | None = None
    snr: float | None = None
    depth: float | None = None
    false_alarm: float | None = None
    detected: bool = False
    explained_by: str | None = None


def read_lines(record: Periodogram, bearing: Bearing, speed: ShaftSpeed) -> tuple[Line, ...]:
    """All lines of `bearing` in `record`, a periodogram of the squared envelope, family by family.

    A family that cannot be read (out of reach, hidden by the shaft) leaves one line without values.
    """
    found = find_families(record, bearing, speed)
    return tuple(
        line
        for family in families_of(bearing, speed.value_hz)
        for line in _lines_of(family, found.get(family.name), speed)
    )


def _lines_of(family: Family, found: Found | None, speed: ShaftSpeed) -> list[Line]:
    first = Line(name=family.name, harmonic=1, kinematic_hz=family.kinematic_hz)
    if found is None:
        return [first]
    first = _measured(first, found.reading, speed)
    first = replace(first, detected=found.detected, explained_by=found.explained_by)
    return [first, *_harmonics(found, speed), *_sidebands(found, speed)]


def _harmonics(found: Found, speed: ShaftSpeed) -> list[Line]:
    lines = []
    for number in range(2, len(found.reading.snr) + 1):
        kinematic = number * found.family.kinematic_hz
        line = Line(name=found.family.name, harmonic=number, kinematic_hz=kinematic)
        lines.append(_read_one(line, found, number, 0.0, speed))
    return lines


def _sidebands(found: Found, speed: ShaftSpeed) -> list[Line]:
    family, lines = found.family, []
    for sign in (-1, 1) if family.sideband_hz else ():
        offset = sign * family.sideband_hz
        name = f"{family.name}{'+' if sign > 0 else '-'}{family.sideband_name}"
        line = Line(name=name, harmonic=1, kinematic_hz=family.kinematic_hz + offset)
        side = _read_one(line, found, 1, offset, speed)
        lines.append(replace(side, detected=side.detected and found.detected))
    return lines


def _read_one(line: Line, found: Found, number: int, offset_hz: float, speed: ShaftSpeed) -> Line:
    """A single line beside the found fundamental, or about its kinematic place where that was not found."""
    record, search = found.record, found.search
    if found.detected:
        centre = number * found.reading.found_hz + offset_hz
        half = record.bin_hz + number * found.reading.ci95_hz + (speed.ci95_hz if offset_hz else 0.0)
    else:
        centre = search.scale * line.kinematic_hz
        half = search.half_window_hz(centre, record.bin_hz)
    reading = read_comb(record, centre, half, harmonics=1, shortest_block_s=search.block_s)
    return line if reading is None else _measured(line, reading, speed)


def _measured(line: Line, reading: LineReading, speed: ShaftSpeed) -> Line:
    relative = math.hypot(reading.ci95_hz / reading.found_hz, speed.ci95_hz / speed.value_hz)
    return replace(
        line,
        found_hz=reading.found_hz,
        ci95_hz=reading.ci95_hz,
        deviation_pct=100 * (reading.found_hz / line.kinematic_hz - 1),
        deviation_ci95_pct=100 * relative * reading.found_hz / line.kinematic_hz,
        snr=reading.snr[0],
        depth=reading.depth,
        false_alarm=reading.false_alarm,
        detected=reading.detected,
    )
