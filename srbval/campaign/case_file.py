"""Result files: HDF5, one per case, readable by xarray; the same case gives the same bytes, wherever it ran.

A case with signals is a run file too, so that every command that reads runs reads it.
"""

import io
import json
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.campaign.case import Ending
from srbval.campaign.quantities import CaseQuantity, Output
from srbval.errors import DataError
from srbval.models.run import Run
from srbval.models.run_file import RunWriter, scene_dict
from srbval.scene import Scene
from srbval.storage.own_hdf5 import SCHEMA_VERSION
from srbval.storage.whole_file import whole_file

KIND = "campaign-case"
ACCELERATION_SIGNALS = ("acceleration_m_s2", "spin_rad_s", "load_n")  # of output `acceleration`; the last two bare
TABLE = ("quantity", "value", "unit")


@dataclass(frozen=True, kw_only=True)
class CaseResult:
    """A result as read: how the case ended, why, its numbers, its scene as plain values."""

    ending: Ending
    reason: str
    quantities: tuple[CaseQuantity, ...]
    scene: dict[str, Any]


def write_result(path: Path, run: Run, quantities: Sequence[CaseQuantity], outputs: Sequence[Output]) -> None:
    """Write the `outputs` of a run that ended well, whole or not at all; `OSError` where that fails."""
    import h5py

    image = io.BytesIO()
    if {Output.SIGNALS, Output.ACCELERATION} & set(outputs):
        signals = run if Output.SIGNALS in outputs else _acceleration_only(run)
        with h5py.File(image, "w", track_order=True) as file:
            writer = _ImageWriter(file, run.scene)
            writer.append({f.name: getattr(signals, f.name) for f in fields(signals)})
            writer.finish(
                replace(signals, wall_s=0.0, compile_s=0.0)
            )  # a deleted attribute leaves its bytes in the file
            writer.complete(quantities)
    else:
        _write_numbers(image, run.scene, Ending.OK, run.reason, quantities)
    _write(path, image)


def write_failure(path: Path, scene: Scene | None, ending: Ending, reason: str) -> None:
    """Write why a case has no result."""
    image = io.BytesIO()
    _write_numbers(image, scene, ending, reason, ())
    _write(path, image)


def read_result(path: Path) -> CaseResult:
    """Read a result file without its signals; `DataError` where it is not one."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            columns = [file[name][()] for name in TABLE] if TABLE[0] in file else [[], [], []]
            return CaseResult(
                ending=Ending(str(file.attrs["ending"])),
                reason=str(file.attrs["reason"]),
                scene=json.loads(str(file.attrs["scene"])),
                quantities=tuple(
                    CaseQuantity(name=name.decode(), value=float(value), unit=unit.decode())
                    for name, value, unit in zip(*columns, strict=True)
                ),
            )
    except (OSError, KeyError, ValueError) as error:
        raise DataError(
            f"{path}: not a result of a campaign ({error}). Remove it and run the campaign again."
        ) from None


class _ImageWriter(RunWriter):
    """Writes a run file into memory: on a full disk HDF5 crashes the process, a plain write does not."""

    def _extend(self, name: str, values: FloatArray, units: str, long_name: str) -> None:
        """Write each variable at once: otherwise their order depends on when HDF5 happens to flush them."""
        super()._extend(name, values, units, long_name)
        self._file.flush()

    def complete(self, quantities: Sequence[CaseQuantity]) -> None:
        """Add the numbers; remove the wall time, which differs from run to run."""
        del self._file.attrs["wall_s"]
        self._file.attrs["ending"] = Ending.OK.value
        _add_quantities(self._file, quantities)


def _write_numbers(
    image: io.BytesIO, scene: Scene | None, ending: Ending, reason: str, quantities: Sequence[CaseQuantity]
) -> None:
    import h5py

    content = {} if scene is None else scene_dict(scene)
    with h5py.File(image, "w", track_order=True) as file:
        file.attrs.update({"schema_version": SCHEMA_VERSION, "srbval_kind": KIND, "scene": json.dumps(content)})
        file.attrs.update({"ending": ending.value, "reason": reason})
        _add_quantities(file, quantities)


def _add_quantities(file: Any, quantities: Sequence[CaseQuantity]) -> None:
    if not quantities:
        return
    names = file.create_dataset(TABLE[0], data=np.array([q.name for q in quantities], dtype="S"))
    names.make_scale(TABLE[0])
    values = file.create_dataset(TABLE[1], data=np.array([q.value for q in quantities]))
    units = file.create_dataset(TABLE[2], data=np.array([q.unit for q in quantities], dtype="S"))
    for dataset in (values, units):
        dataset.dims[0].attach_scale(names)


def _write(path: Path, image: io.BytesIO) -> None:
    with whole_file(path) as part:
        part.write_bytes(image.getbuffer())


def _acceleration_only(run: Run) -> Run:
    """The run with NaN for its other signals, which are then not written."""
    empty: dict[str, Any] = {
        f.name: np.broadcast_to(np.nan, getattr(run, f.name).shape)
        for f in fields(run)
        if isinstance(getattr(run, f.name), np.ndarray) and f.name not in ACCELERATION_SIGNALS
    }
    energy = replace(
        run.energy, **{f.name: np.broadcast_to(np.nan, getattr(run.energy, f.name).shape) for f in fields(run.energy)}
    )
    return replace(run, **empty, energy=energy)
