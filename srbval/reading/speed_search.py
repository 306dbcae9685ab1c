"""Search for the lines and the shaft speed of a processed record, within the tolerances of slip and speed.

A nominal speed may be wrong by more than a line's search window allows. The speed is then estimated from the
record or, if this fails, lines are read at several trial speeds. A speed outside the tolerance, or a line outside all
search windows, is only reported.
"""

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeGuard

import numpy as np

from srbval.bearing import DEFECTS, Bearing, Fault
from srbval.reading.families import LOG_RATIO_ONSET, LOG_RATIO_SLOPE, families_of, window_share
from srbval.reading.lines import Line, detected_fault_lines, read_lines, sidak_corrected
from srbval.reading.pipeline import LEAST_REVOLUTIONS, Processed, Tracking, periodogram_of
from srbval.recordings import ShaftSpeed, SpeedSource
from srbval.signal import LEAST_SNR, ShaftAngle, read_comb
from srbval.signal.comb import CombSpectrum
from srbval.signal.false_alarm import MIN_PLACEBOS
from srbval.signal.order_tracking import DRIFT_PARTS
from srbval.signal.shaft_lines import shaft_by_lines

SEARCH_SHARE = 0.1  # half width of the search, as a share of the nominal speed: set points turn out 6 % wrong
COMBS_PER_SPEED = 220  # placebos: the least rank, times all speeds and two bands, is below `comb.PLACEBO_FALSE_ALARM`
# Error of the speed beyond the fit's scatter, as a share: clocks, drift, rounding. With each record of measured speed
# left out, the largest excess of the others covers 16 of 17 (tests/reading/test_shaft_speed.py).
ALLOWANCE = 8e-4
DRIFT_STEPS = 64  # of the course of a drifting shaft in each part of a record


@dataclass(frozen=True, kw_only=True)
class OutsideFamily:
    """Comb (line with harmonics) far from all expected lines; it is line `name` if the shaft turns at `shaft_hz`."""

    name: str
    found_hz: float
    off_pct: float
    shaft_hz: float
    snr: float
    noise_false_alarm: float
    source: SpeedSource

    @property
    def sentence(self) -> str:
        """Sentence on the comb, its possible cause and what to check."""
        to_check = {SpeedSource.TACHOMETER: "the tachometer (--pulses-per-rev) and ", SpeedSource.PRESCRIBED: ""}
        check = to_check.get(self.source, "the speed (--rpm, --rpm-tolerance) and ")
        return (
            f"Outside the search windows a comb at {self.found_hz:.2f} Hz is {self.snr:,.0f} times the noise, "
            f"{self.off_pct:+.1f} % from {self.name}: that line if the shaft turns at {60 * self.shaft_hz:.1f} rpm; "
            f"check {check}the bearing."
        )


@dataclass(frozen=True, kw_only=True)
class OutsideSpeed:
    """Shaft speed outside the stated tolerance that fits the record's lines, with its 95 % half width."""

    value_hz: float
    ci95_hz: float
    stated_hz: float
    tolerance_pct: float

    @property
    def sentence(self) -> str:
        """Sentence on the speed found, why it is not used and what to do."""
        return (
            f"The record's lines would fit a shaft at {60 * self.value_hz:,.1f} ± {60 * self.ci95_hz:.2g} rpm, outside "
            f"the stated {60 * self.stated_hz:g} rpm ± {self.tolerance_pct:.3g} %: not used. If the set point may be "
            "off by as much, give a wider --rpm-tolerance; else the lines are another shaft's."
        )


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SpeedSearch:
    """Lines of a record and its shaft speed; false-alarm probabilities are not corrected for the number `tried`.

    `tried` is the number of speeds at which lines were read, `span` the lowest and the highest, as shares of `speed`.
    """

    processed: Processed
    bearing: Bearing
    lines: tuple[Line, ...]
    speed: ShaftSpeed
    tried: int = 1
    span: tuple[float, float] = (1.0, 1.0)
    outside: OutsideFamily | None = None
    outside_speed: OutsideSpeed | None = None

    @property
    def windows(self) -> dict[str, tuple[float, float]]:
        """Search window of each line [Hz] over all speeds tried; the half width is at least the resolution."""
        share, bin_hz, windows = window_share(self.bearing, self.speed), 1 / self.processed.seconds, {}
        for family in families_of(self.bearing, self.speed.value_hz):
            kinematic_hz, (low, high) = family.kinematic_hz, self.span
            below, above = (max(share * end * kinematic_hz, bin_hz) for end in self.span)
            windows[family.name] = low * kinematic_hz - below, high * kinematic_hz + above
        return windows

    @property
    def search(self) -> str:
        """Windows and trial speeds of the search in words."""
        share = window_share(self.bearing, self.speed)
        window = f"windows of {100 * share:.3g} % about each line ({100 * self.bearing.largest_slip:g} % for slip"
        window += ")" if share == self.bearing.largest_slip else ", the rest for the speed)"
        window += f", at least {1 / self.processed.seconds:.2g} Hz"
        if self.tried > 1:
            window += f", at {self.tried} speeds because the nominal speed may be off by more than a window"
            window += f"; false-alarm probabilities count {self.tried} trials"
        return window


