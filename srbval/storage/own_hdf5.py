"""This program's own HDF5 layout: runs and stand-ins, readable by xarray with names and units."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from srbval.storage.whole_file import whole_file

SCHEMA_VERSION = 1


@dataclass(frozen=True, kw_only=True, eq=False)
class Variable:
    """A variable over time: samples, shape [n], SI unit as text, and what it is."""

    values: NDArray[np.float64]
    units: str
    long_name: str


def write_own_hdf5(
    path: Path,
    *,
    fs_hz: float,
    variables: Mapping[str, Variable],
    attributes: Mapping[str, float | str],
    start_s: float = 0.0,
) -> None:
    """Write variables over a common `time_s` scale, readable by xarray (engine ``h5netcdf``).

    `attributes` are the file's own, ``srbval_kind``, ``name``, ``state``, ``bearing``, ``shaft_speed_hz``
    and the rest; `schema_version` and `fs_hz` are added. All variables have the same length; the first sample is
    at `start_s`. Raises `DataError` where the place cannot be written.
    """
    import h5py

    length = len(next(iter(variables.values())).values)
    with whole_file(path) as part, h5py.File(part, "w", track_order=True) as file:
        file.attrs.update({"schema_version": SCHEMA_VERSION, "fs_hz": fs_hz, **attributes})
        time = file.create_dataset("time_s", data=start_s + np.arange(length) / fs_hz)
        time.attrs.update({"units": "s", "long_name": "time"})
        time.make_scale("time_s")
        for name, variable in variables.items():
            dataset = file.create_dataset(name, data=variable.values)
            dataset.dims[0].attach_scale(time)
            dataset.attrs.update({"units": variable.units, "long_name": variable.long_name})
