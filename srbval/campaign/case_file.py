"""Result files: HDF5, one per case, readable by xarray; the same case gives the same bytes, wherever it ran.

A case with signals is a run file too, so that every command that reads runs reads it. What a campaign itself needs of a
result stands in the summary behind the file's end, next to its checksum: HDF5 is not asked.
"""

import io
import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.campaign.case import CaseResult
from srbval.errors import DataError
from srbval.models.run import Run
from srbval.models.run_file import RunWriter, scene_dict
from srbval.scene import Scene
from srbval.storage.files import atomic_write
from srbval.storage.hdf5_files import ATTRIBUTES, CHECKED, append_checksum, checked_summary
from srbval.storage.json_files import checked_line, from_json, read_checked_line

KIND = "campaign-case"
ACCELERATION_SIGNALS = ("acceleration_m_s2", "spin_rad_s", "load_n")  # of output `acceleration`; the last two bare
SUMMARY = ("key", "ending", "reason", "quantities")  # of a result, in its file
ELSEWHERE = {"wall_s": 0.0, "simulation_s": 0.0, "found": False, "at_utc": ""}


def write_result(path: Path, result: CaseResult, scene: Scene | None, signals: Run | None = None) -> None:
    """Write a case's numbers, or why it has none, and the `signals` of its run; whole or not at all.

    `scene` is None where none could be made. Raises `OSError` or `DataError` where the file cannot be written.
    """
    import h5py

    image = io.BytesIO()
    with h5py.File(image, "w", track_order=True) as file:
        file.attrs.update(ATTRIBUTES)
        if signals is None:
            content = {} if scene is None else scene_dict(scene)
            file.attrs.update({"srbval_kind": KIND, "scene": json.dumps(content)})
            file.attrs.update({"ending": result.ending.value, "reason": result.reason})
        else:
            writer = _ImageWriter(file, signals.scene)
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
    with atomic_write(path) as part:
        part.write_bytes(image.getbuffer())
        append_checksum(part, checked_line({name: getattr(result, name) for name in SUMMARY}))


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


class _ImageWriter(RunWriter):
    """Writes a run file into memory: on a full disk HDF5 crashes the process, a plain write does not.

    Each variable is written at once: otherwise their order depends on when HDF5 happens to flush them.
    """

    def _extend(self, name: str, values: FloatArray, units: str, long_name: str) -> None:
        super()._extend(name, values, units, long_name)
        self._file.flush()

    def _scale(self, name: str, values: Any, units: str, long_name: str) -> None:
        super()._scale(name, values, units, long_name)
        self._file.flush()


def acceleration_only(run: Run) -> Run:
    """The run with NaN for its other signals, which are then not written."""

    def blank(part: Any, *kept: str) -> dict[str, Any]:
        found = {f.name: getattr(part, f.name) for f in fields(part) if f.name not in kept}
        return {n: np.broadcast_to(np.nan, v.shape) for n, v in found.items() if isinstance(v, np.ndarray)}

    return replace(run, **blank(run, *ACCELERATION_SIGNALS), energy=replace(run.energy, **blank(run.energy)))
