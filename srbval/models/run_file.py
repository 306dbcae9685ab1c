"""Run files: HDF5 with names and units on every variable, readable by xarray (`engine="h5netcdf"`).

Written chunk by chunk into a file aside that takes its place only when the run ended well.
"""

import contextlib
import dataclasses
import enum
import json
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from srbval.arrays import FloatArray
from srbval.models.run import Run, RunSummary
from srbval.scene import Scene
from srbval.storage.own_hdf5 import SCHEMA_VERSION
from srbval.storage.whole_file import whole_file

AXES = ("x", "y", "z")
ROWS = 4096  # of a chunk on disk
MEAN = "mean of the interval"
START = "at the interval's start"
ENERGY = {
    "drive_w": ("W", f"power of the drive, {MEAN}"),
    "load_w": ("W", f"power of the external load, {MEAN}"),
    "friction_w": ("W", f"slip power, lost to friction in the contacts, {MEAN}"),
    "damping_w": ("W", f"power lost to damping in the contacts, {MEAN}"),
    "housing_w": ("W", f"power lost in the housing's damper, {MEAN}"),
    "mechanical_j": ("J", f"kinetic and potential energy of the bodies, {START}"),
    "contact_j": ("J", f"elastic energy in the contacts, {START}"),
    "spring_j": ("J", f"elastic energy in the housing, {START}"),
}


class RunWriter:
    """Writes a run as it goes; use as a context manager, `append` each chunk, `finish` once.

    Without `finish`, or after an exception, nothing is left behind. Raises `DataError` where the place cannot be
    written.
    """

    def __init__(self, path: Path, scene: Scene) -> None:
        self._path, self._scene = path, scene
        self._stack = contextlib.ExitStack()
        self._finished = False
        self._file: Any = None

    def __enter__(self) -> Self:
        import h5py

        part = self._stack.enter_context(whole_file(self._path))
        self._file = self._stack.enter_context(h5py.File(part, "w", track_order=True))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None and not self._finished:
            with contextlib.suppress(_UnfinishedError):
                self._stack.__exit__(_UnfinishedError, _UnfinishedError(), None)
        else:
            self._stack.__exit__(kind, error, trace)

    def append(self, signals: Mapping[str, Any]) -> None:
        """Add a chunk: the arrays of a `Run` by their names there, `energy` among them."""
        for name, (values, units, long_name) in _variables(signals).items():
            if not np.isnan(values).all():  # a quantity that the model does not have
                self._extend(name, values, units, long_name)
        if len(signals["spin_rad_s"]):
            self._extend("spin_rad_s", signals["spin_rad_s"], "rad s-1", "spin about the rollers' axes")
            self._extend("load_n", signals["load_n"], "N", "normal force, by race, roller, circle")

    def finish(self, summary: RunSummary) -> None:
        """Add the time axes, link them, and write the run's attributes."""
        fs_hz = self._scene.output_rate_hz
        self._scale("time_s", (np.arange(summary.samples) + 1) / fs_hz, "s", "end of the output interval")
        if "spin_rad_s" in self._file:
            times = np.arange(len(self._file["spin_rad_s"])) / self._scene.detail_rate_hz
            self._scale("detail_time_s", times, "s", "time of the detailed outputs")
            self._scale("race", np.arange(2), "1", "0 outer, 1 inner")
            self._scale("roller", np.arange(self._file["spin_rad_s"].shape[1]) + 1, "1", "row 1 first")
            self._scale("circle", np.arange(3) + 1, "1", "of a raceway, from the mid-plane outwards")
        for name, dataset in self._file.items():
            if not dataset.is_scale:
                for dimension, scale in enumerate(_dimensions(name)):
                    dataset.dims[dimension].attach_scale(self._file[scale])
        self._file.attrs.update({"schema_version": SCHEMA_VERSION, "fs_hz": fs_hz, **_attributes(summary)})
        self._finished = True

    def _extend(self, name: str, values: FloatArray, units: str, long_name: str) -> None:
        if name not in self._file:
            shape = values.shape[1:]
            made = self._file.create_dataset(name, data=values, maxshape=(None, *shape), chunks=(ROWS, *shape))
            made.attrs.update({"units": units, "long_name": long_name})
            return
        dataset = self._file[name]
        dataset.resize(len(dataset) + len(values), axis=0)
        dataset[-len(values) :] = values

    def _scale(self, name: str, values: Any, units: str, long_name: str) -> None:
        scale = self._file.create_dataset(name, data=values)
        scale.attrs.update({"units": units, "long_name": long_name})
        scale.make_scale(name)


