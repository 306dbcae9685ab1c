"""Result of a run: signals on one time axis, status, numerical results and cost."""

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

VARIABLES = read_toml(Path(__file__).with_name("run_variables.toml"))  # variables of a run file, in their order


class RunStatus(enum.StrEnum):
    """Status of a finished run; see `works` for the statuses that `srbval simulate` accepts.

    `SKIDDING`: the cage is much slower or faster than in pure rolling. `ROLLERS_UNLOADED`: the load bypasses the
    rollers, or there is no load. `INACCURATE`: errors due to the step exceed their tolerances; the run is written to a
    file but not accepted. All others but `OK` are failures, the last six only of models from outside the package.
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
        """True if a run with this status is written to a file: it is accepted (see `works`) or inaccurate."""
        return self.value in USABLE


WORKING = ("ok", "skidding", "rollers-unloaded")  # statuses of runs that `srbval simulate` accepts, with exit code 0
BY_CHANCE = ("out-of-time", "out-of-memory", "died")  # statuses that a busy machine may cause; never stored
USABLE = (*WORKING, "inaccurate")  # statuses of runs that are written to a file


def works(status: str) -> bool:
    """True if `srbval simulate` accepts a run with this status, a `RunStatus` or its stored text.

    A run is accepted if its numerics passed every check, even if the bearing skids or is unloaded.
    """
    return status in WORKING


@dataclass(frozen=True, kw_only=True, eq=False)
class RunSummary:
    """Status and results of a run without its signals; recording starts after the scene's settling time.

    `cage_ratio` is the mean cage speed over the mean shaft speed, `rolling_ratio` the ratio of pure rolling.
    `roller_load_share` is the share of the mean radial load on the rollers (NaN without a load; the housing spring
    carries the rest), `balanced_share` their share in static balance.
    `drive_power_w` is the mean power of the shaft's drive. For `energy_imbalance` and `missing_n` (here the component
    along the load) see `RunningSums`; NaN if a model has no energies or forces. `deepest_m` is the deepest penetration,
    `idle_share` the share of the time without any contact.

    `step_error`: errors due to the step, None if not estimated; `check_wall_s`: wall time of this estimate;
    `step_limit_s`: longest stable step (`step_limits.elastic_limit_s`), `default_limit_s`: the longest stable step of
    the default solver; `band_rms_m_s2`: RMS along the sensor's axis by band of `scene.BANDS_HZ`; `stored_utc`: time of
    the simulation if the run was read from the cache; `cpu_s`, `wall_s`: processor and wall time of the simulation,
    without the compilation.

    In oil: `power_w`, mean losses by source and their `total` [W] (`seals` are always 0); `film_um`, thickness of the
    oil film in the loaded contacts at the run's end, the least (`min`) and the mean over the contacts' middles
    (`mean`); `lambda_min`, least thickness over roughness. Without oil `lambda_min` is NaN, the others are empty.

    `free_rollers`: if rollers tilt and slide along their axes, largest values of the loaded rollers at the run's end:
    tilt `tilt_mrad`, axial displacement `shift_um`, and `skew_nm`, the friction moment about the roller's radial axis,
    which would skew the roller; `row_1_share`: share of row 1 in the loads on the outer race. Otherwise empty.
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
        """Return this run; if it is not usable, raise `NumericsError` with the reason. `what`: the run's name."""
        if not self.status.usable:
            raise NumericsError(f"{what} failed with the status {self.status}: {self.reason}.")
        return self

    @property
    def slip_pct(self) -> float:
        """Slip of the cage: its lag behind pure rolling [%]."""
        return 100 * (1 - self.cage_ratio / self.rolling_ratio)

    @property
    def seconds(self) -> float:
        """Recorded duration [s]."""
        return self.samples / self.scene.output_rate_hz

    @property
    def not_validated(self) -> tuple[str, ...]:
        """Descriptions of the parts of the scene that no comparison with measurements has validated."""
        return not_validated(self.scene)

    @property
    def bpfo_hz(self) -> float:
        """Outer-race fault frequency [Hz]: number of rolling elements times mean cage frequency."""
        return self.rolling_elements * self.cage_ratio * self.scene.shaft_hz

    @property
    def bpfi_hz(self) -> float:
        """Inner-race fault frequency [Hz]: number of rolling elements times mean of shaft minus cage frequency."""
        return self.rolling_elements * (1 - self.cage_ratio) * self.scene.shaft_hz

    @property
    def wall_per_simulated_s(self) -> float:
        """Wall time per simulated second (settling time included), without compiling."""
        return self.wall_s / (self.seconds + self.scene.settle_s)

    @property
    def cpu_per_simulated_s(self) -> float:
        """Processor time per simulated second (settling time included), without compiling."""
        return self.cpu_s / (self.seconds + self.scene.settle_s)


