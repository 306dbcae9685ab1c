"""Lines and shaft speed of a processed record: search windows are as wide as slip and speed require and never wider.

A nominal speed may be wrong by more than the width of a window. Then the shaft is looked for first, by its own
harmonics; where they do not show, lines are read about several speeds within the nominal one's interval, one window
apart, and each of these speeds counts as a trial in the false-alarm probabilities (Sidak correction). A family that
stands out just outside all windows is named, so that a wrong speed or geometry shows; no line is taken from it.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from srbval.bearing import DEFECTS, Bearing
from srbval.reading.band_choice import WHOLE_BAND, sidak_corrected
from srbval.reading.families import HARMONICS, families_of, highest_line_hz, window_share
from srbval.reading.lines import Line, detected_fault_lines, read_lines
from srbval.reading.pipeline import Processed, tracked
from srbval.reading.shaft_speed import SEARCH_SHARE, estimate_speed, speed_by_comb
from srbval.recordings import ShaftSpeed, SpeedSource
from srbval.signal import LEAST_SNR, Periodogram, drop_ends, end_s, prewhitened, read_comb, squared_envelope_one_pass

# Share of the band's width up to which the squared envelope's spectrum is used; its floor ends at the width.
USABLE_SHARE = 0.9
# Shaft harmonics are masked no wider than this share of their frequency: with a speed that is only nominal
# wider masks would grow together and hide every line.
LARGEST_MASK_SHARE = 5e-4
# Noise alone exceeds so many medians of its squared envelope once in 4096 values: 2^-12 of an exponential variable.
CLIP = 12.0


@dataclass(frozen=True, kw_only=True)
class Window:
    """Where a line was looked for [Hz], over all speeds tried."""

    name: str
    low_hz: float
    high_hz: float


@dataclass(frozen=True, kw_only=True)
class OutsideFamily:
    """A family of lines outside the windows: like `name`'s if the shaft turned at `shaft_hz`, `off_pct` from the speed.

    `snr` is its first harmonic's power over the noise; its false-alarm probability counts the wide search.
    """

    name: str
    found_hz: float
    off_pct: float
    shaft_hz: float
    snr: float
    noise_false_alarm: float

    @property
    def sentence(self) -> str:
        """What it may mean, in words."""
        return (
            f"Outside the search windows a comb at {self.found_hz:.2f} Hz is {self.snr:,.0f} times the noise, "
            f"{self.off_pct:+.1f} % from {self.name}: that line if the shaft turns at {60 * self.shaft_hz:.1f} rpm; "
            "check speed (--rpm, --rpm-tolerance) and bearing."
        )


@dataclass(frozen=True, kw_only=True)
class SpeedSearch:
    """The lines, the speed their deviations refer to, and how many speeds were tried (1 where it was known).

    The false-alarm probabilities of `lines` are not yet corrected for `tried`, see `sidak_corrected`. `span` are the
    lowest and highest share of the speed that lines were read about. `beyond_nominal_pct` is how far an estimated speed
    lies from the nominal one it replaces, where that is outside the nominal one's interval.
    """

    lines: tuple[Line, ...]
    speed: ShaftSpeed
    tried: int = 1
    span: tuple[float, float] = (1.0, 1.0)
    beyond_nominal_pct: float | None = None
    outside: OutsideFamily | None = None

    def windows(self, bearing: Bearing) -> tuple[Window, ...]:
        """From speed, geometry and slip: where each line was looked for."""
        share = window_share(bearing, self.speed)
        low, high = (1 - share) * self.span[0], (1 + share) * self.span[1]
        return tuple(
            Window(name=f.name, low_hz=low * f.kinematic_hz, high_hz=high * f.kinematic_hz)
            for f in families_of(bearing, self.speed.value_hz)
        )

    def description(self, bearing: Bearing) -> str:
        """How the lines and the speed were looked for, in words."""
        share = window_share(bearing, self.speed)
        window = f"windows of {100 * share:.3g} % about each line ({100 * bearing.largest_slip:g} % for slip"
        window += ")" if share == bearing.largest_slip else ", the rest for the speed)"
        if self.tried > 1:
            window += (
                f", at {self.tried} speeds because the nominal one may be off by more than a window; "
                f"false-alarm probabilities count {self.tried} trials"
            )
        if self.beyond_nominal_pct is not None:
            window += f"; the speed read from the record lies {self.beyond_nominal_pct:+.2f} % from the nominal one, "
            window += "outside its interval"
        return window


def search(processed: Processed, bearing: Bearing, speed: ShaftSpeed) -> SpeedSearch:
    """Read all lines at a measured speed, or find the speed first where it is only nominal.

    A nominal speed gives way to one estimated from the record, by shaft harmonics alone, in the band or in the whitened
    whole, or with the sidebands of the line then found, where that knows more (`estimate_speed`, `speed_by_comb`).
    A line outside all windows counts only where its sidebands by themselves give the speed at which it is one.
    """
    if speed.source is not SpeedSource.NOMINAL:
        found = SpeedSearch(lines=_read(processed, bearing, speed), speed=speed)
        return replace(found, outside=_outside(found, processed, bearing)[0])

    def estimate(at: ShaftSpeed, lines: tuple[Line, ...]) -> ShaftSpeed | None:
        return estimate_speed(periodogram_of(processed, bearing, at), lines, speed)

    def read_at(estimated: ShaftSpeed, found: SpeedSearch) -> SpeedSearch:
        """The lines at the estimated speed; trials made before still count."""
        return replace(found, lines=_read(processed, bearing, estimated), speed=estimated, span=(1.0, 1.0))

    estimated = estimate(speed, ())
    if estimated is None:
        estimated = speed_by_comb(whitened_periodogram(processed, bearing, speed), speed)
    if estimated is None:
        found = _try_speeds(processed, bearing, speed)
    else:
        found = SpeedSearch(lines=_read(processed, bearing, estimated), speed=estimated)
    lines = sidak_corrected(found.lines, speeds=found.tried)
    refined = estimate(found.speed, lines) if detected_fault_lines(lines) else None
    if refined is not None:
        found = read_at(refined, found)
    outside, lines = _outside(found, processed, bearing)
    refined = None if outside is None else estimate(found.speed, lines)
    if outside and refined and abs(refined.value_hz / outside.shaft_hz - 1) < bearing.largest_slip:
        outside, found = None, read_at(refined, found)
    off_hz = found.speed.value_hz - speed.value_hz
    if abs(off_hz) > speed.ci95_hz + found.speed.ci95_hz:
        found = replace(found, beyond_nominal_pct=100 * off_hz / speed.value_hz)
    return replace(found, outside=outside)


def _try_speeds(processed: Processed, bearing: Bearing, nominal: ShaftSpeed) -> SpeedSearch:
    """Lines about every trial speed; those with the deepest fault line after the Sidak correction."""
    scales = _scales(nominal, bearing.largest_slip)

    def depth(scale: float) -> float:
        lines = _read(processed, bearing, nominal, scale, brief=True)
        detected = detected_fault_lines(sidak_corrected(lines, speeds=len(scales)))
        return max((x.depth or 0.0 for x in detected), default=0.0)

    best = max(scales, key=depth) if len(scales) > 1 else 1.0
    lines = _read(processed, bearing, nominal, best)
    return SpeedSearch(lines=lines, speed=nominal, tried=len(scales), span=(min(scales), max(scales)))


def _outside(
    found: SpeedSearch, processed: Processed, bearing: Bearing
) -> tuple[OutsideFamily | None, tuple[Line, ...]]:
    """The strongest family within `SEARCH_SHARE` of its kinematic frequency, where none was detected in its window.

    With it all lines about that scale. It must be detected, with at least two harmonics above `LEAST_SNR`, when the
    shaft turns as it would have to.
    """
    if detected_fault_lines(sidak_corrected(found.lines, speeds=found.tried)):
        return None, ()
    record = periodogram_of(processed, bearing, found.speed)
    readings = []
    for family in families_of(bearing, found.speed.value_hz)[: len(DEFECTS)]:
        half_hz = SEARCH_SHARE * family.kinematic_hz
        reading = read_comb(record, family.kinematic_hz, half_hz, harmonics=HARMONICS, shortest_block_s=None)
        if reading is not None and reading.detected and sum(s > LEAST_SNR for s in reading.snr) > 1:
            readings.append((family, reading))
    for family, reading in sorted(readings, key=lambda pair: -pair[1].snr[0]):
        scale = reading.found_hz / family.kinematic_hz
        there = _read(processed, bearing, found.speed, scale, brief=True)
        if next(x for x in there if (x.name, x.harmonic) == (family.name, 1)).detected:
            outside = OutsideFamily(
                name=family.name, found_hz=reading.found_hz, off_pct=100 * (scale - 1), snr=reading.snr[0],
                shaft_hz=scale * found.speed.value_hz, noise_false_alarm=reading.noise_false_alarm,
            )  # fmt: skip
            return outside, there
    return None, ()


def _scales(nominal: ShaftSpeed, apart: float) -> tuple[float, ...]:
    """Shares of the nominal speed, `apart` from each other, itself first, whose windows cover its interval."""
    steps = range(1, math.ceil(nominal.ci95_hz / nominal.value_hz / apart - 1e-9))
    return (1.0, *(1 + side * step * apart for step in steps for side in (-1, 1)))


def _read(
    processed: Processed, bearing: Bearing, speed: ShaftSpeed, scale: float = 1.0, *, brief: bool = False
) -> tuple[Line, ...]:
    """Lines about `scale` times `speed`, with deviations at `speed`; shaft harmonics are masked at the scaled speed."""
    turning = replace(speed, value_hz=scale * speed.value_hz)
    record = periodogram_of(processed, bearing, turning)
    return read_lines(record, bearing, speed, scale=scale, brief=brief)


def periodogram_of(processed: Processed, bearing: Bearing, speed: ShaftSpeed) -> Periodogram:
    """Of the squared envelope, with the harmonics of the shaft at `speed` masked."""
    width_hz = processed.band_hz[1] - processed.band_hz[0]
    return Periodogram.of(
        processed.squared,
        processed.squared_fs_hz,
        limit_hz=min(highest_line_hz(bearing, speed.value_hz), USABLE_SHARE * width_hz),
        shaft_hz=speed.value_hz,
        shaft_ci_hz=min(speed.ci95_hz, LARGEST_MASK_SHARE * speed.value_hz),
    )


def whitened_periodogram(processed: Processed, bearing: Bearing, speed: ShaftSpeed) -> Periodogram:
    """`periodogram_of` the whole band after cepstrum prewhitening, the squared envelope clipped at `CLIP` medians.

    Some few knocks far above all others would make up combs of any order among themselves. Impacts of a fault come in
    hundreds, each of them little above the clip.
    """
    band_hz = WHOLE_BAND[0] * processed.fs_hz, WHOLE_BAND[1] * processed.fs_hz
    square, rate = squared_envelope_one_pass(prewhitened(processed.whole), processed.fs_hz, band_hz)
    square = np.minimum(square, CLIP * float(np.median(square)))
    ends = end_s(band_hz)
    square = tracked(drop_ends(square, rate, ends), rate, ends, processed.tracking)
    whole = replace(processed, squared=square, squared_fs_hz=rate, band_hz=band_hz)
    return periodogram_of(whole, bearing, speed)
