"""Result files: HDF5, one a case, readable by xarray; the same case gives the same bytes, wherever and whenever it ran.

A case with signals is a run file too, so that every command that reads runs reads it.
"""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from srbval.campaign.quantities import Output, Quantity
from srbval.campaign.task import Ending
from srbval.errors import DataError
from srbval.models.run import FloatArray, Run
from srbval.models.run_file import RunWriter, scene_dict
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
    image = io.BytesIO()
    if {Output.SIGNALS, Output.ACCELERATION} & set(outputs):
        kept = run if Output.SIGNALS in outputs else _acceleration_only(run)
        with _ImageWriter(image, run.scene) as writer:
            writer.append({f.name: getattr(kept, f.name) for f in fields(kept)})
            writer.finish(replace(kept, wall_s=0.0, compile_s=0.0))  # what is deleted leaves its bytes behind
            writer.complete(quantities)
    else:
        _write_numbers(image, run.scene, Ending.OK, run.reason, quantities)
    _put(path, image)


def write_failure(path: Path, scene: Scene | None, ending: Ending, reason: str) -> None:
    """Write why a case has no result."""
    image = io.BytesIO()
    _write_numbers(image, scene, ending, reason, ())
    _put(path, image)


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


class _ImageWriter(RunWriter):
    """Writes a run file into memory: HDF5 on a full disk takes the process with it, a plain write does not."""

    def __init__(self, image: io.BytesIO, scene: Scene) -> None:
        super().__init__(Path(), scene)
        self._image = image

    def __enter__(self) -> Self:
        import h5py

        self._file = self._stack.enter_context(h5py.File(self._image, "w", track_order=True))
        return self

    def _extend(self, name: str, values: FloatArray, units: str, long_name: str) -> None:
        """Put each variable down at once: HDF5 else orders them by when it happens to let go of them."""
        super()._extend(name, values, units, long_name)
        self._file.flush()

    def complete(self, quantities: Sequence[Quantity]) -> None:
        """Add the numbers; the clock has no place in the file."""
        del self._file.attrs["wall_s"]
        self._file.attrs["ending"] = Ending.OK.value
        _add(self._file, quantities)


def _write_numbers(
    image: io.BytesIO, scene: Scene | None, ending: Ending, reason: str, quantities: Sequence[Quantity]
) -> None:
    import h5py

    content = {} if scene is None else scene_dict(scene)
    with h5py.File(image, "w", track_order=True) as file:
        file.attrs.update({"schema_version": SCHEMA_VERSION, "srbval_kind": KIND, "scene": json.dumps(content)})
        file.attrs.update({"ending": ending.value, "reason": reason})
        _add(file, quantities)


def _add(file: Any, quantities: Sequence[Quantity]) -> None:
    if not quantities:
        return
    names = file.create_dataset(TABLE[0], data=np.array([q.name for q in quantities], dtype="S"))
    names.make_scale(TABLE[0])
    values = file.create_dataset(TABLE[1], data=np.array([q.value for q in quantities]))
    units = file.create_dataset(TABLE[2], data=np.array([q.unit for q in quantities], dtype="S"))
    for dataset in (values, units):
        dataset.dims[0].attach_scale(names)


def _put(path: Path, image: io.BytesIO) -> None:
    with whole_file(path) as part:
        part.write_bytes(image.getbuffer())


def _acceleration_only(run: Run) -> Run:
    """The run with its other signals empty; what is empty is not written."""
    empty: dict[str, Any] = {
        f.name: np.broadcast_to(np.nan, getattr(run, f.name).shape)
        for f in fields(run)
        if isinstance(getattr(run, f.name), np.ndarray) and f.name not in (*KEPT_SIGNALS, "spin_rad_s", "load_n")
    }
    energy = replace(
        run.energy, **{f.name: np.broadcast_to(np.nan, getattr(run.energy, f.name).shape) for f in fields(run.energy)}
    )
    return replace(run, **empty, energy=energy)
