"""Lines of a bearing in a recording: race, roller and cage lines, their harmonics and sidebands.

A weaker line at a simple ratio, such as 3/2, to a stronger line is explained by the stronger line and is not detected.
"""

import enum
import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar

import numpy as np

from srbval.bearing import RACE_DEFECTS, Bearing, Fault
from srbval.reading.families import SIMPLE_RATIOS, Family, families_of, identity_probability, rank_line, window_share
from srbval.recordings import ShaftSpeed, SpeedSource
from srbval.signal import LEAST_SNR, LineReading, Periodogram, is_improbable, peak_snr, read_comb
from srbval.signal.comb import FALSE_ALARM, SIDE_LOBE_BINS
from srbval.signal.false_alarm import MIN_PLACEBOS, joint_false_alarm

RACE_LINES = tuple(fault.line or "" for fault in RACE_DEFECTS)
# A peak that is the line with a smaller probability than this is taken for another line, and is no baseline.
LEAST_IDENTITY = 0.5
SUBHARMONIC_SHARE = 0.5  # least power of a comb's first harmonic, as a share of the second harmonic's
_IF_DETECTED = ("found_hz", "ci95_hz", "deviation_pct", "deviation_ci95_pct", "sideband_hz", "sideband_ci95_hz")
_AS_READ = {one.name for one in fields(LineReading)} - {"snr", "half_window_hz"} | {"detected"}  # copied to a line


class NotDetected(enum.StrEnum):
    """Reason why a line is not detected."""

    OUT_OF_REACH = "beyond the envelope"
    HIDDEN = "hidden by a shaft line"
    PART_OF_OTHER = "part of a stronger line"
    ANOTHER = "too far off for slip"
    OWN = "first harmonic absent"
    WEAK = "peak too weak"
    MULTIPLES = "only multiples found"
    NOISE = "noise explains the peak"
    FLANK = "flank of a larger peak"
    MEANINGLESS = "other combs as strong"


@dataclass(frozen=True, kw_only=True)
class Line:
    """Line of a bearing in a record; values that `LineReading` also has are None if the line cannot be read.

    `deviation_pct` is the deviation from `kinematic_hz`; `deviation_ci95_pct` includes the uncertainty of the speed,
    `ci95_hz` does not, and allows for slip only if the line is detected. The first harmonic comes from the joint fit of
    all harmonics; the others and the sidebands are read one by one. The line is ranked with its harmonics among
    frequencies without a bearing line: `comb_false_alarm` uses one such frequency at a time, `placebo_false_alarm`
    mixes two. `explained_by` is why the peak is not this line, `identity_probability` the probability that it is.
    """

    JSON_PROPERTIES: ClassVar = ("false_alarm", "not_detected")
    UNSTATED: ClassVar[dict[str, Any]] = dict.fromkeys(_IF_DETECTED)  # in place of the values of another peak

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
    comb_false_alarm: float | None = None
    detected: bool = False
    isolated: bool = True
    covered: bool = False
    explained_by: str | None = None
    identity_probability: float | None = None
    resolution_hz: float | None = None
    sideband_hz: float | None = None
    sideband_ci95_hz: float | None = None

    @property
    def false_alarm(self) -> float | None:
        """False-alarm probability from noise and from combs without a bearing line; None if there was no such comb."""
        noise, mixed, whole = self.noise_false_alarm, self.placebo_false_alarm, self.comb_false_alarm
        return None if noise is None or mixed is None or whole is None else joint_false_alarm(noise, mixed, whole)

    @property
    def not_detected(self) -> NotDetected | None:
        """Reason why the line is not detected; None for a detected line."""
        if self.detected:
            return None
        if self.explained_by is not None:
            return next((why for why in NotDetected if why == self.explained_by), NotDetected.PART_OF_OTHER)
        if self.snr is None or self.noise_false_alarm is None:
            return NotDetected.OUT_OF_REACH
        if self.snr <= LEAST_SNR:
            improbable = is_improbable(self.noise_false_alarm, self.placebo_false_alarm)
            return NotDetected.MULTIPLES if improbable else NotDetected.WEAK
        if self.noise_false_alarm >= FALSE_ALARM:
            return NotDetected.NOISE
        return NotDetected.MEANINGLESS if self.isolated else NotDetected.FLANK

    @property
    def stands_out(self) -> bool:
        """True for a peak that noise does not explain, whether it is detected or has another explanation."""
        noise = 1.0 if self.noise_false_alarm is None else self.noise_false_alarm
        return self.isolated and not self.covered and (self.snr or 0.0) > LEAST_SNR and noise < FALSE_ALARM

    def stated(self) -> "Line":
        """Copy of the line for output, without its frequency if it is not detected, since some peak is always found."""
        return self if self.detected else replace(self, **self.UNSTATED)

    @property
    def is_first(self) -> bool:
        """True for the first harmonic of a line; false for higher harmonics and sidebands."""
        return self.harmonic == 1 and not {"+", "-"} & set(self.name)


