"""What a case leaves behind in numbers: one name, one value, one unit each."""

from __future__ import annotations

import enum
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from srbval.models.run import Run


class Output(enum.StrEnum):
    """What is kept of a case; the last two are signals, the others numbers."""

    SUMMARY = "summary"
    STATISTICS = "statistics"
    LINES = "lines"
    ACCELERATION = "acceleration"
    SIGNALS = "signals"


ALL_OUTPUTS = tuple(output.value for output in Output)
LINES = ("BPFO", "BPFI", "2xBSF", "FTF")
LEAST_REVOLUTIONS = 12  # of a record whose lines are read, the ends that the filter spoils included
ENDS_S = 0.1


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A number with its unit."""

    name: str
    value: float
    unit: str


def quantities_of(run: Run, outputs: Sequence[Output]) -> tuple[Quantity, ...]:
    """The numbers wanted of a run that ended well; those it does not have (NaN, a record too short) are left out."""
    found: list[Quantity] = []
    if Output.SUMMARY in outputs:
        found += _summary(run)
    if Output.STATISTICS in outputs:
        found += _statistics(run)
    if Output.LINES in outputs:
        found += _lines(run)
    return tuple(q for q in found if math.isfinite(q.value))


def _summary(run: Run) -> Iterator[Quantity]:
    yield Quantity(name="cage_ratio", value=run.cage_ratio, unit="1")
    yield Quantity(name="bpfo_hz", value=run.bpfo_hz, unit="Hz")
    yield Quantity(name="bpfi_hz", value=run.bpfi_hz, unit="Hz")
    yield Quantity(name="roller_load_share", value=run.roller_load_share, unit="1")
    yield Quantity(name="energy_imbalance", value=run.energy_imbalance, unit="1")


def _statistics(run: Run) -> Iterator[Quantity]:
    """Of the outer ring's vertical acceleration, its mean taken off; and how deep, how far."""
    from srbval.bench.measures import band_rms
    from srbval.validation.pipeline import SIMULATED_BAND_HZ

    samples = run.acceleration_m_s2[:, 1]
    deviation = samples - samples.mean()
    power = deviation * deviation
    variance = float(np.mean(power))
    rms = math.sqrt(variance)
    yield Quantity(name="rms_m_s2", value=rms, unit="m s-2")
    yield Quantity(
        name="band_rms_m_s2", value=band_rms(samples, run.scene.output_rate_hz, SIMULATED_BAND_HZ), unit="m s-2"
    )
    peak = float(np.max(np.abs(deviation)))
    yield Quantity(name="crest_factor", value=peak / rms if rms else math.nan, unit="1")
    kurtosis = float(np.mean(power * power)) / variance**2 if variance else math.nan
    yield Quantity(name="kurtosis", value=kurtosis, unit="1")
    yield Quantity(name="deepest_m", value=float(np.max(run.depth_m)), unit="m")
    yield Quantity(name="sag_m", value=float(np.mean(run.displacement_m[:, 1])), unit="m")


def _lines(run: Run) -> Iterator[Quantity]:
    """First harmonics of the fault lines, read as in every recording; none where the record is too short."""
    from srbval.bearing import load_bearing
    from srbval.recordings.from_run import recording_from_run
    from srbval.validation.analyse import analyse

    if (run.seconds - ENDS_S) * run.scene.shaft_hz < LEAST_REVOLUTIONS:
        return
    analysis = analyse(recording_from_run(run), bearing=load_bearing(run.scene.bearing))
    for name in LINES:
        line = analysis.line(name)
        if line.found_hz is None:
            continue
        yield Quantity(name=f"{name}_hz", value=line.found_hz, unit="Hz")
        yield Quantity(name=f"{name}_ci95_hz", value=_number(line.ci95_hz), unit="Hz")
        yield Quantity(name=f"{name}_deviation_pct", value=_number(line.deviation_pct), unit="%")
        yield Quantity(name=f"{name}_snr", value=_number(line.snr), unit="1")
        yield Quantity(name=f"{name}_detected", value=float(line.detected), unit="1")


def _number(value: float | None) -> float:
    return math.nan if value is None else value