class _UnfinishedError(Exception):
    """Tells the file's context to discard what was written."""


def write_run(run: Run, path: Path) -> None:
    """Write `run` to `path`, whole or not at all; times are the ends of the output intervals.

    Raises `DataError` where the place cannot be written.
    """
    with RunWriter(path, run.scene) as writer:
        writer.append({f.name: getattr(run, f.name) for f in dataclasses.fields(run)})
        writer.finish(run)


def scene_dict(scene: Any) -> dict[str, Any]:
    """A scene as plain values (tables as dictionaries, enums as text), SI."""
    table = dataclasses.asdict(scene)
    for defect in (table["defect"], *table["further_defects"]):
        defect["kind"] = defect["kind"].scene_word
    plain: dict[str, Any] = json.loads(json.dumps(table, default=_plain))
    return plain


def _plain(value: object) -> str:
    return str(value.value) if isinstance(value, enum.Enum) else str(value)


def _attributes(run: RunSummary) -> dict[str, Any]:
    scene = run.scene
    return {
        "srbval_kind": "run",
        "name": f"{scene.model} model, {scene.defect.kind.scene_word} defect, {scene.shaft_hz * 60:.6g} rpm",
        "unit": "m/s2",
        "bearing": scene.bearing,
        "state": scene.defect.kind.value,
        "shaft_speed_hz": scene.shaft_hz,
        "radial_n": scene.load.radial_n,
        "axial_n": scene.load.axial_n,
        "scene": json.dumps(scene_dict(scene)),
        "status": run.status.value,
        "reason": run.reason,
        "cage_ratio": run.cage_ratio,
        "bpfo_hz": run.bpfo_hz,
        "bpfi_hz": run.bpfi_hz,
        "not_validated": "; ".join(run.not_validated),
        "wall_s": run.wall_s,
    }


def _variables(signals: Mapping[str, Any]) -> dict[str, tuple[FloatArray, str, str]]:
    table: dict[str, tuple[FloatArray, str, str]] = {}
    for i, axis in enumerate(AXES):
        table |= {
            f"acceleration_{axis}_m_s2": (
                signals["acceleration_m_s2"][:, i], "m s-2", f"outer ring acceleration, {axis}, {MEAN}",
            ),
            f"displacement_{axis}_m": (signals["displacement_m"][:, i], "m", f"outer ring displacement, {axis}"),
            f"roller_force_{axis}_n": (
                signals["roller_force_n"][:, i], "N", f"rollers' force on the outer ring, {axis}, {MEAN}",
            ),
        }  # fmt: skip
    for i, axis in enumerate(AXES[:2]):
        table[f"cage_tilt_{axis}_rad"] = (signals["cage_tilt_rad"][:, i], "rad", f"cage tilt about {axis}")
    table["cage_speed_rad_s"] = (signals["cage_rad_s"], "rad s-1", f"cage speed, {MEAN}")
    table["depth_m"] = (signals["depth_m"], "m", "deepest penetration into an undamaged raceway")
    flow = signals["energy"]
    return table | {name: (getattr(flow, name), units, text) for name, (units, text) in ENERGY.items()}


def _dimensions(name: str) -> tuple[str, ...]:
    return {"spin_rad_s": ("detail_time_s", "roller"), "load_n": ("detail_time_s", "race", "roller", "circle")}.get(
        name, ("time_s",)
    )
