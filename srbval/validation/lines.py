"""The lines of a bearing in a recording: race, roller and cage lines, their harmonics and sidebands."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from srbval.bearing import Bearing
from srbval.recordings.recording import ShaftSpeed, SpeedSource
from srbval.signal import LineReading, Periodogram, read_comb

# Half width of the search about the kinematic frequency, as a share of it: slip, and for a speed that is only
# a set point the speed's own error (an induction motor's slip under load).
SLIP_WINDOW = 0.01
NOMINAL_WINDOW = 0.02
HARMONICS = 5
# Sidebands of a found line that are taken as its own when a weaker line is read.
_OWN_SIDEBANDS = 3
# Blocks of the phase wander last at least this many revolutions, or a line's sidebands leak into its phase.
_BLOCK_REVOLUTIONS = 2
# A weaker line on a simple ratio of a stronger one's frequency is taken as part of it up to these integers.
_LARGEST_RATIO = 4


@dataclass(frozen=True, kw_only=True)
class Line:
    """One line. `ci95_hz` is the reading's own 95 % half width; the speed's enters only the deviation's.

    `snr` is power over local mean noise power in the squared envelope spectrum, `depth` the line's amplitude
    there over the squared envelope's mean. The first harmonic comes
    from the joint fit of all, and so does its `false_alarm`; the others are read one by one.
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


@dataclass(frozen=True, kw_only=True)
class _Family:
    """A fundamental line with the spacing of its sidebands (zero: none looked for)."""

    name: str
    kinematic_hz: float
    sideband_hz: float
    sideband_name: str


@dataclass(frozen=True, kw_only=True)
class _Search:
    """Where lines are looked for: `scale` times kinematic, within `half_share` of that."""

    half_share: float
    block_s: float
    scale: float = 1.0

    def settled(self, scale: float) -> _Search:
        """After a line at `scale` times kinematic: the others stand there too but for slip."""
        return replace(self, scale=scale, half_share=SLIP_WINDOW) if self.half_share > SLIP_WINDOW else self

    def half_window_hz(self, frequency_hz: float, bin_hz: float) -> float:
        return max(self.half_share * frequency_hz, bin_hz)


@dataclass(frozen=True, kw_only=True)
class _Found:
    """A family as read, with the record and the search it was read in."""

    family: _Family
    reading: LineReading
    record: Periodogram
    search: _Search
    explained_by: str | None

    @property
    def detected(self) -> bool:
        return self.reading.detected and self.explained_by is None


def highest_line_hz(bearing: Bearing, shaft_hz: float) -> float:
    """Highest frequency the readings of `bearing` need [Hz]."""
    orders = bearing.orders
    highest = max(orders.bpfo, orders.bpfi, 2 * orders.bsf)
    return (HARMONICS * (1 + NOMINAL_WINDOW) * highest + _OWN_SIDEBANDS) * shaft_hz


def read_lines(record: Periodogram, bearing: Bearing, speed: ShaftSpeed) -> tuple[Line, ...]:
    """All lines of `bearing` in `record`, a periodogram of the squared envelope.

    The strongest family is read first; its harmonics and sidebands are masked before the next is read, and
    a weaker line on a simple ratio of a stronger one is marked as explained by it. With a nominal speed
    the first detected line also settles the speed for the others. The cage line is read by itself: its
    harmonics coincide with every other line's.
    """
    *waiting, cage = families = _families(bearing, speed.value_hz)
    search = _Search(
        half_share=NOMINAL_WINDOW if speed.source is SpeedSource.NOMINAL else SLIP_WINDOW,
        block_s=_BLOCK_REVOLUTIONS / speed.value_hz,
    )
    found: list[_Found] = []
    bare = record
    while waiting:
        readings = {f.name: _fundamental(record, f, search) for f in waiting}
        strongest = max(waiting, key=lambda f: _strength(readings[f.name]))
        waiting.remove(strongest)
        latest = _judge(strongest, readings[strongest.name], record, search, found)
        if latest is not None:
            found.append(latest)
            if latest.detected:
                record = _without(record, latest)
                search = search.settled(latest.reading.found_hz / strongest.kinematic_hz)
    cage_line = _judge(cage, _fundamental(bare, cage, search), bare, search, [])
    by_name = {f.family.name: f for f in (*found, cage_line) if f is not None}
    return tuple(line for f in families for line in _lines_of(f, by_name.get(f.name), speed))


