"""Lines and shaft speed of a processed record: search windows are as wide as slip requires and never wider.

A nominal speed may be wrong by more than the width of a window. Then the shaft is looked for first, by its own
harmonics; where they do not show, lines are read about several speeds within the nominal one's interval, one window
apart, and each of these speeds counts as a trial in the false-alarm probabilities (Sidak correction).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from srbval.bearing import Bearing
from srbval.recordings import ShaftSpeed, SpeedSource
from srbval.signal import Periodogram
from srbval.validation.band_choice import sidak_corrected
from srbval.validation.families import SLIP_WINDOW, highest_line_hz
from srbval.validation.lines import Line, detected_fault_lines, read_lines
from srbval.validation.pipeline import Processed
from srbval.validation.shaft_speed import estimate_speed

# Share of the band's width up to which the squared envelope's spectrum is used; its floor ends at the width.
USABLE_SHARE = 0.9
# Shaft harmonics are masked no wider than this share of their frequency: with a speed that is only nominal
# wider masks would grow together and hide every line.
LARGEST_MASK_SHARE = 5e-4


@dataclass(frozen=True, kw_only=True)
class SpeedSearch:
    """The lines, the speed their deviations refer to, and how many speeds were tried (1 where it was known).

    The false-alarm probabilities of `lines` are not yet corrected for `tried`, see `sidak_corrected`.
    """

    lines: tuple[Line, ...]
    speed: ShaftSpeed
    tried: int = 1

    @property
    def description(self) -> str:
        """How the lines and the speed were looked for, in words."""
        window = f"windows of {100 * SLIP_WINDOW:g} % about each line"
        if self.tried == 1:
            return window
        return (
            f"{window}, at {self.tried} speeds because the nominal one may be off by more than a window; "
            f"false-alarm probabilities count {self.tried} trials"
        )


def search(processed: Processed, bearing: Bearing, speed: ShaftSpeed) -> SpeedSearch:
    """Read all lines at a measured speed, or find the speed first where it is only nominal.

    A nominal speed gives way to one estimated from the record, by shaft harmonics alone or with the sidebands of the
    line then found, where that knows more (see `estimate_speed`).
    """
    if speed.source is not SpeedSource.NOMINAL:
        return SpeedSearch(lines=_read(processed, bearing, speed), speed=speed)
    estimated = estimate_speed(periodogram_of(processed, bearing, speed), (), speed)
    if estimated is None:
        found = _try_speeds(processed, bearing, speed)
    else:
        found = SpeedSearch(lines=_read(processed, bearing, estimated), speed=estimated)
    return _refined(found, processed, bearing, speed)


def _refined(found: SpeedSearch, processed: Processed, bearing: Bearing, nominal: ShaftSpeed) -> SpeedSearch:
    """The lines read again at the speed given by the sidebands of a detected line, where there is one."""
    lines = sidak_corrected(found.lines, speeds=found.tried)
    if not detected_fault_lines(lines):
        return found
    estimated = estimate_speed(periodogram_of(processed, bearing, found.speed), lines, nominal)
    if estimated is None:
        return found
    return replace(found, lines=_read(processed, bearing, estimated), speed=estimated)


def _try_speeds(processed: Processed, bearing: Bearing, nominal: ShaftSpeed) -> SpeedSearch:
    """Lines about every trial speed; those with the deepest fault line after the Sidak correction."""
    scales = tuple(_scales(nominal))
    readings = [_read(processed, bearing, nominal, scale) for scale in scales]

    def depth(lines: tuple[Line, ...]) -> float:
        detected = detected_fault_lines(sidak_corrected(lines, speeds=len(scales)))
        return max((x.depth or 0.0 for x in detected), default=0.0)

    return SpeedSearch(lines=max(readings, key=depth), speed=nominal, tried=len(scales))


def _scales(nominal: ShaftSpeed) -> Iterator[float]:
    """Shares of the nominal speed, a window apart, the speed itself first, whose windows cover its interval."""
    yield 1.0
    for step in range(1, math.ceil(nominal.ci95_hz / nominal.value_hz / SLIP_WINDOW - 1e-9)):
        yield 1 - step * SLIP_WINDOW
        yield 1 + step * SLIP_WINDOW


def _read(processed: Processed, bearing: Bearing, speed: ShaftSpeed, scale: float = 1.0) -> tuple[Line, ...]:
    """Lines about `scale` times `speed`, with deviations at `speed`; shaft harmonics are masked at the scaled speed."""
    turning = replace(speed, value_hz=scale * speed.value_hz)
    return read_lines(periodogram_of(processed, bearing, turning), bearing, speed, scale=scale)


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
