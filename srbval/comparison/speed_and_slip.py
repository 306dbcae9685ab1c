"""What part of a line's deviation is the shaft's speed and what part the cage's slip."""

import math
from collections.abc import Iterable, Iterator
from pathlib import Path

from srbval.bearing import RACE_DEFECTS, Bearing, Fault
from srbval.comparison.compared_quantities import RACE_LINE
from srbval.comparison.comparison import Row, deviation_pct
from srbval.comparison.table6 import Table6
from srbval.recordings.datasets.description import PublishedSpeeds, dataset

# The paper reads its lines from spectra of 10 s: half a bin of 0.1 Hz is the least that its values can be off.
PRINTED_CI95_HZ = 0.05


def split_speed_and_slip(
    line: str,
    bearing: Bearing,
    found: tuple[float, float],
    shaft: tuple[float, float],
    *,
    reference_rpm: float,
    **source: str,
) -> Row:
    """A race line's deviation, split: ``(1 + total) = (1 + speed effect) (1 + slip effect)``; all in per cent.

    `found` is the line [Hz], `shaft` the speed of the shaft [rpm], each with its 95 % half width; `reference_rpm` is
    the speed that the deviation refers to; `source` are `record`, `origin` and `speed_source`. `cage_pct` is the slip
    effect as a deviation of the cage: a slipping cage is slower, which lowers BPFO and raises BPFI.
    """
    (found_hz, found_ci95_hz), (shaft_rpm, shaft_ci95_rpm) = found, shaft
    order = {"BPFO": bearing.orders.bpfo, "BPFI": bearing.orders.bpfi}[line]
    slip = deviation_pct(found_hz, order * shaft_rpm / 60)
    reading_pct, speed_ci = 100 * found_ci95_hz / found_hz, 100 * shaft_ci95_rpm / shaft_rpm
    slip_ci, to_cage = math.hypot(reading_pct, speed_ci), cage_factor(line, bearing)
    return source | {
        "line": line,
        "reference_rpm": reference_rpm,
        "shaft_rpm": shaft_rpm,
        "shaft_ci95_rpm": shaft_ci95_rpm,
        "total_pct": deviation_pct(found_hz, order * reference_rpm / 60),
        "total_ci95_pct": reading_pct,
        "speed_pct": deviation_pct(shaft_rpm, reference_rpm),
        "speed_ci95_pct": speed_ci,
        "slip_pct": slip,
        "slip_ci95_pct": slip_ci,
        "cage_pct": to_cage * slip,
        "cage_ci95_pct": abs(to_cage) * slip_ci,
    }


def cage_factor(line: str, bearing: Bearing) -> float:
    """Deviation of the cage per deviation of a race line by slip: 1 for BPFO, larger and negative for BPFI."""
    return {"BPFO": 1.0, "BPFI": -bearing.orders.bpfi / bearing.orders.bpfo}[line]


def record_rows(pairs: Iterable[Row], comparisons: Iterable[Row], bearing: Bearing) -> Iterator[Row]:
    """The race line of each measured record that shows it, counted from the record's nominal speed.

    `pairs` and `comparisons` are those of a validation.
    """
    facts = {one["pair"]: one["measured_facts"] | {"shaft_hz": one["shaft_hz"]["measured"]} for one in pairs}
    for row in comparisons:
        if row["kind"] != RACE_LINE.kind or not row["rig_present"]:
            continue
        of = facts[row["pair"]]
        found = (row["measured_hz"], row["rig_ci95"] * of["shaft_hz"])
        shaft = (60 * of["shaft_hz"], 60 * of["shaft_ci95_hz"])
        source = {"record": Path(row["record"]).stem, "origin": of["origin"], "speed_source": of["shaft_from"]}
        line = Fault(row["state"]).line or ""
        yield split_speed_and_slip(line, bearing, found, shaft, reference_rpm=of["nominal_rpm"], **source)


def table6_rows(printed: Table6, bearing: Bearing) -> Iterator[Row]:
    """The paper's rig lines, with the shaft speed of each state by the published means of the same rig."""
    for state in RACE_DEFECTS:
        found, line = (printed.of(state.value).rig_hz, PRINTED_CI95_HZ), state.line or ""
        shaft = published_rpm(state, float(printed.motor_rpm))
        source = {"record": f"Table 6, rig, {line}", "origin": "published", "speed_source": "published means, between"}
        yield split_speed_and_slip(line, bearing, found, shaft, reference_rpm=printed.shaft_rpm, **source)


def published_speeds() -> PublishedSpeeds:
    """The published tachometer means of the rig's open recordings."""
    speeds = dataset("torino-excerpts").published_speeds
    assert speeds is not None, "a test holds the description to its speeds"
    return speeds


def published_rpm(state: Fault, motor_rpm: float) -> tuple[float, float]:
    """Shaft speed of a state at a motor speed [rpm] by straight line between the published means; 95 % half width.

    The shaft's lag behind the motor differs between the two published speeds; half the difference is taken as the error
    of the interpolated value. Not meant for speeds outside them.
    """
    means = sorted((m.nominal_rpm, m.mean_rpm) for m in published_speeds().means if m.state == state)
    (low, slow), (high, fast) = means
    lag_low, lag_high = low - slow, high - fast
    lag = lag_low + (lag_high - lag_low) * (motor_rpm - low) / (high - low)
    return motor_rpm - lag, abs(lag_high - lag_low) / 2
