"""Conclusions from the lines of a record: the sum of both race lines, and the detected lines in a sentence.

BPFO + BPFI = Z f_shaft, whatever the slip (Randall 2011, sect. 2.2.3): a pair of lines of one record that does not add
up was not taken at the stated speed.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

from srbval.bearing import Bearing, Fault
from srbval.reading.lines import RACE_LINES, Line, detected_fault_lines
from srbval.recordings import ShaftSpeed, SpeedSource


@dataclass(frozen=True, kw_only=True)
class Closure:
    """Sum of both race lines of one record, with the uncertainty of lines and speed; None for the reason `why`."""

    expected_hz: float
    expected_ci95_hz: float
    sum_hz: float | None = None
    sum_ci95_hz: float | None = None
    difference_pct: float | None = None
    ci95_pct: float | None = None
    closed: bool | None = None
    why: str = ""


@dataclass(frozen=True, kw_only=True)
class SumRule:
    """One pair of race lines, as orders of the shaft speed of each; `ci95` is the 95 % half width of their sum.

    `slip_difference` of the cage speeds of two records, in orders, is subtracted from the sum for `closed`.
    """

    JSON_PROPERTIES: ClassVar = ("total", "difference_pct", "implied_rpm", "closed")

    source: str
    origin: str
    rolling_elements: int
    bpfo_order: float
    bpfi_order: float
    ci95: float | None
    stated_rpm: float
    slip_difference: float = 0.0

    @property
    def total(self) -> float:
        """Sum of the two orders."""
        return self.bpfo_order + self.bpfi_order

    @property
    def difference_pct(self) -> float:
        """Sum relative to the number of rolling elements [%]."""
        return 100 * (self.total / self.rolling_elements - 1)

    @property
    def implied_rpm(self) -> float:
        """Shaft speed at which the sum would be exact [rpm]."""
        return self.stated_rpm * self.total / self.rolling_elements

    @property
    def closed(self) -> bool | None:
        """True if the sum agrees within its uncertainty; None without an uncertainty."""
        difference = self.total - self.slip_difference - self.rolling_elements
        return None if self.ci95 is None else bool(abs(difference) <= self.ci95)


def closure_of(lines: tuple[Line, ...], bearing: Bearing, speed: ShaftSpeed) -> Closure:
    """Closure of the race lines read in one recording, at the same speed."""
    expected, expected_ci = (bearing.rolling_elements * hz for hz in (speed.value_hz, speed.ci95_hz))
    races = [line for line in lines if line.name in RACE_LINES and line.harmonic == 1]
    missing = [line.name for line in races if not line.detected]
    if missing:
        why = f"{' and '.join(missing)} not detected in this recording, so there is no sum to compare."
        return Closure(expected_hz=expected, expected_ci95_hz=expected_ci, why=why)
    total = sum(line.found_hz or 0.0 for line in races)
    total_ci = math.hypot(*(line.ci95_hz or 0.0 for line in races))
    difference = 100 * (total / expected - 1)
    ci_pct = 100 * math.hypot(total_ci / expected, expected_ci / expected)
    closed = abs(difference) <= ci_pct
    return Closure(
        expected_hz=expected,
        expected_ci95_hz=expected_ci,
        sum_hz=total,
        sum_ci95_hz=total_ci,
        difference_pct=difference,
        ci95_pct=ci_pct,
        closed=closed,
        why="" if closed else "The sum is off by more than its uncertainty: speed or a line is wrong.",
    )


def describe_lines(lines: tuple[Line, ...], speed: ShaftSpeed) -> str:
    """The detected race and roller lines and their clearness in a sentence."""
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
