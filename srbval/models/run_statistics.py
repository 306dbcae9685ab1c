"""Running sums over a run, enough to assess it without its signals in memory."""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing
from srbval.models import outputs as col
from srbval.models.full.point_cloud import DEEPEST_M
from srbval.models.health import assess
from srbval.models.hierarchy import level_of
from srbval.models.run import RunStatus, RunSummary
from srbval.models.sensor import BandLevels, SensorFilter, along_sensor
from srbval.models.step_error import StepError
from srbval.scene import Scene


@dataclass
class EnergyBalance:
    """Work done on the bearing, losses and stored energy over a run.

    The energy stored is known at an interval's start, so the latest interval, `pending`, is left out of the sums.
    """

    work_w: float = 0.0
    lost_w: float = 0.0
    pending: tuple[float, float] = (0.0, 0.0)
    first_j: float | None = None
    last_j: float = 0.0

    def add(self, out: FloatArray) -> None:
        """Enter a chunk's rows, see `outputs`."""
        work = out[:, col.DRIVE_POWER] + out[:, col.LOAD_POWER]
        lost = out[:, col.FRICTION_POWER] + out[:, col.DAMPING_POWER] + out[:, col.HOUSING_POWER]
        stored = out[:, col.BODY_ENERGY] + out[:, col.CONTACT_ENERGY] + out[:, col.SPRING_ENERGY]
        self.first_j = float(stored[0]) if self.first_j is None else self.first_j
        self.work_w += self.pending[0] + float(work[:-1].sum())
        self.lost_w += self.pending[1] + float(lost[:-1].sum())
        self.pending, self.last_j = (float(work[-1]), float(lost[-1])), float(stored[-1])

    def imbalance(self, interval_s: float) -> float:
        """Work in less stored less lost, as a share of what was lost; NaN where nothing was."""
        gained, lost = self.last_j - (self.first_j or 0.0), self.lost_w * interval_s
        return (self.work_w * interval_s - gained - lost) / lost if lost else math.nan


@dataclass
class MomentumBalance:
    """Forces on the outer ring over a run: rollers, load, weight, spring and damper make up its change of momentum.

    Newton's second law in the mean; what is missing is the integrator's. The first row is left out, as the ring's speed
    before it is not known. The arrays, [9]: accelerations, displacements, forces of the rollers.
    """

    mass_kg: float = math.nan
    stiffness_n_m: float = math.nan
    damping_ns_m: float = math.nan
    weight_n: float = math.nan
    rows: int = 0
    first: FloatArray = field(default_factory=lambda: np.zeros(9))
    last: FloatArray = field(default_factory=lambda: np.zeros(9))
    total: FloatArray = field(default_factory=lambda: np.zeros(9))

    def add(self, out: FloatArray) -> None:
        """Enter a chunk's rows, see `outputs`."""
        rows = np.hstack([out[:, part] for part in (col.ACCELERATION, col.DISPLACEMENT, col.RING_FORCE)])
        self.first = self.first if self.rows else rows[0]
        self.rows, self.last, self.total = self.rows + len(rows), rows[-1], self.total + rows.sum(axis=0)

    def missing_n(self, load_n: FloatArray, interval_s: float) -> FloatArray:
        """Mean force on the ring beside these, under a mean external load, [3]; NaN where it is not known."""
        intervals = self.rows - 1 if self.rows > 1 else math.nan
        acceleration, displacement, rollers = np.split((self.total - self.first) / intervals, 3)
        moved = (self.last - self.first)[3:6] / intervals
        held = self.stiffness_n_m * (displacement - moved / 2) + self.damping_ns_m * moved / interval_s
        weight = np.array([0.0, -self.weight_n, 0.0])
        missing: FloatArray = rollers + load_n + weight - held - self.mass_kg * acceleration
        return missing


