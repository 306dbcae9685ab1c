"""Run files: HDF5 with names and units on every variable, readable by xarray (`engine="h5netcdf"`).

A file is written chunk by chunk under another name and renamed only if the run ends well. Behind the HDF5 data it
contains the run's summary as JSON, so that `read_summary` and `read_run_file` restore the run bit for bit.
"""

import dataclasses
import json
import math
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import load_bearing
from srbval.models import outputs as col
from srbval.models.estimates import Estimate, StepError
from srbval.models.outputs import Outputs
from srbval.models.outside.names import content_of, is_outside
from srbval.models.run import VARIABLES, Run, RunStatus, RunSummary, bearing_of_run
from srbval.scene import Scene
from srbval.storage.hdf5_files import CHECKED, new_hdf5
from srbval.storage.json_files import to_json

ROWS_PER_CHUNK = 4096  # rows of an HDF5 chunk
SENSOR_SIGNAL = "acceleration_sensor_m_s2"
NOT_KEPT = ("scene", "step_error", "stored_utc")  # fields of a summary that are not in its JSON text
PROFILE_STEP_S = 1e-3
DIMENSIONS = {"spin_rad_s": ("detail_time_s", "roller"), "load_n": ("detail_time_s", "race", "roller", "circle")}
DIMENSIONS |= {"shaft_speed_hz": ("shaft_time_s",)}


class RunWriter:
    """Writes a run to an open HDF5 file (from `new_hdf5`) while it is computed: `append` each chunk, then `finish`.

    If `acceleration_only`, the only signals are the accelerations of ring and sensor.
    """

    def __init__(self, file: Any, scene: Scene, *, acceleration_only: bool = False) -> None:
        self._file, self._scene = file, scene
        self._names = [name for name in VARIABLES if not acceleration_only or name.startswith("acceleration")]

    def append(self, part: Outputs) -> None:
        """Append a chunk, or a whole run; raises `DataError` if the disk is full."""
        self._file.check_written()
        for name in self._names:
            variable = VARIABLES[name]
            values = part.out[:, variable["column"]]
            if not np.isnan(values).all() and (self._scene.oil or "oil" not in variable):  # the model computes it
                self._extend(name, values, variable["units"], variable["long_name"])
        if len(part.sensor_m_s2):
            self._extend(SENSOR_SIGNAL, part.sensor_m_s2, "m s-2", "acceleration at the sensor, behind the path to it")
        if len(part.spin_rad_s):
            self._extend("spin_rad_s", part.spin_rad_s, "rad s-1", "spin about the rollers' axes")
            self._extend("load_n", part.load_n, "N", "normal force, by race, roller, circle")

    def finish(self, summary: RunSummary) -> None:
        """Write the axes of the signals (such as time), the file's attributes and the summary of the run."""
        fs_hz = self._scene.output_rate_hz
        self._scale("time_s", (np.arange(summary.samples) + 1) / fs_hz, "s", "end of the output interval")
        if "spin_rad_s" in self._file:
            times = np.arange(len(self._file["spin_rad_s"])) / self._scene.detail_rate_hz
            self._scale("detail_time_s", times, "s", "time of the detailed outputs")
            self._scale("race", np.arange(2), "1", "0 outer, 1 inner")
            self._scale("roller", np.arange(self._file["spin_rad_s"].shape[1]) + 1, "1", "row 1 first")
            self._scale("circle", np.arange(3) + 1, "1", "of a raceway, from the mid-plane outwards")
        if (profile := profile_signal(summary)) is not None:
            self._extend("shaft_speed_hz", profile[0], "Hz", "prescribed shaft speed")
            self._scale("shaft_time_s", np.arange(len(profile[0])) / profile[1], "s", "time of the shaft speed")
            self._file.attrs["shaft_rate_hz"] = profile[1]
        for name, dataset in self._file.items():
            if not dataset.is_scale:
                for dimension, scale in enumerate(DIMENSIONS.get(name, ("time_s",))):
                    dataset.dims[dimension].attach_scale(self._file[scale])
        self._file.attrs.update({"fs_hz": fs_hz, **_attributes(summary, sensor=SENSOR_SIGNAL in self._file)})
        kept = {name: getattr(summary, name) for name in RunSummary.__dataclass_fields__ if name not in NOT_KEPT}
        error = summary.step_error and dataclasses.asdict(summary.step_error)
        own = {"chosen_step_s": summary.scene.solver.step_s, "step_error": error}
        stored = {"stored_utc": datetime.now(UTC).isoformat(timespec="seconds")}
        self._file.summary = json.dumps(kept | own | stored).encode()  # with infinities

    def _extend(self, name: str, values: FloatArray, units: str, long_name: str) -> None:
        if name not in self._file:
            shape = values.shape[1:]
            sizes = {"maxshape": (None, *shape), "chunks": (ROWS_PER_CHUNK, *shape)}
            made = self._file.create_dataset(name, data=values, **sizes, **CHECKED)
            made.attrs.update({"units": units, "long_name": long_name})
            self._file.flush()  # otherwise the order in the file depends on when HDF5 writes
            return
        dataset = self._file[name]
        dataset.resize(len(dataset) + len(values), axis=0)
        dataset[-len(values) :] = values

    def _scale(self, name: str, values: Any, units: str, long_name: str) -> None:
        scale = self._file.create_dataset(name, data=values, **CHECKED)
        scale.attrs.update({"units": units, "long_name": long_name})
        scale.make_scale(name)
        self._file.flush()


