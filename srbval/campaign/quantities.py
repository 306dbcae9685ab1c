"""The numbers of a case: one name, one value, one unit each."""

from __future__ import annotations

import enum
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from srbval.models.run import Run


class Output(enum.StrEnum):
    """What is written of a case; the last two are signals, the others numbers."""

    SUMMARY = "summary"
    STATISTICS = "statistics"
    LINES = "lines"
    ACCELERATION = "acceleration"
    SIGNALS = "signals"


ALL_OUTPUTS = tuple(output.value for output in Output)
LINES = ("BPFO", "BPFI", "2xBSF", "FTF")
LEAST_REVOLUTIONS = 12  # of a record whose lines are read, without its ends
ENDS_S = 0.1  # of a record, disturbed by the filter's transients


@dataclass(frozen=True, kw_only=True)
class CaseQuantity:
    """A number with its unit."""

    name: str
    value: float
    unit: str


def quantities_of(run: Run, outputs: Sequence[Output]) -> tuple[CaseQuantity, ...]:
    """The numbers wanted of a run that ended well; those it does not have (NaN, a record too short) are left out."""
    found: list[CaseQuantity] = []
    if Output.SUMMARY in outputs:
        found += _summary(run)
    if Output.STATISTICS in outputs:
        found += _statistics(run)
    if Output.LINES in outputs:
        found += _lines(run)
    return tuple(q for q in found if math.isfinite(q.value))


def _summary(run: Run) -> Iterator[CaseQuantity]:
    yield CaseQuantity(name="cage_ratio", value=run.cage_ratio, unit="1")
    yield CaseQuantity(name="bpfo_hz", value=run.bpfo_hz, unit="Hz")
    yield CaseQuantity(name="bpfi_hz", value=run.bpfi_hz, unit="Hz")
    yield CaseQuantity(name="roller_load_share", value=run.roller_load_share, unit="1")
    yield CaseQuantity(name="energy_imbalance", value=run.energy_imbalance, unit="1")


def _statistics(run: Run) -> Iterator[CaseQuantity]:
    """Of the outer ring's vertical acceleration without its mean; the largest penetration, the ring's mean position."""
    from srbval.bench.measures import band_rms
    from srbval.validation.pipeline import SIMULATED_BAND_HZ

    samples = run.acceleration_m_s2[:, 1]
    deviation = samples - samples.mean()
    power = deviation * deviation
    variance = float(np.mean(power))
    rms = math.sqrt(variance)
    yield CaseQuantity(name="rms_m_s2", value=rms, unit="m s-2")
    yield CaseQuantity(
        name="band_rms_m_s2", value=band_rms(samples, run.scene.output_rate_hz, SIMULATED_BAND_HZ), unit="m s-2"
    )
    peak = float(np.max(np.abs(deviation)))
    yield CaseQuantity(name="crest_factor", value=peak / rms if rms else math.nan, unit="1")
    kurtosis = float(np.mean(power * power)) / variance**2 if variance else math.nan
    yield CaseQuantity(name="kurtosis", value=kurtosis, unit="1")
    yield CaseQuantity(name="deepest_m", value=float(np.max(run.depth_m)), unit="m")
    yield CaseQuantity(name="sag_m", value=float(np.mean(run.displacement_m[:, 1])), unit="m")


def _lines(run: Run) -> Iterator[CaseQuantity]:
    """First harmonics of the fault lines, read as in every recording; none where the record is too short."""
    from srbval.bearing import load_bearing
    from srbval.recordings import recording_from_run
    from srbval.validation.analyse import analyse

    if (run.seconds - ENDS_S) * run.scene.shaft_hz < LEAST_REVOLUTIONS:
        return
    analysis = analyse(recording_from_run(run), bearing=load_bearing(run.scene.bearing))
    for name in LINES:
        line = analysis.line(name)
        if line.found_hz is None:
            continue
        yield CaseQuantity(name=f"{name}_hz", value=line.found_hz, unit="Hz")
        yield CaseQuantity(name=f"{name}_ci95_hz", value=_number(line.ci95_hz), unit="Hz")
        yield CaseQuantity(name=f"{name}_deviation_pct", value=_number(line.deviation_pct), unit="%")
        yield CaseQuantity(name=f"{name}_snr", value=_number(line.snr), unit="1")
        yield CaseQuantity(name=f"{name}_detected", value=float(line.detected), unit="1")


def _number(value: float | None) -> float:
    return math.nan if value is None else value
