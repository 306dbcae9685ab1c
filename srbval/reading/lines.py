"""The lines of a bearing in a recording: race, roller and cage lines, their harmonics and sidebands."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from srbval.bearing import RACE_DEFECTS, Bearing, Fault
from srbval.reading.families import Family, FamilyReading, families_of, find_families, half_window_hz
from srbval.recordings import ShaftSpeed
from srbval.signal import LEAST_SNR, LineReading, Periodogram, peak_snr, read_comb

RACE_LINES = tuple(fault.line or "" for fault in RACE_DEFECTS)
# Least power over noise of a comb's first harmonic, as a share of that of its second.
HALF_SHARE = 0.5
# What a line takes over from its reading.
_AS_READ = (
    "found_hz", "ci95_hz", "depth", "noise_false_alarm", "placebo_false_alarm", "detected", "resolution_hz",
    "sideband_hz", "sideband_ci95_hz",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Line:
    """One line. `ci95_hz` is the reading's own 95 % half width; the speed's enters only the deviation's.

    `snr` is power over local mean noise power in the squared envelope spectrum, `depth` the line's amplitude
    there over the squared envelope's mean. The first harmonic comes from the joint fit of all, and so does
    its `noise_false_alarm`; the others are read one by one. `placebo_false_alarm` is a first harmonic's rank among the
    record's placebos (`rank_among_placebos`), None where there are too few; `false_alarm` the larger of the
    two. A sideband counts only with its own line.
    `resolution_hz` is one over the record's duration: two lines closer than that are not resolved. `sideband_hz` is
    the spacing of the sidebands fitted with the line, where some stood out. `half_snr` and `double_snr` are the power
    over noise at half and at twice the frequency found: a comb at half of it would make it but a second harmonic.
    `explained_by` names the stronger line whose frequency this one is a simple multiple of, or says that it is another
    line; `identity_probability` is that of a first harmonic's peak being the line (`identity_probability`). Values are
    None where the line is out of the record's reach.
    """

    JSON_PROPERTIES: ClassVar = ("false_alarm",)

    name: str
    harmonic: int
    kinematic_hz: float
    found_hz: float | None = None
    ci95_hz: float | None = None
    deviation_pct: float | None = None
    deviation_ci95_pct: float | None = None
    snr: float | None = None
    depth: float | None = None
    noise_false_alarm: float | None = None
    placebo_false_alarm: float | None = None
    detected: bool = False
    explained_by: str | None = None
    identity_probability: float | None = None
    resolution_hz: float | None = None
    sideband_hz: float | None = None
    sideband_ci95_hz: float | None = None
    half_snr: float | None = None
    double_snr: float | None = None

    @property
    def false_alarm(self) -> float | None:
        """The larger of the probabilities from noise alone and from the record's placebos."""
        return None if self.noise_false_alarm is None else max(self.noise_false_alarm, self.placebo_false_alarm or 0.0)

    def stated(self) -> "Line":
        """The line as it is printed: an undetected one has no frequency, for some peak is always found."""
        if self.detected:
            return self
        return replace(
            self, found_hz=None, ci95_hz=None, deviation_pct=None, deviation_ci95_pct=None, sideband_hz=None,
            sideband_ci95_hz=None,
        )  # fmt: skip

    @property
    def is_first(self) -> bool:
        """Whether it is the first harmonic of a family and no sideband."""
        return self.harmonic == 1 and not {"+", "-"} & set(self.name)

    @property
    def detected_deviation_pct(self) -> float | None:
        """The deviation from kinematics where the line was detected [%]."""
        return self.deviation_pct if self.detected else None


LINE_KEYS = (
    "kinematic_hz", "found_hz", "ci95_hz", "deviation_pct", "deviation_ci95_pct", "snr", "depth", "detected",
)  # fmt: skip


def line_entry(line: Line | None) -> dict[str, Any]:
    """A line as an entry of ``report.json`` states it: its name and main values, null where there is none."""
    values = {key: getattr(line, key, None) for key in LINE_KEYS}
    return {"line": line and line.name} | values | {"detected": line is not None and line.detected}


def detected_fault_lines(lines: Iterable[Line]) -> list[Line]:
    """First harmonics of the race and roller lines that were detected, the deepest first."""
    shown = (line for line in lines if line.detected and line.harmonic == 1 and Fault.of_line(line.name))
    return sorted(shown, key=lambda line: line.depth or 0.0, reverse=True)