def detected_fault_lines(lines: Iterable[Line]) -> list[Line]:
    """Detected first harmonics of the race and roller lines, the line with the greatest modulation depth first."""
    shown = (line for line in lines if line.detected and line.harmonic == 1 and Fault.of_line(line.name))
    return sorted(shown, key=lambda line: line.depth or 0.0, reverse=True)


def describe_lines(lines: tuple[Line, ...], speed: ShaftSpeed) -> str:
    """Describe the detected race and roller lines in words: frequency, S/N, modulation, deviation from kinematic."""
    said = [
        f"{line.name} ({fault.label}) line detected: "
        f"{line.found_hz:.2f} ± {line.ci95_hz:.2g} Hz, {line.snr:,.0f} times the noise, "
        f"modulation {100 * (line.depth or 0.0):.0f} %, {line.deviation_pct:+.2f} % from kinematic"
        for line in detected_fault_lines(lines)
        if (fault := Fault.of_line(line.name))
    ]
    if said and speed.source is SpeedSource.NOMINAL:
        said[0] += " (the speed is only nominal)"
    return f"{'; also '.join(said)}." if said else "No race or rolling-element line detected."


def read_lines(
    record: Periodogram,
    bearing: Bearing,
    speed: ShaftSpeed,
    *,
    scale: float = 1.0,
    brief: bool = False,
    combs: int = MIN_PLACEBOS,
) -> tuple[Line, ...]:
    """Read all lines of `bearing` in `record`, a periodogram of the squared envelope, at a shaft speed.

    All lines are searched near `scale` times their kinematic frequencies. The strongest line is read first, and its
    harmonics and sidebands are masked (ignored) for the next, but not for the cage line, whose harmonics coincide with
    other lines. Each line with its harmonics is ranked among `combs` combs (lines with harmonics) at frequencies at
    which the bearing has no line. With `brief` only first harmonics are returned; the detected lines are the same.
    """
    families = families_of(bearing, speed.value_hz)
    *waiting, cage = families
    share, shaft_masked = window_share(bearing, speed), record
    lines = {f: [Line(name=f.name, harmonic=1, kinematic_hz=f.kinematic_hz)] for f in families}
    stronger: list[Line] = []

    def read_first(family: Family, within: Periodogram, period_s: float | None = None) -> LineReading | None:
        """Read a family near `scale` times its kinematic frequency; None if it cannot be read."""
        window = (centre := scale * family.kinematic_hz), max(share * centre, within.bin_hz)
        return read_comb(within, *window, sideband_hz=family.sideband_hz, period_s=period_s)

    def add(family: Family, reading: LineReading, within: Periodogram, stronger: list[Line]) -> LineReading | None:
        """Put a family's lines into `lines`, its first into `stronger` if it is detected; return its reading then."""
        if reading.detected:  # slip, which takes longest, is estimated only for lines above noise
            reading = read_first(family, within, 1 / speed.value_hz) or reading
        if reading.detected or not brief:
            rank = rank_line(family, reading, within, families, speed, scale, combs)
            reading = replace(reading, placebo_false_alarm=rank and rank[0], comb_false_alarm=rank and rank[1])
        first, explained, identity = _with_reading(lines[family][0], reading, speed), None, None
        if reading.detected:
            explained = _explained_by(first, stronger, within.bin_hz)
            if speed.source is not SpeedSource.PRESCRIBED:  # a simulated record contains no other machine
                centre, speed_ci95 = scale * family.kinematic_hz, speed.ci95_hz / speed.value_hz
                identity = identity_probability(reading, centre, speed_ci95, bearing.largest_slip)
                explained = explained or (NotDetected.ANOTHER if identity < LEAST_IDENTITY else None)
        detected = reading.detected and explained is None
        first = replace(first, detected=detected, explained_by=explained, identity_probability=identity)
        lines[family] = _lines_of(family, first, reading, within, scale, speed, brief)
        if first.detected:
            stronger.append(first)
        return reading if first.detected else None

    read = {f: reading for f in waiting if (reading := read_first(f, record))}
    while read:
        # Lines that noise does not explain first, the deepest modulation before all.
        strongest = max(read, key=lambda f: read[f].depth if read[f].detected else 0.0)
        waiting.remove(strongest)
        if reading := add(strongest, read.pop(strongest), record, stronger):
            record = strongest.mask(record, reading)
            read = {f: reading for f in waiting if (reading := read_first(f, record))}
    if reading := read_first(cage, shaft_masked):
        add(cage, reading, shaft_masked, [])

    every = itertools.chain.from_iterable(lines.values())
    return tuple(every if brief else (_explained(x, scale, share, shaft_masked, record, stronger) for x in every))


