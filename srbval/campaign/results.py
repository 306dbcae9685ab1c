"""Result of one case of a campaign: status with reason, numbers with units and, if requested, signals.

A result is one HDF5 file, readable by xarray. Its name is a hash of the case's scene, outputs and code; all engines
write the same bytes. A result with signals is also a run file, so every command that reads run files accepts it.
Status, reason and numbers are also stored as a line of JSON after the HDF5 part, so that they can be read without HDF5.
"""

import enum
import json
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from srbval.errors import ConfigurationError, DataError
from srbval.models.run import USABLE, Run
from srbval.models.run_file import RunWriter
from srbval.scene import Scene
from srbval.storage.hdf5_files import checked_summary, new_hdf5
from srbval.storage.json_files import parse_json, to_json
from srbval.storage.tables import build

Quantities = Mapping[str, tuple[float, str]]  # value and unit
SUMMARY = {"cage_ratio": "1", "bpfo_hz": "Hz", "bpfi_hz": "Hz", "roller_load_share": "1", "energy_imbalance": "1"}


class Output(enum.StrEnum):
    """Requested content of a result.

    ``summary``: cage speed over shaft speed, BPFO, BPFI, the share of the radial load that the rollers carry, and the
    error of the energy balance. ``statistics``: numbers such as RMS and kurtosis of the outer ring's acceleration.
    ``acceleration``: acceleration signals of the outer ring and at the sensor. ``signals``: all signals of a run file.
    """

    SUMMARY = "summary"
    STATISTICS = "statistics"
    ACCELERATION = "acceleration"
    SIGNALS = "signals"


def quantities_of(run: Run, outputs: Sequence[Output]) -> Quantities:
    """Compute the numbers that `outputs` request from a run: value and unit by name; omit NaN and missing numbers.

    The statistics describe the outer ring's vertical motion; `deepest_m` is the deepest penetration of all rollers.
    """
    from srbval.models.sensor import band_rms
    from srbval.reading.pipeline import SIMULATED_BAND_HZ
    from srbval.signal import kurtosis

    found: dict[str, tuple[float | None, str]] = {}
    if Output.SUMMARY in outputs:
        found |= {name: (getattr(run, name), unit) for name, unit in SUMMARY.items()}
    if Output.STATISTICS in outputs:
        samples = run.acceleration_m_s2[:, 1]
        deviation = samples - samples.mean()
        rms = math.sqrt(float(np.mean(deviation * deviation)))
        found |= {
            "rms_m_s2": (rms, "m s-2"),
            "band_rms_m_s2": (band_rms(samples, run.scene.output_rate_hz, SIMULATED_BAND_HZ), "m s-2"),
            "crest_factor": (float(np.max(np.abs(deviation))) / rms if rms else math.nan, "1"),
            "kurtosis": (kurtosis(deviation), "1"),
            "deepest_m": (float(np.max(run.depth_m)), "m"),
            "sag_m": (float(np.mean(run.displacement_m[:, 1])), "m"),
        }
    return {name: (value, unit) for name, (value, unit) in found.items() if value is not None and math.isfinite(value)}


COMPUTED_BY = "srbval.campaign.worker"  # module whose `content_version` is the version of a case's results
REFUSED = "refused"  # the run could not be started
CRASHED = "crashed"  # the process died, or the program has a bug
TIMED_OUT = "timed-out"  # the case exceeded its time limit, so its process was ended
SIGNAL_COLUMNS = {Output.ACCELERATION: 4, Output.SIGNALS: 22}  # columns of 8-byte numbers, time axis included


@dataclass(frozen=True, kw_only=True)
class CaseTask:
    """Everything that a worker needs to run a case.

    `version` is the `content_version` that the worker must have. `limit_s` limits the wall time [s], None for no limit.
    """

    key: str
    version: str
    scene: Scene
    outputs: tuple[Output, ...]
    path: Path
    limit_s: float | None = None


@dataclass(frozen=True, kw_only=True)
class CaseResult:
    """Result of a case; `status` is its run's or, if no run returned one, ``refused``, ``crashed`` or ``timed-out``."""

    key: str
    status: str
    reason: str
    quantities: Quantities = field(default_factory=dict)

    @property
    def usable(self) -> bool:
        """True if the simulation was completed, even if the bearing skids or time-step errors exceed the tolerances."""
        return self.status in USABLE

    @property
    def final(self) -> bool:
        """True if another attempt would end in the same way; otherwise the campaign's next run repeats the case."""
        return self.status not in (CRASHED, TIMED_OUT)


def write_result(path: Path, result: CaseResult, run: Run | None = None, outputs: Collection[Output] = ()) -> None:
    """Write a result, with signals of its `run` if `outputs` request them; raises `DataError` if that fails."""
    with new_hdf5(path) as file:
        if run is None or SIGNAL_COLUMNS.keys().isdisjoint(outputs):
            file.attrs["srbval_kind"] = "campaign-case"
        else:
            writer = RunWriter(file, run.scene, acceleration_only=Output.SIGNALS not in outputs)
            writer.append(run)
            # set to zero first: a deleted attribute leaves its bytes in the file
            writer.finish(replace(run, wall_s=0.0, compile_s=0.0))
            del file.attrs["wall_s"]
        numbers = {name: value for name, (value, _) in result.quantities.items()}
        file.attrs.update({"status": result.status, "reason": result.reason} | numbers)
        file.summary = json.dumps(to_json(result)).encode()


def read_case_result(path: Path) -> CaseResult:
    """Read a result without its signals; raises `DataError` if the file is damaged or cannot be read."""
    try:
        summary = checked_summary(path) if path.is_file() else b""
        if not summary:
            raise ValueError("it has no checksum" if summary is None else "it is not a file")
        result = build(CaseResult, parse_json(summary), "result")
        if result.key != path.stem:
            raise ValueError(f"it contains the result of another case, {result.key[:32]!r}")
        return result
    except (OSError, ValueError, ConfigurationError) as error:
        raise DataError(f"{path}: damaged result of a case ({error}). Run the campaign again to replace it.") from None


def read_intact_result(path: Path) -> CaseResult | None:
    """Read a result without its signals; returns None if the file is missing or damaged."""
    try:
        return read_case_result(path)
    except DataError:
        return None