def read_lines(
    record: Periodogram, bearing: Bearing, speed: ShaftSpeed, *, scale: float = 1.0, brief: bool = False
) -> tuple[Line, ...]:
    """All lines of `bearing` in `record`, a periodogram of the squared envelope, about `scale` times kinematic.

    A family that cannot be read (out of reach, hidden by the shaft) leaves one line without values. With `brief` only
    first harmonics are read, and only those are ranked that noise does not explain: what is detected is the same.
    """
    found = find_families(record, bearing, speed, scale=scale, rank_all=not brief)
    return tuple(
        line
        for family in families_of(bearing, speed.value_hz)
        for line in _lines_of(family, found.get(family.name), speed, brief)
    )


def _lines_of(family: Family, found: FamilyReading | None, speed: ShaftSpeed, brief: bool) -> list[Line]:
    first = Line(name=family.name, harmonic=1, kinematic_hz=family.kinematic_hz)
    if found is None:
        return [first]
    first = _measured(first, found.reading, speed)
    # Out of reach, or hidden by the shaft, there is none.
    octaves: dict[str, Any] = {
        name: peak_snr(found.record, times * found.reading.found_hz, found.record.bin_hz + 2 * found.reading.ci95_hz)
        for name, times in (("half_snr", 0.5), ("double_snr", 2.0))
    }
    explained = found.explained_by or _second_harmonic_of_other(found, octaves["half_snr"])
    judged: dict[str, Any] = {"explained_by": explained, "identity_probability": found.identity_probability}
    first = replace(first, detected=found.detected and explained is None, **judged, **octaves)
    if brief:
        return [first]
    harmonics = [_read_one(found, speed, family.name, number) for number in range(2, len(found.reading.snr) + 1)]
    sides = [
        _read_one(found, speed, f"{family.name}{sign}{family.sideband_name}", 1, offset)
        for sign, offset in (("-", -family.sideband_hz), ("+", family.sideband_hz))
        if offset
    ]
    return [first, *harmonics, *(replace(x, detected=x.detected and found.detected) for x in sides)]


def _second_harmonic_of_other(found: FamilyReading, half_snr: float | None) -> str | None:
    """What explains a race line with a line about as high at half its frequency, of which it is the second harmonic.

    Not applied to a roller's line: a roller strikes both races per revolution, so its own rate is half its line.
    """
    least = max(LEAST_SNR, HALF_SHARE * found.reading.snr[0])
    if not found.detected or found.family.name not in RACE_LINES or (half_snr or 0.0) <= least:
        return None
    return "2/1 a line at half its frequency"


def _read_one(found: FamilyReading, speed: ShaftSpeed, name: str, number: int, offset_hz: float = 0.0) -> Line:
    """A single line at its distance from the found fundamental, or about its kinematic frequency without one.

    It slips as its fundamental does, whose course was followed: that one's interval, `number` times, joins the noise.
    """
    line = Line(name=name, harmonic=number, kinematic_hz=number * found.family.kinematic_hz + offset_hz)
    record, slip_hz = found.record, 0.0
    if found.detected:
        slip_hz = number * found.reading.ci95_hz
        centre = number * found.reading.found_hz + offset_hz
        half = record.bin_hz + slip_hz + (speed.ci95_hz if offset_hz else 0.0)
    else:
        centre = found.scale * line.kinematic_hz
        share = found.reading.half_window_hz / (found.scale * found.family.kinematic_hz)
        half = half_window_hz(centre, record, share)
    reading = read_comb(record, centre, half, harmonics=1, shortest_block_s=None)
    if reading is None:
        return line
    return _measured(line, replace(reading, ci95_hz=min(math.hypot(reading.ci95_hz, slip_hz), half)), speed)


def _measured(line: Line, reading: LineReading, speed: ShaftSpeed) -> Line:
    relative = math.hypot(reading.ci95_hz / reading.found_hz, speed.ci95_hz / speed.value_hz)
    return replace(
        line,
        **{name: getattr(reading, name) for name in _AS_READ},
        deviation_pct=100 * (reading.found_hz / line.kinematic_hz - 1),
        deviation_ci95_pct=100 * relative * reading.found_hz / line.kinematic_hz,
        snr=reading.snr[0],
    )
