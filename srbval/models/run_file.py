"""Run files: HDF5 with names and units on every variable, readable by xarray (`engine="h5netcdf"`)."""

from __future__ import annotations

import dataclasses
import enum
import json
from pathlib import Path
from typing import Any

from srbval.models.run import FloatArray, Run
from srbval.storage.own_hdf5 import Variable, write_own_hdf5

AXES = ("x", "y", "z")
MEAN = "mean of the interval"


def write_run(run: Run, path: Path) -> None:
    """Write `run` to `path`, whole or not at all; times are the ends of the output intervals.

    Raises `DataError` where the place cannot be written.
    """
    fs_hz = run.scene.output_rate_hz
    write_own_hdf5(path, fs_hz=fs_hz, variables=_variables(run), attributes=_attributes(run), start_s=1 / fs_hz)


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
        "srbval_kind": "run",
        "name": f"{scene.model} model, {kind} defect, {scene.shaft_hz * 60:.6g} rpm",
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


def _variables(run: Run) -> dict[str, Variable]:
    table: dict[str, Variable] = {}
    for i, axis in enumerate(AXES):
        acceleration, displacement, force = (
            a[:, i] for a in (run.acceleration_m_s2, run.displacement_m, run.roller_force_n)
        )
        table |= {
            f"acceleration_{axis}_m_s2": _variable(acceleration, "m s-2", f"outer ring acceleration, {axis}, {MEAN}"),
            f"displacement_{axis}_m": _variable(displacement, "m", f"outer ring displacement, {axis}"),
            f"roller_force_{axis}_n": _variable(force, "N", f"rollers' force on the outer ring, {axis}, {MEAN}"),
        }
    for i, axis in enumerate(AXES[:2]):
        table[f"cage_tilt_{axis}_rad"] = _variable(run.cage_tilt_rad[:, i], "rad", f"cage tilt about {axis}")
    table["cage_speed_rad_s"] = _variable(run.cage_rad_s, "rad s-1", f"cage speed, {MEAN}")
    table["depth_m"] = _variable(run.depth_m, "m", "deepest penetration into an undamaged raceway")
    return table


def _variable(values: FloatArray, units: str, long_name: str) -> Variable:
    return Variable(values=values, units=units, long_name=long_name)
