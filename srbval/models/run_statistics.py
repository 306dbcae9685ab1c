"""Running sums over a run, enough to assess it without its signals in memory."""

import math
from dataclasses import dataclass, field

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing
from srbval.models import outputs as col
from srbval.models.full.point_cloud import DEEPEST_M
from srbval.models.health import HealthIndicators, assess
from srbval.models.ladder import rung_of
from srbval.models.run import RunSummary
from srbval.models.sensor import BandLevels, SensorFilter, along_sensor
from srbval.models.step_error import StepError
from srbval.scene import Scene


@dataclass
class EnergyBalance:
    """Energy balance of a run: work done on the bearing, losses and stored energy, summed interval by interval.

    The energy stored is known at an interval's start, so the latest interval is left out of the sums.
    """

    work_w: float = 0.0
    lost_w: float = 0.0
    first_j: float | None = None
    last_j: float = 0.0
    pending_work_w: float = 0.0
    pending_lost_w: float = 0.0

    def add(self, out: FloatArray) -> None:
        """Enter a chunk's rows, see `outputs`."""
        work = out[:, col.DRIVE_POWER] + out[:, col.LOAD_POWER]
        lost = out[:, col.FRICTION_POWER] + out[:, col.DAMPING_POWER] + out[:, col.HOUSING_POWER]
        stored = out[:, col.BODY_ENERGY] + out[:, col.CONTACT_ENERGY] + out[:, col.SPRING_ENERGY]
        if self.first_j is None:
            self.first_j = float(stored[0])
        self.work_w += self.pending_work_w + float(work[:-1].sum())
        self.lost_w += self.pending_lost_w + float(lost[:-1].sum())
        self.pending_work_w, self.pending_lost_w, self.last_j = float(work[-1]), float(lost[-1]), float(stored[-1])

    def imbalance(self, interval_s: float) -> float:
        """Work in less stored less lost, as a share of what was lost; NaN where nothing was."""
        gained = self.last_j - (self.first_j or 0.0)
        lost = self.lost_w * interval_s
        return (self.work_w * interval_s - gained - lost) / lost if lost else math.nan


@dataclass
class MomentumBalance:
    """Forces on the outer ring over a run: rollers, load, weight, spring and damper make up its change of momentum.

    Newton's second law in the mean; what is missing is the integrator's. The first row is left out, as the ring's speed
    before it is not known.
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
        """Enter a chunk's rows: accelerations, displacements, forces of the rollers."""
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
    """Running sums over a run's chunks, enough to assess it."""

    scene: Scene
    bearing: Bearing
    samples: int = 0
    cage: float = 0.0
    drive_w: float = 0.0
    deepest_m: float = -math.inf
    idle: int = 0
    force_n: FloatArray = field(default_factory=lambda: np.zeros(3))
    finite: bool = True
    balanced_share: float = math.nan
    step_s: float = math.nan
    step_limit_s: float = math.nan
    default_limit_s: float = math.inf
    wall_s: float = 0.0
    compile_s: float = 0.0
    check_wall_s: float = 0.0
    energy: EnergyBalance = field(default_factory=EnergyBalance)
    momentum: MomentumBalance = field(default_factory=MomentumBalance)
    cage_course: tuple[float, float] = (math.nan, math.nan)  # mean speed in the first and in the latest chunk
    step_error: StepError | None = None
    levels: BandLevels = field(init=False)
    sensor: SensorFilter = field(init=False)

    def __post_init__(self) -> None:
        self.levels = BandLevels(fs_hz=self.scene.output_rate_hz)
        self.sensor = SensorFilter(self.scene.sensor_path, self.scene.output_rate_hz)

    def add(self, out: FloatArray) -> FloatArray:
        """Count a chunk's rows in; what the model does not have is NaN and passes every test.

        What the sensor shows of it [m/s2], one a row.
        """
        self.finite = self.finite and self._all_finite(out)
        self.samples += len(out)
        self.cage += float(out[:, col.CAGE_SPEED].sum())
        self.drive_w += float(out[:, col.DRIVE_POWER].sum())
        latest = float(out[:, col.CAGE_SPEED].mean())
        self.cage_course = (latest if math.isnan(self.cage_course[0]) else self.cage_course[0], latest)
        self.force_n = self.force_n + out[:, col.RING_FORCE].sum(axis=0)
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
        return bool(np.all(np.isfinite(out[..., rung_of(self.scene.model).columns])))

    def summary(self) -> RunSummary:
        """Figures and status of all that was added."""
        scene, n = self.scene, max(self.samples, 1)
        mean_shaft, interval_s = scene.mean_shaft_rad_s or math.nan, 1 / scene.output_rate_hz
        direction = load_direction(scene)
        with np.errstate(all="ignore"):  # of a state that is not finite
            missing_n = self.momentum.missing_n(scene.mean_radial_n * direction, interval_s)
        ratio, imbalance = self.cage / n / mean_shaft, self.energy.imbalance(interval_s)
        share = load_share(scene, self.force_n / n, scene.mean_radial_n)
        indicators = HealthIndicators(
            finite=self.finite, deepest_m=self.deepest_m, limit_m=DEEPEST_M, rolling_ratio=self.bearing.orders.ftf,
            load_share=share, balanced_share=self.balanced_share, idle_share=self.idle / n, step_s=self.step_s,
            step_limit_s=self.step_limit_s, default_limit_s=self.default_limit_s, step_error=self.step_error,
            missing_n=float(missing_n @ direction), cage_course=tuple(w / mean_shaft for w in self.cage_course),
            cage_ratio=ratio, energy_imbalance=imbalance,
        )  # fmt: skip
        status, reason = assess(scene, indicators)
        return RunSummary(
            scene=scene, rolling_elements=self.bearing.rolling_elements, status=status, reason=reason,
            samples=self.samples, roller_load_share=share, drive_power_w=self.drive_w / n, wall_s=self.wall_s,
            compile_s=self.compile_s, check_wall_s=self.check_wall_s, step_error=self.step_error,
            band_rms_m_s2=self.levels.rms(), cage_ratio=ratio, energy_imbalance=imbalance,
        )  # fmt: skip


def load_share(scene: Scene, force_n: FloatArray, radial_n: float) -> float:
    """Part of a radial load that a force of the rollers on the ring, [3], carries; NaN without a load."""
    return float(-force_n @ load_direction(scene)) / radial_n if radial_n else math.nan


def load_direction(scene: Scene) -> FloatArray:
    """Of the scene's radial load, a unit vector [3]."""
    angle = scene.load.direction_rad
    return np.array([math.cos(angle), math.sin(angle), 0.0])