def search(processed: Processed, bearing: Bearing, stated: ShaftSpeed) -> SpeedSearch:
    """Read all lines at a measured speed, or at the speed found in the record within the tolerance of a nominal speed.

    A line far from all expected frequencies is used only if its sidebands confirm another speed within the tolerance.
    """
    read_at = partial(_search_trial_speeds, processed, bearing)
    if stated.source is not SpeedSource.NOMINAL:
        found = read_at(stated)
        return replace(found, outside=_find_outside_family(found)[0])

    def estimate(at: ShaftSpeed, lines: tuple[Line, ...]) -> ShaftSpeed | None:
        line_hz = next((x.found_hz or 0.0 for x in detected_fault_lines(lines)), 0.0)
        half_hz = max(SEARCH_SHARE, stated.ci95_hz / stated.value_hz) * stated.value_hz
        record = replace(periodogram_of(processed, bearing, at), masks_hz=np.empty((0, 2)))
        found = shaft_by_lines(record, line_hz, stated.value_hz, half_hz)
        if found is None:
            return None
        ci95_hz = math.hypot(found[1], ALLOWANCE * found[0])
        return ShaftSpeed(value_hz=found[0], ci95_hz=ci95_hz, source=SpeedSource.ESTIMATED)

    def is_within(speed: ShaftSpeed | None) -> TypeGuard[ShaftSpeed]:
        if speed is None or speed.ci95_hz >= stated.ci95_hz:  # not more certain than the stated speed
            return False
        return abs(speed.value_hz - stated.value_hz) <= stated.ci95_hz

    fits = estimate(stated, ())
    found = read_at(fits if is_within(fits) else stated)
    outside, lines = _find_outside_family(found)
    lines = lines or sidak_corrected(found.lines, found.tried)  # trials before a speed was read from the record count
    refined = estimate(found.speed, lines) if detected_fault_lines(lines) else None
    if outside and refined and abs(refined.value_hz / outside.shaft_hz - 1) >= bearing.largest_slip:
        # The sidebands belong to another shaft, or the line to another family than its frequency suggests.
        outside, refined = (outside, None) if is_within(refined) else (None, refined)
    if is_within(refined):
        outside, found = None, replace(read_at(refined), tried=found.tried)
    fits = refined or fits
    if fits is None or abs(fits.value_hz - stated.value_hz) <= stated.ci95_hz + fits.ci95_hz:
        return replace(found, outside=outside)
    if found.speed is not stated:  # two speeds contradict each other: neither is certain
        found = read_at(stated)
        outside = _find_outside_family(found)[0]
    beyond = OutsideSpeed(
        value_hz=fits.value_hz,
        ci95_hz=fits.ci95_hz,
        stated_hz=stated.value_hz,
        tolerance_pct=100 * stated.ci95_hz / stated.value_hz,
    )
    return replace(found, outside=outside, outside_speed=beyond)


def _read_lines_at(
    processed: Processed, bearing: Bearing, at: ShaftSpeed, scale: float = 1.0, *, brief: bool = False, tried: int = 1
) -> tuple[Line, ...]:
    """Read lines at `scale` times the speed `at`, with shaft harmonics masked; deviations refer to the speed `at`."""
    record = periodogram_of(processed, bearing, replace(at, value_hz=scale * at.value_hz))
    combs = max(MIN_PLACEBOS, COMBS_PER_SPEED * tried * processed.trials)
    return read_lines(record, bearing, at, scale=scale, brief=brief, combs=combs)


def _search_trial_speeds(processed: Processed, bearing: Bearing, stated: ShaftSpeed) -> SpeedSearch:
    """Read the lines at each trial speed; keep the speed with the deepest modulation by a fault."""
    scales = trial_scales(stated, bearing.largest_slip)
    tried = len(scales)

    def depths(scale: float) -> tuple[float, float]:
        lines = sidak_corrected(_read_lines_at(processed, bearing, stated, scale, brief=True, tried=tried), tried)
        faults = [(x.detected, x.stands_out, x.depth or 0.0) for x in lines if Fault.of_line(x.name)]
        return max(d * depth for d, _, depth in faults), max(s * depth for _, s, depth in faults)

    best = max(scales, key=depths) if tried > 1 else 1.0
    lines = _read_lines_at(processed, bearing, stated, best, tried=tried)
    span = min(scales), max(scales)
    return SpeedSearch(processed=processed, bearing=bearing, lines=lines, speed=stated, tried=tried, span=span)


