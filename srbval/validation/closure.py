"""BPFO + BPFI against the number of rolling elements times the shaft speed."""

from __future__ import annotations

import math
from dataclasses import dataclass

from srbval.bearing import Bearing
from srbval.recordings import ShaftSpeed
from srbval.validation.lines import Line


@dataclass(frozen=True, kw_only=True)
class Closure:
    """The sum of both race lines, which slip of the cage leaves unchanged.

    `sum_hz` - `expected_hz` therefore tests the speed (and the reading), not the slip; `ci95_pct` joins the
    uncertainties of both lines and of the speed. Values are None, and `why` says so, unless both are read.
    """

    expected_hz: float
    expected_ci95_hz: float
    sum_hz: float | None = None
    sum_ci95_hz: float | None = None
    difference_pct: float | None = None
    ci95_pct: float | None = None
    closed: bool | None = None
    why: str = ""


def close(lines: tuple[Line, ...], bearing: Bearing, speed: ShaftSpeed) -> Closure:
    """Closure of the race lines read in one recording, at the same speed."""
    expected = bearing.rolling_elements * speed.value_hz
    expected_ci = bearing.rolling_elements * speed.ci95_hz
    races = [line for line in lines if line.name in ("BPFO", "BPFI") and line.harmonic == 1]
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
