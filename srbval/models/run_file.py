"""Run files: HDF5 with names and units on every variable, readable by xarray (`engine="h5netcdf"`)."""

from __future__ import annotations

import dataclasses
import enum
import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from srbval.errors import DataError
from srbval.models.run import Run

SCHEMA_VERSION = 1
AXES = ("x", "y", "z")


def write_run(run: Run, path: Path) -> None:
    """Write `run` to `path`: aside first, then moved, so the file is whole or not there.

    Raises `DataError` where the place cannot be written.
    """
    import h5py

    aside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with h5py.File(aside, "w") as file:
            file.attrs.update(_attributes(run))
            rows = len(run.cage_rad_s)
            time = file.create_dataset("time_s", data=np.arange(1, rows + 1) / run.scene.output_rate_hz)
            time.attrs.update(units="s", long_name="end of the output interval, from the end of settling")
            time.make_scale("time_s")
            for name, (values, units, long_name) in _variables(run).items():
                variable = file.create_dataset(name, data=values)
                variable.attrs.update(units=units, long_name=long_name)
                variable.dims[0].attach_scale(time)
        os.replace(aside, path)
    except OSError as error:
        raise DataError(
            f"{path}: cannot be written ({error.strerror or error}). Choose another -o."
        ) from None
    finally:
        aside.unlink(missing_ok=True)


def scene_dict(scene: Any) -> dict[str, Any]:
    """A scene as plain values (tables as dictionaries, enums as text), SI."""
    table = dataclasses.asdict(scene)
    plain: dict[str, Any] = json.loads(json.dumps(table, default=_plain))
    return plain


def _plain(value: object) -> str:
    return str(value.value) if isinstance(value, enum.Enum) else str(value)


def _attributes(run: Run) -> dict[str, Any]:
    scene = run.scene
    kind = scene.defect.kind.value
    return {
        "schema_version": SCHEMA_VERSION,
        "srbval_kind": "run",
        "name": f"{scene.model} model, {kind} defect, {scene.shaft_hz * 60:.6g} rpm",
        "fs_hz": scene.output_rate_hz,
        "unit": "m/s2",
        "bearing": scene.bearing,
        "state": "healthy" if kind == "none" else kind,
        "shaft_speed_hz": scene.shaft_hz,
        "radial_n": scene.load.radial_n,
        "axial_n": scene.load.axial_n,
        "scene": json.dumps(scene_dict(scene)),
        "status": run.status.value,
        "reason": run.reason,
        "cage_ratio": run.cage_ratio,
        "bpfo_hz": run.bpfo_hz,
        "bpfi_hz": run.bpfi_hz,
        "wall_s": run.wall_s,
    }


def _variables(run: Run) -> dict[str, tuple[np.ndarray, str, str]]:
    table: dict[str, tuple[np.ndarray, str, str]] = {}
    for i, axis in enumerate(AXES):
        table[f"acceleration_{axis}_m_s2"] = (
            run.acceleration_m_s2[:, i], "m s-2", f"outer ring acceleration, {axis}, mean of the interval",
        )  # fmt: skip
        table[f"displacement_{axis}_m"] = (run.displacement_m[:, i], "m", f"outer ring displacement, {axis}")
        table[f"roller_force_{axis}_n"] = (
            run.roller_force_n[:, i], "N", f"force of the rollers on the outer ring, {axis}, mean of the interval",
        )  # fmt: skip
    for i, axis in enumerate(AXES[:2]):
        table[f"cage_tilt_{axis}_rad"] = (run.cage_tilt_rad[:, i], "rad", f"cage tilt about {axis}")
    table["cage_speed_rad_s"] = (run.cage_rad_s, "rad s-1", "cage speed, mean of the interval")
    table["depth_m"] = (run.depth_m, "m", "deepest penetration into an undamaged raceway")
    return table