def _explained(
    line: Line, scale: float, share: float, shaft_masked: Periodogram, all_masked: Periodogram, stronger: list[Line]
) -> Line:
    """Add to an undetected line what hides it: a shaft harmonic, a `stronger` line or a peak beside the search window.

    `shaft_masked` is the record without shaft harmonics, `all_masked` also without `stronger` lines and sidebands.
    """
    centre, unread, flank = scale * line.kinematic_hz, line.found_hz is None, line.not_detected is NotDetected.FLANK
    if line.detected or line.explained_by or (unread and (1 + share) * centre > all_masked.limit_hz):
        return line
    if line.covered or flank:
        centre = line.found_hz or centre
    reach = max(share * centre, (SIDE_LOBE_BINS if flank else 1.0) * all_masked.bin_hz) * (not line.covered)
    near = centre + reach * np.linspace(-1, 1, 401)
    top = near[[np.argmax(all_masked.power_at(near))]]
    height = float(all_masked.power_at(top)[0]) / all_masked.noise_near(centre, reach).mean_power
    others = [other.name for other in stronger if not line.name.startswith(other.name)]
    if height > LEAST_SNR and shaft_masked.masked(top)[0]:
        depth = all_masked.depth_at(float(top[0]))
        return replace(line, covered=True, explained_by=NotDetected.HIDDEN, snr=height, depth=depth)
    if height > LEAST_SNR and others and all_masked.masked(top)[0]:
        return replace(line, explained_by=f"lines of {', '.join(others)}")
    return replace(line, explained_by=NotDetected.FLANK) if unread or flank else line


def _explained_by(line: Line, stronger: list[Line], bin_hz: float) -> str | None:
    """Simple ratio to a stronger line that explains this line, such as ``3/2 BPFO``; None if there is none."""
    for other, (up, down) in itertools.product(stronger, SIMPLE_RATIOS):
        expected, wide = ((value or 0.0) * up / down for value in (other.found_hz, other.ci95_hz))
        if abs((line.found_hz or 0.0) - expected) <= bin_hz + math.hypot(line.ci95_hz or 0.0, wide):
            return f"{up}/{down} {other.name}"
    return None


