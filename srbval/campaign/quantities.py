"""The numbers of a case: a value and a unit by name."""

import enum
import itertools
import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from srbval.bearing import DEFECTS, load_bearing
from srbval.errors import DataError
from srbval.models.run import Run

Quantities = Mapping[str, tuple[float, str]]  # value and unit
Row = tuple[str, float | None, str]
SUMMARY = {"cage_ratio": "1", "bpfo_hz": "Hz", "bpfi_hz": "Hz", "roller_load_share": "1", "energy_imbalance": "1"}
LEAST_REVOLUTIONS = 12  # of a record whose lines are read, without its ends
ENDS_S = 0.1  # of a record, disturbed by the filter's transients


class Output(enum.StrEnum):
    """Content of a result: numbers, or with the last two also signals."""

    SUMMARY = "summary"
    STATISTICS = "statistics"
    LINES = "lines"
    ACCELERATION = "acceleration"
    SIGNALS = "signals"


def quantities_of(run: Run, outputs: Sequence[Output]) -> Quantities:
    """The wanted numbers of a run that ended well; numbers that it does not have (NaN, a short record) are left out."""
    readers = {Output.SUMMARY: _summary, Output.STATISTICS: _statistics, Output.LINES: _lines}
    rows = itertools.chain.from_iterable(read(run) for output, read in readers.items() if output in outputs)
    return {name: (value, unit) for name, value, unit in rows if value is not None and math.isfinite(value)}


def _summary(run: Run) -> Iterator[Row]:
    return ((name, getattr(run, name), unit) for name, unit in SUMMARY.items())


def _statistics(run: Run) -> Iterator[Row]:
    """Numbers of the outer ring's vertical acceleration without its mean, largest penetration, mean position."""
    from srbval.models.sensor import band_rms
    from srbval.reading.pipeline import SIMULATED_BAND_HZ
    from srbval.signal import kurtosis

    samples = run.acceleration_m_s2[:, 1]
    deviation = samples - samples.mean()
    rms = math.sqrt(float(np.mean(deviation * deviation)))
    yield "rms_m_s2", rms, "m s-2"
    yield "band_rms_m_s2", band_rms(samples, run.scene.output_rate_hz, SIMULATED_BAND_HZ), "m s-2"
    yield "crest_factor", float(np.max(np.abs(deviation))) / rms if rms else None, "1"
    yield "kurtosis", kurtosis(deviation), "1"
    yield "deepest_m", float(np.max(run.depth_m)), "m"
    yield "sag_m", float(np.mean(run.displacement_m[:, 1])), "m"


def _lines(run: Run) -> Iterator[Row]:
    """First harmonics of the fault lines, read as in every recording; none if the record is too short or constant."""
    from srbval.reading.analyse import analyse
    from srbval.recordings import recording_from_run

    if (run.seconds - ENDS_S) * run.scene.shaft_hz < LEAST_REVOLUTIONS:
        return
    try:
        analysis = analyse(recording_from_run(run), bearing=load_bearing(run.scene.bearing))
    except DataError:
        return
    for name in (*(fault.line or "" for fault in DEFECTS), "FTF"):
        line = analysis.line(name)
        if line.found_hz is not None:
            yield f"{name}_hz", line.found_hz, "Hz"
            yield f"{name}_ci95_hz", line.ci95_hz, "Hz"
            yield f"{name}_deviation_pct", line.deviation_pct, "%"
            yield f"{name}_snr", line.snr, "1"
            yield f"{name}_detected", float(line.detected), "1"