@dataclass
class RunStatistics:
    """Running sums over a run's chunks, enough to assess it; what bears a name of `RunSummary` is told there."""

    scene: Scene
    bearing: Bearing
    samples: int = 0
    finite: bool = True
    deepest_m: float = -math.inf
    balanced_share: float = math.nan
    step_s: float = math.nan
    step_limit_s: float = math.nan
    default_limit_s: float = math.inf
    wall_s: float = 0.0
    compile_s: float = 0.0
    check_wall_s: float = 0.0
    step_error: StepError | None = None
    cage_rad: float = 0.0
    drive_w: float = 0.0
    idle: int = 0
    course_rad_s: tuple[float, float] = (math.nan, math.nan)  # mean cage speed in the first and in the latest chunk
    energy: EnergyBalance = field(default_factory=EnergyBalance)
    momentum: MomentumBalance = field(default_factory=MomentumBalance)

    def __post_init__(self) -> None:
        self.levels = BandLevels(fs_hz=self.scene.output_rate_hz)
        self.sensor = SensorFilter(self.scene.sensor_path, self.scene.output_rate_hz)

    def add(self, out: FloatArray) -> FloatArray:
        """Count a chunk's rows in; what the model does not have is NaN and passes every test.

        What the sensor shows of it [m/s2], one a row.
        """
        self.finite = self.finite and self._all_finite(out)
        self.samples += len(out)
        self.cage_rad += float(out[:, col.CAGE_SPEED].sum())
        self.drive_w += float(out[:, col.DRIVE_POWER].sum())
        latest = float(out[:, col.CAGE_SPEED].mean())
        self.course_rad_s = (latest if math.isnan(self.course_rad_s[0]) else self.course_rad_s[0], latest)
        self.deepest_m = max(self.deepest_m, float(out[:, col.DEEPEST].max()))
        self.idle += int(np.count_nonzero(out[:, col.CONTACT_ENERGY] == 0.0))
        self.energy.add(out)
        self.momentum.add(out)
        shown = self.sensor.add(along_sensor(out[:, col.ACCELERATION]))
        self.levels.add(shown)
        return shown

    def lost(self, out: FloatArray) -> bool:
        """Do these rows show that the run is beyond recovery, so that going on would be a waste?"""
        return not self._all_finite(out) or float(out[:, col.DEEPEST].max()) > DEEPEST_M

    def _all_finite(self, out: FloatArray) -> bool:
        return bool(np.all(np.isfinite(out[..., level_of(self.scene.model).columns])))

    def summary(self) -> RunSummary:
        """Figures and status of all that was added."""
        scene, n, interval_s = self.scene, max(self.samples, 1), 1 / self.scene.output_rate_hz
        shaft, direction = scene.mean_shaft_rad_s or math.nan, load_direction(scene)
        with np.errstate(all="ignore"):  # of a state that is not finite
            missing_n = self.momentum.missing_n(scene.mean_radial_n * direction, interval_s)
        told = {name: value for name, value in vars(self).items() if name in RunSummary.__dataclass_fields__}
        run = RunSummary(
            **told, status=RunStatus.OK, reason="", rolling_elements=self.bearing.rolling_elements,
            rolling_ratio=self.bearing.orders.ftf, cage_ratio=self.cage_rad / n / shaft,
            cage_course=(self.course_rad_s[0] / shaft, self.course_rad_s[1] / shaft),
            roller_load_share=load_share(scene, self.momentum.total[6:] / n, scene.mean_radial_n),
            energy_imbalance=self.energy.imbalance(interval_s), missing_n=float(missing_n @ direction),
            idle_share=self.idle / n, drive_power_w=self.drive_w / n, band_rms_m_s2=self.levels.rms(),
        )  # fmt: skip
        status, reason = assess(run)
        return replace(run, status=status, reason=reason)


def load_share(scene: Scene, force_n: FloatArray, radial_n: float) -> float:
    """Part of a radial load that a force of the rollers on the ring, [3], carries; NaN without a load."""
    return float(-force_n @ load_direction(scene)) / radial_n if radial_n else math.nan


def load_direction(scene: Scene) -> FloatArray:
    """Of the scene's radial load, a unit vector [3]."""
    angle = scene.load.direction_rad
    return np.array([math.cos(angle), math.sin(angle), 0.0])