def _lines_of(
    family: Family, first: Line, reading: LineReading, record: Periodogram, scale: float, speed: ShaftSpeed, brief: bool
) -> list[Line]:
    """Lines of a family: its first harmonic and, unless `brief`, its other harmonics and its sidebands."""
    shows = first.detected
    # With a comb at half its frequency it would be a second harmonic. Not for a roller's line: a roller strikes both
    # races per revolution, so its rate is half its line.
    if shows and first.name in RACE_LINES:
        half = peak_snr(record, 0.5 * reading.found_hz, record.bin_hz + 2 * reading.ci95_hz)
        if half is not None and half > max(LEAST_SNR, SUBHARMONIC_SHARE * reading.snr[0]):
            first = replace(first, detected=False, explained_by="2/1 a line at half its frequency")
    if brief:
        return [first]

    def read_one(name: str, number: int, offset_hz: float = 0.0) -> Line:
        """Read a harmonic or sideband where the first harmonic places it if detected, else where kinematics do."""
        line, slip_hz = Line(name=name, harmonic=number, kinematic_hz=number * family.kinematic_hz + offset_hz), 0.0
        if shows:
            slip_hz, centre = number * reading.ci95_hz, number * reading.found_hz + offset_hz
            within = record.bin_hz + slip_hz + (speed.ci95_hz if offset_hz else 0.0)
        else:
            centre = scale * line.kinematic_hz
            within = max(reading.half_window_hz / (scale * family.kinematic_hz) * centre, record.bin_hz)
        if shows and not offset_hz:  # no farther from kinematic than its line may be
            own, off = number * scale * family.kinematic_hz, number * reading.half_window_hz
            low, high = max(centre - within, own - off), min(centre + within, own + off)
            centre, within = (low + high) / 2, (high - low) / 2
        found = read_comb(record, centre, within, harmonics=1, period_s=None)
        if found is None:
            return line
        return _with_reading(line, replace(found, ci95_hz=min(math.hypot(found.ci95_hz, slip_hz), within)), speed)

    found = [read_one(family.name, number) for number in range(2, len(reading.snr) + 1)]
    for sign, offset_hz in (("-", -family.sideband_hz), ("+", family.sideband_hz)) if family.sideband_hz else ():
        found.append(read_one(f"{family.name}{sign}{family.sideband_name}", 1, offset_hz))
    return [first, *(x if shows else _without_own_line(x) for x in found)]


def _without_own_line(line: Line) -> Line:
    return replace(line, detected=False, explained_by=NotDetected.OWN) if line.detected else line


def _with_reading(line: Line, reading: LineReading, speed: ShaftSpeed) -> Line:
    relative = math.hypot(reading.ci95_hz / reading.found_hz, speed.ci95_hz / speed.value_hz)
    return replace(
        line,
        **{name: getattr(reading, name) for name in _AS_READ},
        deviation_pct=100 * (reading.found_hz / line.kinematic_hz - 1),
        deviation_ci95_pct=100 * relative * reading.found_hz / line.kinematic_hz,
        snr=reading.snr[0],
    )


def clearness(lines: Iterable[Line]) -> tuple[float, float]:
    """Clearness of the clearest race or roller line: -log of its false-alarm probability from noise, and its S/N."""
    faults = [x for x in lines if x.harmonic == 1 and Fault.of_line(x.name) and x.noise_false_alarm is not None]
    shown = (x for x in faults if x.explained_by in (None, NotDetected.HIDDEN))
    return max(((-math.log(max(x.noise_false_alarm or 0.0, 1e-300)), x.snr or 0.0) for x in shown), default=(0.0, 0.0))


def sidak_corrected(lines: tuple[Line, ...], trials: int, trials_of_rank: int | None = None) -> tuple[Line, ...]:
    """Correct false-alarm probabilities for the number of `trials` (bands, speeds), and decide again what is detected.

    The corrected value 1 - (1 - p)^trials (Sidak 1967, J. Am. Stat. Assoc. 62, 626) is exact for independent trials and
    too high for overlapping bands. Ranks among combs without a bearing line are corrected for `trials_of_rank` trials
    (default: `trials`).
    """
    if trials == 1:
        return lines

    def of_any(chance: float | None, trials: int) -> float | None:
        return chance if chance is None or chance >= 1 else -math.expm1(trials * math.log1p(-chance))

    corrected = []
    for line in lines:
        noise = of_any(line.noise_false_alarm, trials)
        placebo, comb = (of_any(p, trials_of_rank or trials) for p in (line.placebo_false_alarm, line.comb_false_alarm))
        detected = line.detected and noise is not None and is_improbable(noise, placebo)
        line = replace(line, noise_false_alarm=noise, placebo_false_alarm=placebo, comb_false_alarm=comb)
        corrected.append(replace(line, detected=detected))
    own = {x.name for x in corrected if x.detected and x.is_first}
    # A sideband's name begins with its line's: ``BPFI-fr``.
    return tuple(x if x.name.replace("+", "-").split("-")[0] in own else _without_own_line(x) for x in corrected)
