"""Result of a run: signals on one time axis, status, figures and cost."""

from __future__ import annotations

import enum
import math
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import DEFAULT_BEARING, Bearing, Fault, load_bearing
from srbval.bridges import NotebookObject, load_public, require_xarray
from srbval.errors import NumericsError, SrbvalError
from srbval.models import outputs as col
from srbval.models.outputs import Outputs
from srbval.models.outside.names import is_outside
from srbval.scene import Scene
from srbval.storage.tables import read_toml

if TYPE_CHECKING:
    import pandas
    import xarray

    from srbval.models.estimates import StepError

VARIABLES = read_toml(Path(__file__).with_name("run_variables.toml"))  # of a run file, in its order


class RunStatus(enum.StrEnum):
    """How a run ended; see `works` for the statuses that `srbval simulate` accepts.

    `SKIDDING`: the cage does not turn as rolling rollers would drive it. `ROLLERS_UNLOADED`: the load bypasses the
    rollers, or there is none. `INACCURATE`: the step leaves errors beyond the tolerances of `step_error`; the run is
    written with this status, but does not work. All other statuses are failures of the numerics, the last six of a
    model from outside.
    """

    OK = "ok"
    SKIDDING = "skidding"
    ROLLERS_UNLOADED = "rollers-unloaded"
    INACCURATE = "inaccurate"
    NOT_FINITE = "not-finite"
    TOO_DEEP = "too-deep"
    CAGE_LOST = "cage-lost"
    LOAD_LOST = "load-lost"
    ENERGY_OPEN = "energy-open"
    STEP_TOO_LONG = "step-too-long"
    RAISED = "raised"
    UNUSABLE_SIGNALS = "unusable-signals"
    SILENT = "silent"
    OUT_OF_TIME = "out-of-time"
    OUT_OF_MEMORY = "out-of-memory"
    DIED = "died"

    @property
    def usable(self) -> bool:
        """True if the signals are written to a file: those of runs that work, and of inaccurate ones."""
        return self.value in USABLE


WORKING = ("ok", "skidding", "rollers-unloaded")  # statuses of runs that `srbval simulate` accepts, with exit code 0
BY_CHANCE = ("out-of-time", "out-of-memory", "died")  # statuses that may be due to a busy machine: never stored
USABLE = (*WORKING, "inaccurate")  # statuses of runs that are written to a file


def works(status: str) -> bool:
    """True if `srbval simulate` accepts a run with this status, a `RunStatus` or its stored text.

    A run works if its numerics passed every check: the bearing turns, skids or is unloaded as the scene makes it.
    """
    return status in WORKING


@dataclass(frozen=True, kw_only=True, eq=False)
class RunSummary:
    """Status and figures of a run; the recorded time starts after the scene's settling time.

    `cage_ratio` is the mean cage speed over the mean shaft speed, `rolling_ratio` the ratio of pure rolling,
    `cage_course` the ratio at the run's start and end. `roller_load_share` is the part of the mean radial load that the
    rollers carry (NaN without a load; the housing spring carries the rest), `balanced_share` their part in static
    balance. `drive_power_w` is the mean power of the shaft's drive, `energy_imbalance` work in less stored less lost as
    a share of the losses, both NaN if a model has no energies. `missing_n`, along the load: see
    `RunningSums.missing_n`. `deepest_m`: penetration; `idle_share`: share of the time without contact.

    `step_error`: errors left by the step, None if not estimated; `step_limit_s`: see `step_limits.elastic_limit_s`,
    `default_limit_s`: the limit of the default solver; `check_wall_s`: time of estimating the error or choosing the
    step; `band_rms_m_s2`: along the sensor's axis, by the names of `scene.BANDS_HZ`;
    `stored_utc`: when the run was made if it was read from the cache; its times are of that occasion.
    `cpu_s`: processor time of the thread that integrated the run, `wall_s` its wall time, both without compiling.

    In oil: `power_w`, mean losses by source and their `total` [W] (`damping` in the contacts, no `seals`); `film_um`,
    the least film of a contact that carries and the `mean` film in the contacts' middles, at the run's end;
    `lambda_min`: the least film over the roughness. Empty and NaN without oil.

    `free_rollers`: at the run's end, of rollers that tilt and slide along their axes and carry load, the largest tilt
    `tilt_mrad`, displacement along the axis `shift_um` and moment of friction about the slot `skew_nm`, which the cage
    bears; share of row 1 in the loads of all outer contacts, `row_1_share`. Empty if rollers are held.
    """

    scene: Scene
    rolling_elements: int
    status: RunStatus
    reason: str
    samples: int
    cage_ratio: float
    rolling_ratio: float
    roller_load_share: float
    energy_imbalance: float
    wall_s: float
    compile_s: float
    finite: bool = True
    deepest_m: float = -math.inf
    balanced_share: float = math.nan
    missing_n: float = math.nan
    cage_course: tuple[float, float] = (math.nan, math.nan)
    idle_share: float = 0.0
    drive_power_w: float = math.nan
    step_s: float = math.nan
    step_limit_s: float = math.nan
    default_limit_s: float = math.inf
    check_wall_s: float = 0.0
    cpu_s: float = math.nan
    step_error: StepError | None = None
    band_rms_m_s2: Mapping[str, float] = field(default_factory=dict)
    stored_utc: str | None = None
    power_w: Mapping[str, float] = field(default_factory=dict)
    film_um: Mapping[str, float] = field(default_factory=dict)
    lambda_min: float = math.nan
    free_rollers: Mapping[str, float] = field(default_factory=dict)

    def require_usable(self, what: str) -> Self:
        """Return this run, or raise `NumericsError` with `what` failed and why if it is not usable."""
        if not self.status.usable:
            raise NumericsError(f"{what} failed ({self.status}): {self.reason}.")
        return self

    @property
    def slip_pct(self) -> float:
        """Lag of the cage behind pure rolling [%]."""
        return 100 * (1 - self.cage_ratio / self.rolling_ratio)

    @property
    def seconds(self) -> float:
        """Recorded duration [s]."""
        return self.samples / self.scene.output_rate_hz

    @property
    def not_validated(self) -> tuple[str, ...]:
        """Parts of the scene that no comparison with measurements covers, in words."""
        return not_validated(self.scene)

    @property
    def bpfo_hz(self) -> float:
        """Outer-race line from the mean cage speed, Z f_cage [Hz]."""
        return self.rolling_elements * self.cage_ratio * self.scene.shaft_hz

    @property
    def bpfi_hz(self) -> float:
        """Inner-race line from the mean cage speed, Z (f_shaft - f_cage) [Hz]."""
        return self.rolling_elements * (1 - self.cage_ratio) * self.scene.shaft_hz

    @property
    def wall_per_simulated_s(self) -> float:
        """Wall time per simulated second, settling included, compiling not."""
        return self.wall_s / (self.seconds + self.scene.settle_s)

    @property
    def cpu_per_simulated_s(self) -> float:
        """Processor time per simulated second, settling included, compiling not."""
        return self.cpu_s / (self.seconds + self.scene.settle_s)


