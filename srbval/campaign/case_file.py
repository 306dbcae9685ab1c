"""Result files: HDF5, one per case, readable by xarray; the same case gives the same bytes, wherever it ran.

A case with signals is a run file too, so that every command that reads runs reads it. What a campaign itself needs of a
result stands in the summary behind the file's end, next to its checksum: HDF5 is not asked.
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
from srbval.storage.files import atomic_write
from srbval.storage.hdf5_files import ATTRIBUTES, CHECKED, append_checksum, checked_summary
from srbval.storage.json_files import checked_line, from_json, read_checked_line

KIND = "campaign-case"
ACCELERATION_SIGNALS = ("acceleration_m_s2", "spin_rad_s", "load_n")  # of output `acceleration`; the last two bare
TABLE = ("quantity", "value", "unit")


@dataclass(frozen=True, kw_only=True)
class CaseResult:
    """A result as read: the case's key, how it ended, why, and its numbers."""

    key: str
    ending: Ending
    reason: str
    quantities: tuple[CaseQuantity, ...]


def write_result(path: Path, run: Run, quantities: Sequence[CaseQuantity], outputs: Sequence[Output]) -> None:
    """Write the `outputs` of a run that ended well, whole or not at all; `OSError` where that fails."""
    import h5py

    image, ending = io.BytesIO(), Ending(run.status.value)
    if {Output.SIGNALS, Output.ACCELERATION} & set(outputs):
        signals = run if Output.SIGNALS in outputs else _acceleration_only(run)
        with h5py.File(image, "w", track_order=True) as file:
            file.attrs.update(ATTRIBUTES)
            writer = _ImageWriter(file, run.scene)
            writer.append({f.name: getattr(signals, f.name) for f in fields(signals)})
            writer.finish(
                replace(signals, wall_s=0.0, compile_s=0.0)
            )  # a deleted attribute leaves its bytes in the file
            writer.complete(quantities, ending)
    else:
        _write_numbers(image, run.scene, ending, run.reason, quantities)
    _write(path, image, ending, run.reason, quantities)


def write_failure(path: Path, scene: Scene | None, ending: Ending, reason: str) -> None:
    """Write why a case has no result."""
    image = io.BytesIO()
    _write_numbers(image, scene, ending, reason, ())
    _write(path, image, ending, reason, ())


def read_result(path: Path) -> CaseResult:
    """Read a result without its signals; `DataError` where it is not as it was written, or cannot be read."""
    try:
        summary = checked_summary(path)
        if summary is None:
            raise ValueError("it has no checksum")
        result = from_json(CaseResult, read_checked_line(summary))
        if result.key != path.stem:
            raise ValueError(f"it is the result of case {result.key[:32]!r}")
        return result
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: damaged: it is not a result of this case ({error}).") from None


class _ImageWriter(RunWriter):
    """Writes a run file into memory: on a full disk HDF5 crashes the process, a plain write does not."""

    def _extend(self, name: str, values: FloatArray, units: str, long_name: str) -> None:
        """Write each variable at once: otherwise their order depends on when HDF5 happens to flush them."""
        super()._extend(name, values, units, long_name)
        self._file.flush()

    def _scale(self, name: str, values: Any, units: str, long_name: str) -> None:
        super()._scale(name, values, units, long_name)
        self._file.flush()

    def complete(self, quantities: Sequence[CaseQuantity], ending: Ending) -> None:
        """Add the numbers; remove the wall time, which differs from run to run."""
        del self._file.attrs["wall_s"]
        self._file.attrs["ending"] = ending.value
        _add_quantities(self._file, quantities)


def _write_numbers(
    image: io.BytesIO, scene: Scene | None, ending: Ending, reason: str, quantities: Sequence[CaseQuantity]
) -> None:
    import h5py

    content = {} if scene is None else scene_dict(scene)
    with h5py.File(image, "w", track_order=True) as file:
        file.attrs.update({**ATTRIBUTES, "srbval_kind": KIND, "scene": json.dumps(content)})
        file.attrs.update({"ending": ending.value, "reason": reason})
        _add_quantities(file, quantities)


def _add_quantities(file: Any, quantities: Sequence[CaseQuantity]) -> None:
    if not quantities:
        return
    names = file.create_dataset(TABLE[0], data=np.array([q.name for q in quantities], dtype="S"), **CHECKED)
    names.make_scale(TABLE[0])
    values = file.create_dataset(TABLE[1], data=np.array([q.value for q in quantities]), **CHECKED)
    units = file.create_dataset(TABLE[2], data=np.array([q.unit for q in quantities], dtype="S"), **CHECKED)
    for dataset in (values, units):
        dataset.dims[0].attach_scale(names)


def _write(path: Path, image: io.BytesIO, ending: Ending, reason: str, quantities: Sequence[CaseQuantity]) -> None:
    summary = CaseResult(key=path.stem, ending=ending, reason=reason, quantities=tuple(quantities))
    with atomic_write(path) as part:
        part.write_bytes(image.getbuffer())
        append_checksum(part, checked_line(summary))


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
