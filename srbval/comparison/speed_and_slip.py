"""What part of a line's deviation is the shaft's speed and what part the cage's slip."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from srbval.bearing import RACE_DEFECTS, Bearing, Fault
from srbval.comparison.comparison import deviation_pct
from srbval.comparison.matrix import MatrixCell
from srbval.comparison.table6 import Table6
from srbval.recordings import Origin
from srbval.recordings.datasets.description import PublishedSpeeds, dataset

# The paper reads its lines from spectra of 10 s: half a bin of 0.1 Hz is the least that its values can be off.
PRINTED_CI95_HZ = 0.05


@dataclass(frozen=True, kw_only=True)
class LineAtSpeed:
    """A race line: `reference_rpm` is the speed its deviation is counted from, `shaft_rpm` the one the shaft had."""

    record: str
    origin: str
    line: str
    reference_rpm: float
    shaft_rpm: float
    shaft_ci95_rpm: float
    speed_source: str


@dataclass(frozen=True, kw_only=True)
class SpeedAndSlip(LineAtSpeed):
    """A line's deviation, split: ``(1 + total) = (1 + speed effect) (1 + slip effect)``; all in per cent.

    `cage_pct` is what the slip effect means for the cage: a slipping cage is slower, which
    lowers BPFO and raises BPFI. Intervals are 95 % half widths.
    """

    total_pct: float
    total_ci95_pct: float
    speed_pct: float
    speed_ci95_pct: float
    slip_pct: float
    slip_ci95_pct: float
    cage_pct: float
    cage_ci95_pct: float


def split_speed_and_slip(line: LineAtSpeed, bearing: Bearing, found_hz: float, found_ci95_hz: float) -> SpeedAndSlip:
    """Speed and slip effects of a race line that was read at `found_hz` [Hz]."""
    order = {"BPFO": bearing.orders.bpfo, "BPFI": bearing.orders.bpfi}[line.line]
    slip = deviation_pct(found_hz, order * line.shaft_rpm / 60)
    reading_pct, speed_ci = 100 * found_ci95_hz / found_hz, 100 * line.shaft_ci95_rpm / line.shaft_rpm
    slip_ci = math.hypot(reading_pct, speed_ci)
    to_cage = cage_factor(line.line, bearing)
    return SpeedAndSlip(
        **vars(line),
        total_pct=deviation_pct(found_hz, order * line.reference_rpm / 60),
        total_ci95_pct=reading_pct,
        speed_pct=deviation_pct(line.shaft_rpm, line.reference_rpm),
        speed_ci95_pct=speed_ci,
        slip_pct=slip,
        slip_ci95_pct=slip_ci,
        cage_pct=to_cage * slip,
        cage_ci95_pct=abs(to_cage) * slip_ci,
    )


def cage_factor(line: str, bearing: Bearing) -> float:
    """Deviation of the cage per deviation of a race line by slip: 1 for BPFO, larger and negative for BPFI."""
    return {"BPFO": 1.0, "BPFI": -bearing.orders.bpfi / bearing.orders.bpfo}[line]


def matrix_rows(cells: Iterable[MatrixCell], bearing: Bearing) -> Iterator[SpeedAndSlip]:
    """The race line of each faulted record of the rig that shows it, counted from the record's nominal speed."""
    for cell in cells:
        if cell.state not in RACE_DEFECTS or not cell.line.detected or cell.line.found_hz is None:
            continue
        line = LineAtSpeed(
            record=Path(cell.file).stem,
            origin=Origin.MEASURED.value,
            line=cell.line.name,
            reference_rpm=cell.nominal_rpm,
            shaft_rpm=cell.shaft_rpm,
            shaft_ci95_rpm=60 * cell.speed.ci95_hz,
            speed_source=cell.speed.source.value,
        )
        yield split_speed_and_slip(line, bearing, cell.line.found_hz, cell.line.ci95_hz or 0.0)


def table6_rows(printed: Table6, bearing: Bearing) -> Iterator[SpeedAndSlip]:
    """The paper's rig lines, with the shaft speed each state had by the published means of the same rig."""
    for state in RACE_DEFECTS:
        rpm, ci95 = published_rpm(state, float(printed.motor_rpm))
        line = LineAtSpeed(
            record=f"Table 6, rig, {state.line}",
            origin="published",
            line=state.line or "",
            reference_rpm=printed.shaft_rpm,
            shaft_rpm=rpm,
            shaft_ci95_rpm=ci95,
            speed_source="published means, between",
        )
        yield split_speed_and_slip(line, bearing, printed.of(state.value).rig_hz, PRINTED_CI95_HZ)


def published_speeds() -> PublishedSpeeds:
    """The published tachometer means of the rig's open recordings."""
    speeds = dataset("torino-excerpts").published_speeds
    assert speeds is not None, "a test holds the description to its speeds"
    return speeds


def published_rpm(state: Fault, motor_rpm: float) -> tuple[float, float]:
    """Shaft speed of a state at a motor speed [rpm] by straight line between the published means; 95 % half width.

    What the shaft lags behind the motor changes between the two published speeds; half that change is taken
    as the error of the interpolated value. Not meant for speeds outside them.
    """
    (low, slow), (high, fast) = sorted(
        (m.nominal_rpm, m.mean_rpm) for m in published_speeds().means if m.state == state
    )
    lag_low, lag_high = low - slow, high - fast
    lag = lag_low + (lag_high - lag_low) * (motor_rpm - low) / (high - low)
    return motor_rpm - lag, abs(lag_high - lag_low) / 2


def one_speed_reading(printed: Table6, bearing: Bearing) -> tuple[float, float]:
    """If both of the paper's rig lines came from one speed: that speed [rpm] and the cage's deviation [%]."""
    outer, inner = printed.of("outer").rig_hz, printed.of("inner").rig_hz
    shaft_hz = (outer + inner) / bearing.rolling_elements
    return 60 * shaft_hz, deviation_pct(outer, bearing.orders.bpfo * shaft_hz)