def _families(bearing: Bearing, shaft_hz: float) -> tuple[_Family, ...]:
    at = bearing.orders.at(shaft_hz)
    return (
        _Family(name="BPFO", kinematic_hz=at.bpfo_hz, sideband_hz=0.0, sideband_name=""),
        _Family(name="BPFI", kinematic_hz=at.bpfi_hz, sideband_hz=shaft_hz, sideband_name="fr"),
        _Family(name="2xBSF", kinematic_hz=2 * at.bsf_hz, sideband_hz=at.ftf_hz, sideband_name="FTF"),
        _Family(name="FTF", kinematic_hz=at.ftf_hz, sideband_hz=0.0, sideband_name=""),
    )


def _fundamental(record: Periodogram, family: _Family, search: _Search) -> LineReading | None:
    centre = search.scale * family.kinematic_hz
    half = search.half_window_hz(centre, record.bin_hz)
    return read_comb(record, centre, half, harmonics=HARMONICS, shortest_block_s=search.block_s)


def _judge(
    family: _Family, reading: LineReading | None, record: Periodogram, search: _Search, stronger: list[_Found]
) -> _Found | None:
    if reading is None:
        return None
    explained = _explained_by(reading, stronger, record.bin_hz) if reading.detected else None
    return _Found(family=family, reading=reading, record=record, search=search, explained_by=explained)


def _strength(reading: LineReading | None) -> float:
    """Order of reading: detected lines first, the deepest modulation before all."""
    if reading is None:
        return -1.0
    return reading.depth if reading.detected else 0.0


def _explained_by(reading: LineReading, stronger: list[_Found], bin_hz: float) -> str | None:
    for other in stronger:
        if not other.detected:
            continue
        for up in range(1, _LARGEST_RATIO + 1):
            for down in range(1, _LARGEST_RATIO + 1):
                expected = other.reading.found_hz * up / down
                margin = bin_hz + math.hypot(reading.ci95_hz, other.reading.ci95_hz * up / down)
                if math.gcd(up, down) == 1 and abs(reading.found_hz - expected) <= margin:
                    return f"{up}/{down} {other.family.name}"
    return None


def _without(record: Periodogram, found: _Found) -> Periodogram:
    """The record with the harmonics of a found line, and their sidebands, masked."""
    line_hz = found.reading.found_hz
    number = np.arange(1, math.floor(record.limit_hz / line_hz) + 1)[:, None]
    side = np.arange(-_OWN_SIDEBANDS, _OWN_SIDEBANDS + 1)[None, :] * (found.family.sideband_hz > 0)
    centre = number * line_hz + side * found.family.sideband_hz
    width = np.broadcast_to(number * found.reading.ci95_hz, centre.shape)
    return record.masking(centre.ravel(), width.ravel())


def _lines_of(family: _Family, found: _Found | None, speed: ShaftSpeed) -> list[Line]:
    first = Line(name=family.name, harmonic=1, kinematic_hz=family.kinematic_hz)
    if found is None:
        return [first]
    first = _measured(first, found.reading, speed)
    first = replace(first, detected=found.detected, explained_by=found.explained_by)
    return [first, *_harmonics(found, speed), *_sidebands(found, speed)]


def _harmonics(found: _Found, speed: ShaftSpeed) -> list[Line]:
    lines = []
    for number in range(2, len(found.reading.snr) + 1):
        kinematic = number * found.family.kinematic_hz
        line = Line(name=found.family.name, harmonic=number, kinematic_hz=kinematic)
        lines.append(_read_one(line, found, number, 0.0, speed))
    return lines


def _sidebands(found: _Found, speed: ShaftSpeed) -> list[Line]:
    family, lines = found.family, []
    for sign in (-1, 1) if family.sideband_hz else ():
        offset = sign * family.sideband_hz
        name = f"{family.name}{'+' if sign > 0 else '-'}{family.sideband_name}"
        line = Line(name=name, harmonic=1, kinematic_hz=family.kinematic_hz + offset)
        lines.append(_read_one(line, found, 1, offset, speed))
    return lines


def _read_one(line: Line, found: _Found, number: int, offset_hz: float, speed: ShaftSpeed) -> Line:
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
