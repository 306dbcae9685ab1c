"""Result files: HDF5, one a case, readable by xarray; the same case gives the same bytes, wherever and whenever it ran.

A case with signals is a run file too, so that every command that reads runs reads it.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from srbval.campaign.quantities import Output, Quantity
from srbval.campaign.task import Ending
from srbval.errors import DataError
from srbval.models.run import Run
from srbval.models.run_file import scene_dict, write_run
from srbval.scene import Scene
from srbval.storage.own_hdf5 import SCHEMA_VERSION
from srbval.storage.whole_file import whole_file

KIND = "campaign-case"
KEPT_SIGNALS = ("acceleration_m_s2",)
TABLE = ("quantity", "value", "unit")


@dataclass(frozen=True, kw_only=True)
class Result:
    """A result as it was read: how the case ended, why, its numbers, its scene as plain values."""

    ending: Ending
    reason: str
    quantities: tuple[Quantity, ...]
    scene: dict[str, Any]


def write_result(path: Path, run: Run, quantities: Sequence[Quantity], outputs: Sequence[Output]) -> None:
    """Write what is wanted of a run that ended well, whole or not at all; `OSError` where that fails."""
    with whole_file(path) as part:
        if Output.SIGNALS in outputs:
            write_run(_without_clock(run), part)
        elif Output.ACCELERATION in outputs:
            write_run(_without_clock(_acceleration_only(run)), part)
        _add(part, run.scene, Ending.OK, run.reason, quantities)


def write_failure(path: Path, scene: Scene | None, ending: Ending, reason: str) -> None:
    """Write why a case has no result."""
    with whole_file(path) as part:
        _add(part, scene, ending, reason, ())


def read_result(path: Path) -> Result:
    """Read a result file without its signals; `DataError` where it is none."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            columns = [file[name][()] for name in TABLE] if TABLE[0] in file else [[], [], []]
            return Result(
                ending=Ending(str(file.attrs["ending"])),
                reason=str(file.attrs["reason"]),
                scene=json.loads(str(file.attrs["scene"])),
                quantities=tuple(
                    Quantity(name=name.decode(), value=float(value), unit=unit.decode())
                    for name, value, unit in zip(*columns, strict=True)
                ),
            )
    except (OSError, KeyError, ValueError) as error:
        raise DataError(
            f"{path}: not a result of a campaign ({error}). Remove it and run the campaign again."
        ) from None


def _add(part: Path, scene: Scene | None, ending: Ending, reason: str, quantities: Sequence[Quantity]) -> None:
    """Add ending and numbers to a run file, or to a new file where `part` is empty."""
    import h5py

    fresh = part.stat().st_size == 0
    with h5py.File(part, "w" if fresh else "r+", track_order=True) as file:
        if fresh:
            content = {} if scene is None else scene_dict(scene)
            file.attrs.update({"schema_version": SCHEMA_VERSION, "srbval_kind": KIND, "scene": json.dumps(content)})
        else:
            del file.attrs["wall_s"]  # the clock has no place in it
        file.attrs.update({"ending": ending.value, "reason": reason})
        if quantities:
            names = file.create_dataset(TABLE[0], data=np.array([q.name for q in quantities], dtype="S"))
            names.make_scale(TABLE[0])
            values = file.create_dataset(TABLE[1], data=np.array([q.value for q in quantities]))
            units = file.create_dataset(TABLE[2], data=np.array([q.unit for q in quantities], dtype="S"))
            for dataset in (values, units):
                dataset.dims[0].attach_scale(names)


def _without_clock(run: Run) -> Run:
    return replace(run, wall_s=0.0, compile_s=0.0)


def _acceleration_only(run: Run) -> Run:
    """The run with its other signals empty; what is empty is not written."""
    empty = {
        f.name: np.full_like(getattr(run, f.name), np.nan)
        for f in fields(run)
        if isinstance(getattr(run, f.name), np.ndarray) and f.name not in (*KEPT_SIGNALS, "spin_rad_s", "load_n")
    }
    energy = replace(
        run.energy, **{f.name: np.full_like(getattr(run.energy, f.name), np.nan) for f in fields(run.energy)}
    )
    return replace(run, **empty, energy=energy)
