"""Conclusions from the lines of a record: the detected lines in a sentence, and the sum of both race lines.

BPFO + BPFI = Z f_shaft, whatever the slip (Randall 2011, sect. 2.2.3), else the stated speed is wrong.
"""

import math
from collections.abc import Mapping
from typing import Any

from srbval.bearing import Bearing, Fault
from srbval.reading.lines import RACE_LINES, Line, detected_fault_lines
from srbval.recordings import ShaftSpeed, SpeedSource


def sum_rule(pair: Mapping[str, Any]) -> dict[str, Any]:
    """A pair of race lines, as orders of the shaft speed of each, with their sum, and the speed for which it is exact.

    `closed` is true if the sum, less the `slip_difference` of the cage speeds of two records, agrees with the number of
    rolling elements within `ci95`; None without an uncertainty.
    """
    total, rollers, ci95 = pair["bpfo_order"] + pair["bpfi_order"], pair["rolling_elements"], pair["ci95"]
    slip = pair.get("slip_difference", 0.0)
    return {
        **pair,
        "slip_difference": slip,
        "total": total,
        "difference_pct": 100 * (total / rollers - 1),
        "implied_rpm": pair["stated_rpm"] * total / rollers,
        "closed": None if ci95 is None else bool(abs(total - slip - rollers) <= ci95),
    }


def closure_of(lines: tuple[Line, ...], bearing: Bearing, speed: ShaftSpeed) -> dict[str, Any]:
    """Sum of both race lines of one record, with the uncertainty of lines and speed; None for the reason `why`."""
    expected, expected_ci = (bearing.rolling_elements * hz for hz in (speed.value_hz, speed.ci95_hz))
    closure: dict[str, Any] = {"expected_hz": expected, "expected_ci95_hz": expected_ci}
    closure |= dict.fromkeys(("sum_hz", "sum_ci95_hz", "difference_pct", "ci95_pct", "closed"))
    races = [line for line in lines if line.name in RACE_LINES and line.harmonic == 1]
    if missing := [line.name for line in races if not line.detected]:
        why = f"{' and '.join(missing)} not detected in this recording, so there is no sum to compare."
        return closure | {"why": why}
    total = sum(line.found_hz or 0.0 for line in races)
    total_ci = math.hypot(*(line.ci95_hz or 0.0 for line in races))
    difference = 100 * (total / expected - 1)
    ci_pct = 100 * math.hypot(total_ci / expected, expected_ci / expected)
    closed = abs(difference) <= ci_pct
    why = "" if closed else "The sum is off by more than its uncertainty: speed or a line is wrong."
    found = {"sum_hz": total, "sum_ci95_hz": total_ci, "difference_pct": difference, "ci95_pct": ci_pct}
    return closure | found | {"closed": closed, "why": why}


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
