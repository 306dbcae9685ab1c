"""The ending of a case, and the file of its result.

A result is one HDF5 file, readable by xarray and named by its content; the same case gives the same bytes wherever it
is run. A result with signals is also a run file, which every command that reads runs accepts. The ending, the reason
and the numbers are a line of JSON behind the HDF5 part, beside the checksum of the file, so HDF5 is not needed to read
them.
"""

import enum
import json
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from srbval.campaign.quantities import Output, Quantities
from srbval.errors import DataError
from srbval.models.run import USABLE, Run
from srbval.models.run_file import RunWriter, scene_dict
from srbval.scene import Scene
from srbval.storage.hdf5_files import CHECKED, checked_summary, new_hdf5
from srbval.storage.json_files import from_json, parse_json, to_json

KIND = "campaign-case"
ACCELERATION_SIGNALS = ("acceleration_m_s2", "spin_rad_s", "load_n")  # of output `acceleration`; the last two empty


class Ending(enum.StrEnum):
    """Ending of a case."""

    OK = "ok"
    INACCURATE = "inaccurate"  # this status and the next two, as in `RunStatus`, come with a result
    SKIDDING = "skidding"
    ROLLERS_UNLOADED = "rollers-unloaded"
    FAILED = "failed"  # the numerics failed; the reason begins with the status of the run
    REFUSED = "refused"  # no run could be started
    CRASHED = "crashed"  # the process died, or the program has a bug
    TIMED_OUT = "timed-out"  # the case exceeded its time limit, so its process was ended
    UNWRITTEN = "unwritten"  # the result could not be written

    @property
    def usable(self) -> bool:
        """True if the result may be read as the vibration of the scene's bearing."""
        return self.value in USABLE

    @property
    def final(self) -> bool:
        """True if another try would end the same; the next run of the campaign tries the other cases again."""
        return self not in (Ending.CRASHED, Ending.TIMED_OUT, Ending.UNWRITTEN)


@dataclass(frozen=True, kw_only=True)
class CaseTask:
    """All that a worker needs to run a case; `limit_s` limits the wall time, None for no limit."""

    key: str
    scene: Scene
    outputs: tuple[Output, ...]
    path: Path
    limit_s: float | None = None


@dataclass(frozen=True, kw_only=True)
class CaseResult:
    """Ending of a case, and its numbers. `simulation_s` is the wall time of the simulation, 0 if read from a file."""

    key: str
    ending: Ending
    reason: str
    quantities: Quantities = field(default_factory=dict)
    simulation_s: float = 0.0


def write_result(path: Path, result: CaseResult, scene: Scene | None, signals: Run | None = None) -> None:
    """Write the numbers of a case, or the reason why it has none, and the `signals` of its run; whole or not at all.

    `scene` is None if no scene could be made. Raises `DataError` if the file cannot be written.
    """
    with new_hdf5(path) as file:
        if signals is None:
            content = {} if scene is None else scene_dict(scene)
            file.attrs.update({"srbval_kind": KIND, "scene": json.dumps(content)})
            file.attrs.update({"ending": result.ending.value, "reason": result.reason})
        else:
            writer = RunWriter(file, signals.scene, check_written=file.check_written)
            writer.append({f.name: getattr(signals, f.name) for f in fields(signals)})
            # zero, because a deleted attribute leaves its bytes in the file
            writer.finish(replace(signals, wall_s=0.0, compile_s=0.0))
            del file.attrs["wall_s"]
            file.attrs["ending"] = result.ending.value
        if result.quantities:
            values, units = zip(*result.quantities.values(), strict=True)
            table = {"quantity": np.array([*result.quantities], dtype="S"), "value": np.array(values)}
            table |= {"unit": np.array(units, dtype="S")}
            scale, *columns = (file.create_dataset(name, data=data, **CHECKED) for name, data in table.items())
            scale.make_scale("quantity")
            for column in columns:
                column.dims[0].attach_scale(scale)
        file.summary = json.dumps(to_json(replace(result, simulation_s=0.0))).encode()


def read_result(path: Path) -> CaseResult:
    """Read a result without its signals; `DataError` if it is not as it was written, or cannot be read."""
    try:
        summary = checked_summary(path) if path.is_file() else b""
        if not summary:
            raise ValueError("it has no checksum" if summary is None else "it is not a file")
        result = from_json(CaseResult, parse_json(summary))
        if result.key != path.stem:
            raise ValueError(f"it is the result of case {result.key[:32]!r}")
        return result
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: damaged: it is not a result of this case ({error}).") from None


def final_result(path: Path) -> CaseResult | None:
    """The result in a file if it is intact and final, so that its case need not be run."""
    try:
        result = read_result(path)
    except DataError:
        return None
    return result if result.ending.final else None


def acceleration_only(run: Run) -> Run:
    """The run with NaN for its other signals, which are then not written."""

    def blank(part: Any, *kept: str) -> dict[str, Any]:
        found = {f.name: getattr(part, f.name) for f in fields(part) if f.name not in kept}
        return {n: np.broadcast_to(np.nan, v.shape) for n, v in found.items() if isinstance(v, np.ndarray)}

    return replace(run, **blank(run, *ACCELERATION_SIGNALS), energy=replace(run.energy, **blank(run.energy)))
