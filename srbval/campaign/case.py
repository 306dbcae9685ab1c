"""A case of a campaign: as planned, as a worker gets it, and how it ended; the file of its result.

A result's file is HDF5, one per case, readable by xarray; the same case gives the same bytes, wherever it ran. One with
signals is a run file too, so that every command that reads runs reads it. What a campaign itself needs of a result
stands in the summary behind the file's end, next to its checksum: HDF5 is not asked.
"""

import enum
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from srbval.campaign.quantities import CaseQuantity, Output
from srbval.errors import DataError
from srbval.models.run import USABLE, Run
from srbval.models.run_file import RunWriter, scene_dict
from srbval.scene import Scene
from srbval.storage.hdf5_files import CHECKED, checked_summary, new_hdf5
from srbval.storage.json_files import checked_line, from_json, read_checked_line
from srbval.storage.sources import content_version

COMPUTED_BY = "srbval.campaign.work"
KEY = re.compile("[0-9a-f]{32}")  # of a result
KIND = "campaign-case"
ACCELERATION_SIGNALS = ("acceleration_m_s2", "spin_rad_s", "load_n")  # of output `acceleration`; the last two bare
SUMMARY = ("key", "ending", "reason", "quantities")  # of a result, in its file
ELSEWHERE = {"wall_s": 0.0, "simulation_s": 0.0, "found": False, "at_utc": ""}
GUESSED_S = 2e-5  # wall time of one right-hand side of the full model on a slow machine


class Ending(enum.StrEnum):
    """How a case ended."""

    OK = "ok"
    INACCURATE = "inaccurate"  # these three as in `RunStatus`, with a result
    SKIDDING = "skidding"
    ROLLERS_UNLOADED = "rollers-unloaded"
    FAILED = "failed"  # the numerics: the reason begins with the run's own status
    REFUSED = "refused"  # no run could be started
    CRASHED = "crashed"  # its process died, or the program has a bug
    TIMED_OUT = "timed-out"  # it exceeded its time limit, so its process was ended
    UNWRITTEN = "unwritten"  # the result could not be written

    @property
    def usable(self) -> bool:
        """Is there a result that may be read as the vibration of the scene's bearing?"""
        return self.value in USABLE

    @property
    def final(self) -> bool:
        """Would another try end the same? The next run of the campaign tries the others again."""
        return self not in (Ending.CRASHED, Ending.TIMED_OUT, Ending.UNWRITTEN)


@dataclass(frozen=True, kw_only=True, slots=True)
class CampaignCase:
    """A case as planned.

    `key` names its result; `point` is what it changes in the base scene, by dotted key; `weight` is its cost in
    right-hand sides of the full model; `expected_s` the wall time on the calibration's machine, None where unknown;
    `refused` says why no scene could be made of the point.
    """

    index: int
    key: str
    point: Mapping[str, Any]
    model: str
    solver: str
    weight: float
    expected_s: float | None
    expected_bytes: int
    refused: str | None = None

    @property
    def planned_s(self) -> float:
        """`expected_s`, or a rough guess from the weight where that is unknown; the longest cases run first."""
        return GUESSED_S * self.weight if self.expected_s is None else self.expected_s


@dataclass(frozen=True, kw_only=True)
class CaseTask:
    """What a worker needs to run a case: the scene, the outputs wanted, the file of the result, and the limit of wall
    time, None for none.
    """

    key: str
    scene: Scene
    outputs: tuple[Output, ...]
    path: Path
    limit_s: float | None = None


@dataclass(frozen=True, kw_only=True)
class CaseResult:
    """How a case ended, and its numbers.

    `wall_s` of the whole case, `simulation_s` of the simulation alone; `found`: the result existed already and nothing
    was run. These and `at_utc` stand in the journal, not in the result's file, which is the same wherever the case ran.
    """

    key: str
    ending: Ending
    reason: str
    quantities: tuple[CaseQuantity, ...] = ()
    wall_s: float = 0.0
    simulation_s: float = 0.0
    found: bool = False
    at_utc: str = ""


def version() -> str:
    """Version of everything that runs a case and measures it."""
    return content_version(COMPUTED_BY)


def write_result(path: Path, result: CaseResult, scene: Scene | None, signals: Run | None = None) -> None:
    """Write a case's numbers, or why it has none, and the `signals` of its run; whole or not at all.

    `scene` is None where none could be made. Raises `DataError` where the file cannot be written.
    """
    with new_hdf5(path) as file:
        if signals is None:
            content = {} if scene is None else scene_dict(scene)
            file.attrs.update({"srbval_kind": KIND, "scene": json.dumps(content)})
            file.attrs.update({"ending": result.ending.value, "reason": result.reason})
        else:
            writer = RunWriter(file, signals.scene, check_written=file.check_written)
            writer.append({f.name: getattr(signals, f.name) for f in fields(signals)})
            # zero, for a deleted attribute leaves its bytes in the file
            writer.finish(replace(signals, wall_s=0.0, compile_s=0.0))
            del file.attrs["wall_s"]
            file.attrs["ending"] = result.ending.value
        if result.quantities:
            table = {"quantity": np.array([q.name for q in result.quantities], dtype="S"),
                     "value": np.array([q.value for q in result.quantities]),
                     "unit": np.array([q.unit for q in result.quantities], dtype="S")}  # fmt: skip
            scale, *columns = (file.create_dataset(name, data=data, **CHECKED) for name, data in table.items())
            scale.make_scale("quantity")
            for column in columns:
                column.dims[0].attach_scale(scale)
        file.summary = checked_line({name: getattr(result, name) for name in SUMMARY})


def read_result(path: Path) -> CaseResult:
    """Read a result without its signals; `DataError` where it is not as it was written, or cannot be read."""
    try:
        summary = checked_summary(path)
        if summary is None:
            raise ValueError("it has no checksum")
        result = from_json(CaseResult, read_checked_line(summary) | ELSEWHERE)
        if result.key != path.stem:
            raise ValueError(f"it is the result of case {result.key[:32]!r}")
        return result
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: damaged: it is not a result of this case ({error}).") from None


def acceleration_only(run: Run) -> Run:
    """The run with NaN for its other signals, which are then not written."""

    def blank(part: Any, *kept: str) -> dict[str, Any]:
        found = {f.name: getattr(part, f.name) for f in fields(part) if f.name not in kept}
        return {n: np.broadcast_to(np.nan, v.shape) for n, v in found.items() if isinstance(v, np.ndarray)}

    return replace(run, **blank(run, *ACCELERATION_SIGNALS), energy=replace(run.energy, **blank(run.energy)))