def _part(columns: int | slice, meaning: str) -> Any:
    """Property of a run: these columns of its `out`, in an array of their own."""
    return property(lambda run: np.ascontiguousarray(run.out[:, columns]), doc=meaning)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Run(RunSummary, Outputs, NotebookObject):
    """A simulated run in memory: all of its outputs in one piece, [n] of them."""

    acceleration_m_s2 = _part(col.ACCELERATION, "Of the outer ring, [n, 3]: change of velocity over the interval.")
    displacement_m = _part(col.DISPLACEMENT, "Of the outer ring at the interval's end, [n, 3].")
    cage_rad_s = _part(col.CAGE_SPEED, "Mean speed of the cage, [n].")
    cage_tilt_rad = _part(col.CAGE_TILT, "Tilt of the cage about x and y, [n, 2].")
    roller_force_n = _part(col.RING_FORCE, "Force of the rollers on the outer ring, mean of the interval, [n, 3].")
    depth_m = _part(col.DEEPEST, "Deepest penetration into an undamaged raceway, [n].")

    @property
    def time_s(self) -> FloatArray:
        """Time of each output interval's start [s], [n]."""
        return np.arange(len(self.out)) / self.scene.output_rate_hz

    def to_frame(self) -> pandas.DataFrame:
        """A pandas table, one row per output interval: time, and the variables of a run file under their names."""
        import pandas

        columns = {name: self.out[:, variable["column"]] for name, variable in VARIABLES.items()}
        return pandas.DataFrame({"time_s": self.time_s} | columns)

    def to_xarray(self) -> xarray.Dataset:
        """The data set that xarray reads in the run's file: units, names and attributes are the same."""
        engine = require_xarray()
        with tempfile.TemporaryDirectory(prefix="srbval-") as folder:
            load_public("write_run")(self, path := Path(folder) / "run.h5")
            data: xarray.Dataset = engine.load_dataset(path, engine="h5netcdf")
            return data

    def __repr__(self) -> str:
        scene = self.scene
        return (
            f"<Run {self.status}: {scene.model} model, {scene.bearing}, {scene.defect.kind.label}, "
            f"{60 * scene.shaft_hz:.5g} rpm, {self.seconds:.4g} s, cage {self.cage_ratio:.5f} of the shaft>"
        )


def not_validated(scene: Scene) -> tuple[str, ...]:
    """Parts of this scene that no comparison with measurements covers, in words; always the amplitudes.

    A bearing counts as validated if it has the geometry of the paper's, whatever its name.
    """
    found = ["amplitudes and the noise floor"]
    if is_outside(scene.model):
        found = [f"anything of the model {scene.model}, which is not part of srbval"]
    bearing = bearing_of_run(scene)
    if bearing is None or bearing.geometry != load_bearing(DEFAULT_BEARING).geometry:
        found.append(f"the bearing {scene.bearing}: the models were held against the {DEFAULT_BEARING} alone")
        if bearing is not None and bearing.geometry is None:
            assumed = (
                "load zone, pulses and resonance are"
                if bearing.elements is None
                else "grooves, housing and what the scene does not say are"
            )
            found.append(f"everything but where lines lie: the bearing has no [geometry], so {assumed} assumed")
    if any(defect.kind is Fault.ROLLER for defect in scene.defects):
        found.append("a defect on a roller")
    if bearing is not None and (overload := bearing.overload(scene.load.radial_n, scene.load.axial_n)):
        found.append(overload)
    if scene.load.axial_n or (scene.load_profile is not None and any(scene.load_profile.axial_n)):
        found.append("axial load")
    if scene.speed_profile is not None or scene.load_profile is not None:
        found.append("speed or load that varies over time")
    if scene.load.gravity:
        found.append("gravity")
    if scene.surface is not None:
        found.append("waves of races and rollers")
    return tuple(found)


def bearing_of_run(scene: Scene) -> Bearing | None:
    """The bearing of a scene that was run; None if its file is gone."""
    try:
        return load_bearing(scene.bearing)
    except SrbvalError:
        return None