def write_run(run: Run, path: str | Path) -> None:
    """Write `run` to `path`; raises `DataError` if this fails, and then leaves no file."""
    with new_hdf5(Path(path)) as file:
        writer = RunWriter(file, run.scene)
        writer.append(run)
        writer.finish(run)


def read_summary(table: dict[str, Any], scene: Scene) -> RunSummary:
    """Build a run's summary from its JSON `table`; `LookupError`, `TypeError` or `ValueError` if it is damaged."""
    kept = dict(table)
    solver, error = dataclasses.replace(scene.solver, step_s=kept.pop("chosen_step_s")), kept.pop("step_error")
    if error is not None:
        error = StepError(**error | {"estimates": tuple(Estimate(**one) for one in error["estimates"])})
    status, scene = RunStatus(kept.pop("status")), dataclasses.replace(scene, solver=solver)
    return RunSummary(**kept, scene=scene, step_error=error, status=status)


def read_run_file(path: Path, summary: RunSummary) -> Run:
    """Read a run's signals from its file; raises `OSError` or `LookupError` if `path` is missing or no run file."""
    import h5py

    with h5py.File(path) as file:
        out = np.full((summary.samples, col.COLUMN_COUNT), np.nan)
        out[:, col.OIL_LOSSES] = 0.0 if "drive_w" in file else np.nan  # a model with energies, without oil
        for name in VARIABLES.keys() & file.keys():
            out[:, VARIABLES[name]["column"]] = file[name]
        stored = {"spin_rad_s": "spin_rad_s", "load_n": "load_n", "sensor_m_s2": SENSOR_SIGNAL}
        details = {name: file[own][:] for name, own in stored.items() if own in file}
    return Run(**vars(summary), out=out, **details)


def scene_dict(scene: Any) -> dict[str, Any]:
    """Convert a scene to plain values in SI units: tables to dictionaries, enums to text."""
    table = dataclasses.asdict(scene)
    for defect in (table["defect"], *table["further_defects"]):
        defect["kind"] = defect["kind"].scene_word
    for name in ("sensor_path", "surface", "oil"):
        if table[name] is None:  # the content of older scenes stays the same
            del table[name]
    if not scene.bodies.free_rollers:
        del table["bodies"]["free_rollers"]
    return json.loads(json.dumps(table, default=lambda other: str(getattr(other, "value", other))))


def signal_facts(run: RunSummary, *, sensor: bool) -> dict[str, Any]:
    """Facts about a run's signals by the names of the fields of `Recording`, as `storage.tables.build` reads them.

    With `sensor` the signal at the sensor is analysed, otherwise the outer ring's accelerations along x and y.
    """
    scene, note = run.scene, f"the run ended {run.status}: {run.reason}"
    facts = {
        "name": f"{scene.model} model, {scene.defect.kind.scene_word} defect, {scene.shaft_hz * 60:.6g} rpm",
        "origin": "simulated",
        "channel": "sensor" if sensor else None,
        "axes": None if sensor else ["x", "y"],
        "fs_hz": scene.output_rate_hz,
        "unit": "m/s2",
        "speed": {"value_hz": scene.shaft_hz, "ci95_hz": 0.0, "source": "prescribed"},
        "bearing": scene.bearing,
        "own_bearing": bearing_of_run(scene),  # for readers without the bearing's file
        "state": scene.defect.kind.value,
        "radial_n": scene.load.radial_n,
        "axial_n": scene.load.axial_n,
        "cage_hz": run.cage_ratio * scene.shaft_hz,
        "interval_means": True,
        "notes": [*([note] if run.status != "ok" else []), f"not validated: {'; '.join(run.not_validated)}"],
    }
    return {name: to_json(value) for name, value in facts.items()}


def profile_signal(run: RunSummary) -> tuple[FloatArray, float] | None:
    """Prescribed shaft speed [Hz] of a run in steps of about `PROFILE_STEP_S`, and its rate [Hz]; None if constant."""
    profile = run.scene.speed_profile
    if profile is None:
        return None
    count = math.ceil(run.seconds / PROFILE_STEP_S) + 1
    values = np.interp(np.linspace(0, run.seconds, count), profile.time_s, profile.speed_rad_s) / (2 * math.pi)
    return values, (count - 1) / run.seconds


def _attributes(run: RunSummary, *, sensor: bool) -> dict[str, Any]:
    scene, facts = run.scene, signal_facts(run, sensor=sensor)
    return {
        "srbval_kind": "run",
        "facts": json.dumps(facts),
        **{name: facts[name] for name in ("name", "unit", "bearing", "state", "radial_n", "axial_n")},
        "shaft_speed_hz": scene.shaft_hz,
        "scene": json.dumps(scene_dict(scene)),
        "status": run.status.value,
        "reason": run.reason,
        "numerics": json.dumps(None if run.step_error is None else run.step_error.to_dict()),
        "cage_ratio": run.cage_ratio,
        "bpfo_hz": run.bpfo_hz,
        "bpfi_hz": run.bpfi_hz,
        "not_validated": "; ".join(run.not_validated),
        "wall_s": run.wall_s,
    }


def scene_content(scene: Scene) -> str:
    """Text that identifies a scene's results: scene, bearing data and, for an external model, a hash of its files."""
    bearing = load_bearing(scene.bearing)
    model = content_of(scene.model) if is_outside(scene.model) else scene.model
    return json.dumps(scene_dict(scene) | {"bearing": bearing.name, "model": model}, sort_keys=True) + repr(bearing)