def _output(columns: int | slice, meaning: str) -> Any:
    """Make a property of `Run` that returns columns of its array `out`, contiguous; `meaning`: its docstring."""
    return property(lambda run: np.ascontiguousarray(run.out[:, columns]), doc=meaning)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Run(RunSummary, Outputs, NotebookObject):
    """Simulated run in memory, with the outputs of all its n output intervals."""

    acceleration_m_s2 = _output(col.ACCELERATION_XYZ, "Acceleration of the outer ring, mean of the interval, [n, 3].")
    displacement_m = _output(col.DISPLACEMENT_XYZ, "Displacement of the outer ring at the interval's end, [n, 3].")
    cage_rad_s = _output(col.CAGE_SPEED, "Speed of the cage, mean of the interval, [n].")
    cage_tilt_rad = _output(col.CAGE_TILT_XY, "Tilt of the cage about x and y at the interval's end, [n, 2].")
    roller_force_n = _output(col.MEAN_RING_FORCE_XYZ, "Mean force of the rollers on the outer ring, [n, 3].")
    depth_m = _output(col.MAX_PENETRATION, "Deepest penetration into an undamaged raceway, [n].")

    @property
    def time_s(self) -> FloatArray:
        """Time at the start of each output interval [s], [n]."""
        return np.arange(len(self.out)) / self.scene.output_rate_hz

    def to_frame(self) -> pandas.DataFrame:
        """Convert to a pandas table: for each output interval its start `time_s` and the variables of a run file."""
        import pandas

        columns = {name: self.out[:, variable["column"]] for name, variable in VARIABLES.items()}
        return pandas.DataFrame({"time_s": self.time_s} | columns)

    def to_xarray(self) -> xarray.Dataset:
        """Convert to the data set that xarray reads from the run's file, with units; times are ends of intervals."""
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
    """Descriptions of a scene's parts and of results that no comparison with measurements has validated.

    Amplitudes are always among them. A bearing of any name counts as validated if it has the geometry of the bearing
    `DEFAULT_BEARING`.
    """
    bearing, outside = bearing_of_run(scene), is_outside(scene.model)
    geometry = None if bearing is None else bearing.geometry
    overload = "" if bearing is None else bearing.overload(scene.load.radial_n, scene.load.axial_n)
    assumed = "the bearing has no [geometry], so grooves, housing and unstated values of the scene are assumed"
    parts = {
        "amplitudes and the noise floor": not outside,
        f"all results of the model {scene.model}, which is not part of srbval": outside,
        f"the bearing {scene.bearing}: only the {DEFAULT_BEARING} was compared with measurements": (
            geometry != load_bearing(DEFAULT_BEARING).geometry
        ),
        f"everything except line frequencies: {assumed}": bearing is not None and geometry is None,
        "a defect on a roller": any(defect.kind is Fault.ROLLER for defect in scene.defects),
        overload: overload,
        "axial load": scene.load_table()[2].any(),
        "speed or load that varies over time": scene.speed_profile or scene.load_profile,
        "gravity": scene.load.gravity,
        "waves of races and rollers": scene.surface,
    }
    return tuple(what for what, applies in parts.items() if applies)


def bearing_of_run(scene: Scene) -> Bearing | None:
    """Load the bearing of a scene that was run; None if this fails, for example because its file is missing."""
    try:
        return load_bearing(scene.bearing)
    except SrbvalError:
        return None
