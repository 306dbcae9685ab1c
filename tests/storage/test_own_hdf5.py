"""The package's own HDF5 files are read by xarray with names, units and a time scale."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray

from srbval.storage.own_hdf5 import SCHEMA_VERSION, Variable, write_own_hdf5

RATE_HZ = 100.0


def test_xarray_reads_values_units_and_attributes(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    values = np.array([1.0, 2.0, 4.0])
    write_own_hdf5(
        path,
        fs_hz=RATE_HZ,
        variables={"acceleration": Variable(values=values, units="m/s2", long_name="radial acceleration")},
        attributes={"name": "a run", "rpm": 710.0},
        start_s=0.5,
    )
    with xarray.open_dataset(path, engine="h5netcdf") as file:
        assert file["acceleration"].dims == ("time_s",)
        np.testing.assert_array_equal(file["acceleration"], values)
        np.testing.assert_array_equal(file["time_s"], 0.5 + np.arange(3) / RATE_HZ)
        assert (file["acceleration"].attrs["units"], file["time_s"].attrs["units"]) == ("m/s2", "s")
        assert file["acceleration"].attrs["long_name"] == "radial acceleration"
        assert (file.attrs["name"], file.attrs["rpm"], file.attrs["fs_hz"]) == ("a run", 710.0, RATE_HZ)
        assert file.attrs["schema_version"] == SCHEMA_VERSION
