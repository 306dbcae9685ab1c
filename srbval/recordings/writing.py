"""Writing a file as a whole or not at all, and this program's own HDF5 layout."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from srbval.errors import DataError

SCHEMA_VERSION = 1


@dataclass(frozen=True, kw_only=True, eq=False)
class Variable:
    """A variable over time: samples, shape [n], SI unit as text, and what it is."""

    values: NDArray[np.float64]
    units: str
    long_name: str


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a path beside `path` to write to; it replaces `path` on success and is removed on failure.

    Data reach the disk before the name changes, so an interruption leaves the old file or none, never
    half a one. Raises `DataError` where the folder cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
        os.close(handle)
    except OSError as error:
        raise DataError(f"{path}: cannot be written ({error.strerror}).") from None
    part = Path(name)
    try:
        yield part
        _sync(part)
        part.chmod(0o666 & ~_umask())
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def write_own_hdf5(
    path: Path, *, fs_hz: float, variables: Mapping[str, Variable], attributes: Mapping[str, float | str]
) -> None:
    """Write variables over a common `time_s` scale, readable by xarray (engine ``h5netcdf``).

    `attributes` are the file's own, ``srbval_kind``, ``name``, ``state``, ``bearing``, ``shaft_speed_hz``
    and the rest; `schema_version` and `fs_hz` are added. All variables have the same length.
    """
    import h5py

    length = len(next(iter(variables.values())).values)
    with whole_file(path) as part, h5py.File(part, "w", track_order=True) as file:
        file.attrs.update({"schema_version": SCHEMA_VERSION, "fs_hz": fs_hz, **attributes})
        time = file.create_dataset("time_s", data=np.arange(length) / fs_hz)
        time.attrs.update({"units": "s", "long_name": "time"})
        time.make_scale("time_s")
        for name, variable in variables.items():
            dataset = file.create_dataset(name, data=variable.values)
            dataset.dims[0].attach_scale(time)
            dataset.attrs.update({"units": variable.units, "long_name": variable.long_name})


def _sync(path: Path) -> None:
    with path.open("rb") as stream:
        os.fsync(stream.fileno())


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