def _find_outside_family(found: SpeedSearch) -> tuple[OutsideFamily | None, tuple[Line, ...]]:
    """If no fault line is found: strongest comb (line, harmonics) that fits another speed, and lines at that speed."""
    if detected_fault_lines(sidak_corrected(found.lines, found.tried)):
        return None, ()
    record, readings = periodogram_of(found.processed, found.bearing, found.speed), []
    for family in families_of(found.bearing, found.speed.value_hz)[: len(DEFECTS)]:
        half_hz, (low, high) = SEARCH_SHARE * family.kinematic_hz, found.windows[family.name]
        reading = read_comb(record, family.kinematic_hz, half_hz, period_s=None)
        if reading is None or not reading.detected or low <= reading.found_hz <= high:
            continue
        if sum(s > LEAST_SNR for s in reading.snr) > 1:
            readings.append((family, reading))
    for family, reading in sorted(readings, key=lambda pair: -pair[1].snr[0]):
        scale = reading.found_hz / family.kinematic_hz
        there = _read_lines_at(found.processed, found.bearing, found.speed, scale, brief=True)
        if any(x.detected for x in there if (x.name, x.harmonic) == (family.name, 1)):
            return OutsideFamily(
                name=family.name,
                found_hz=reading.found_hz,
                off_pct=100 * (scale - 1),
                snr=reading.snr[0],
                shaft_hz=scale * found.speed.value_hz,
                noise_false_alarm=reading.noise_false_alarm,
                source=found.speed.source,
            ), there
    return None, ()


def trial_scales(speed: ShaftSpeed, interval: float) -> tuple[float, ...]:
    """Trial speeds within the tolerance of a nominal `speed`, as ratios to it, spaced by `interval`; else 1 alone."""
    beyond = math.ceil(speed.ci95_hz / speed.value_hz / interval - 1e-9) if speed.source is SpeedSource.NOMINAL else 1
    steps = range(1, beyond)
    return (1.0, *(1 + side * step * interval for step in steps for side in (-1, 1)))


def course_by_comb(processed: Processed, bearing: Bearing, speed: ShaftSpeed) -> Tracking | None:
    """Follow the speed of a drifting shaft by a fault's comb (line with harmonics), read in each part of a record.

    The strongest comb within `SEARCH_SHARE` of a fault line's kinematic frequency is followed. Returns None if parts
    have too few revolutions, if a comb of this strength is likelier in a sound bearing than in a faulty one, or if its
    frequency varies by less than the width of a search window.
    """
    size = processed.squared.size // DRIFT_PARTS
    part_s = size / processed.squared_fs_hz
    if part_s * speed.value_hz < LEAST_REVOLUTIONS:
        return None
    parts = [replace(processed, squared=processed.squared[n * size : (n + 1) * size]) for n in range(DRIFT_PARTS)]
    families = families_of(bearing, speed.value_hz)
    lowest_hz = min(family.kinematic_hz for family in families) / 2
    combs = [CombSpectrum.of([[periodogram_of(one, bearing, speed)]], lowest_hz) for one in parts]
    hz, best, course = combs[0].frequency_hz, LOG_RATIO_ONSET / LOG_RATIO_SLOPE, np.ones(DRIFT_PARTS)
    for family in families[: len(DEFECTS)]:
        inside = np.abs(hz / family.kinematic_hz - 1) <= SEARCH_SHARE
        if inside.any():
            score = np.array([one.score[inside] - one.typical(SEARCH_SHARE) for one in combs])
            if (mean := float(score.max(axis=1).mean())) > best:
                best, course = mean, hz[inside][score.argmax(axis=1)]
    if np.ptp(course) < 2 * window_share(bearing, speed) * course.mean():
        return None
    from scipy.interpolate import CubicSpline  # takes a while to load

    middle_s = processed.end_s + part_s * (np.arange(DRIFT_PARTS) + 0.5)
    at_s = np.arange(0, 2 * processed.end_s + DRIFT_PARTS * part_s, part_s / DRIFT_STEPS)
    inside_s = np.clip(at_s, processed.end_s, processed.end_s + DRIFT_PARTS * part_s)
    share = CubicSpline(middle_s, course / course.mean(), bc_type="natural")(inside_s)
    angle = ShaftAngle.from_speed(speed.value_hz * share, DRIFT_STEPS / part_s)
    return Tracking(
        why=f"the shaft drifts by {100 * (share.min() - 1):+.2g} to {100 * (share.max() - 1):+.2g} % about its mean "
        "speed within the record, by its parts' combs: lines are read at even shaft angles about the stated speed",
        drift_bins=angle.drift_bins(bearing.orders.bpfi),
        course=angle,
        mean_hz=speed.value_hz,
    )
