"""Running sums over a run, with its balances of energy and momentum: enough to assess it without its signals."""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing
from srbval.models import outputs as col
from srbval.models.health import assess
from srbval.models.hierarchy import level_of
from srbval.models.run import RunStatus, RunSummary
from srbval.models.sensor import BandLevels, SensorFilter
from srbval.scene import Scene

# losses of a bearing in oil by source; it has no seals
LOSSES = {
    "sliding": col.FRICTION_POWER,
    "rolling": col.ROLLING_POWER,
    "drag": col.DRAG_POWER,
    "cage": col.POCKET_POWER,
    "damping": col.DAMPING_POWER,
}

# fields of `RunStatistics` that its `RunSummary` has too
AS_THEY_ARE = ("scene", "wall_s", "cpu_s", "compile_s", "samples", "finite", "deepest_m")


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
        lost = lost + out[:, col.OIL].sum(axis=1)
        stored = out[:, col.BODY_ENERGY] + out[:, col.CONTACT_ENERGY] + out[:, col.SPRING_ENERGY]
        self.first_j = float(stored[0]) if self.first_j is None else self.first_j
        self.work_w += self.pending[0] + float(work[:-1].sum())
        self.lost_w += self.pending[1] + float(lost[:-1].sum())
        self.pending, self.last_j = (float(work[-1]), float(lost[-1])), float(stored[-1])

    def imbalance(self, interval_s: float) -> float:
        """Work in less stored less lost, as a share of the losses; NaN if there are none."""
        gained, lost = self.last_j - (self.first_j or 0.0), self.lost_w * interval_s
        return (self.work_w * interval_s - gained - lost) / lost if lost else math.nan


@dataclass
class MomentumBalance:
    """Newton's second law for the outer ring in the mean over a run: a missing force is an error of the integrator.

    The first row is left out, as the ring's speed before it is not known. The arrays, [9]: accelerations,
    displacements, forces of the rollers.
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
        """Mean force on the ring that no other force explains, under a mean external load, [3]; NaN if unknown."""
        intervals = self.rows - 1 if self.rows > 1 else math.nan
        acceleration, displacement, rollers = np.split((self.total - self.first) / intervals, 3)
        moved = (self.last - self.first)[3:6] / intervals
        held = self.stiffness_n_m * (displacement - moved / 2) + self.damping_ns_m * moved / interval_s
        weight = np.array([0.0, -self.weight_n, 0.0])
        return rollers + load_n + weight - held - self.mass_kg * acceleration


@dataclass
class RunStatistics:
    """Running sums over a run's chunks.

    `figures`: further fields of its `RunSummary`, by name. `ended`: status and reason, if the model itself states them.
    """

    scene: Scene
    bearing: Bearing
    wall_s: float = 0.0
    cpu_s: float = 0.0
    compile_s: float = 0.0
    samples: int = 0
    finite: bool = True
    deepest_m: float = -math.inf
    cage_rad: float = 0.0
    drive_w: float = 0.0
    idle: int = 0
    figures: dict[str, Any] = field(default_factory=dict)
    ended: tuple[RunStatus, str] | None = None
    course_rad_s: tuple[float, float] = (math.nan, math.nan)  # mean cage speed in the first and in the latest chunk
    energy: EnergyBalance = field(default_factory=EnergyBalance)
    momentum: MomentumBalance = field(default_factory=MomentumBalance)

    def __post_init__(self) -> None:
        self.losses_w = dict.fromkeys(LOSSES, 0.0)
        scene = self.scene
        self.levels = BandLevels(fs_hz=scene.output_rate_hz)
        self.sensor = SensorFilter(scene.sensor_path, scene.output_rate_hz, scene.load.direction_rad)

    @contextmanager
    def timed(self) -> Iterator[None]:
        """Add the wall time and the processor time of the block to the run's."""
        started, worked = time.perf_counter(), time.thread_time()
        yield
        self.wall_s += time.perf_counter() - started
        self.cpu_s += time.thread_time() - worked

    def add(self, out: FloatArray) -> FloatArray:
        """Count the rows of a chunk; returns the sensor's acceleration [m/s2]. Columns that a model lacks are NaN."""
        self.finite = self.finite and self._all_finite(out)
        self.samples += len(out)
        self.cage_rad += float(out[:, col.CAGE_SPEED].sum())
        self.drive_w += float(out[:, col.DRIVE_POWER].sum())
        for name, column in LOSSES.items():
            self.losses_w[name] += float(out[:, column].sum())
        latest = float(out[:, col.CAGE_SPEED].mean())
        self.course_rad_s = (latest if math.isnan(self.course_rad_s[0]) else self.course_rad_s[0], latest)
        self.deepest_m = max(self.deepest_m, float(out[:, col.DEEPEST].max()))
        self.idle += int(np.count_nonzero(out[:, col.CONTACT_ENERGY] == 0.0))
        self.energy.add(out)
        self.momentum.add(out)
        shown = self.sensor.add(out[:, col.ACCELERATION])
        self.levels.add(shown)
        return shown

    def lost(self, out: FloatArray) -> bool:
        """True if these rows show that the run is beyond recovery, so that it ends here."""
        return not self._all_finite(out) or float(out[:, col.DEEPEST].max()) > col.DEEPEST_M

    def _all_finite(self, out: FloatArray) -> bool:
        return bool(np.all(np.isfinite(out[..., level_of(self.scene.model).columns])))

    def summary(self) -> RunSummary:
        """Figures and status of all that was added."""
        scene, n, interval_s = self.scene, max(self.samples, 1), 1 / self.scene.output_rate_hz
        shaft, direction = scene.mean_shaft_rad_s or math.nan, load_direction(scene)
        with np.errstate(all="ignore"):  # the state may not be finite
            missing_n = self.momentum.missing_n(scene.mean_radial_n * direction, interval_s)
        run = RunSummary(
            **self.figures,
            **{name: getattr(self, name) for name in AS_THEY_ARE},
            status=RunStatus.OK,
            reason="",
            rolling_elements=self.bearing.rolling_elements,
            rolling_ratio=self.bearing.orders.ftf,
            cage_ratio=self.cage_rad / n / shaft,
            cage_course=(self.course_rad_s[0] / shaft, self.course_rad_s[1] / shaft),
            roller_load_share=load_share(scene, self.momentum.total[6:] / n, scene.mean_radial_n),
            energy_imbalance=self.energy.imbalance(interval_s),
            missing_n=float(missing_n @ direction),
            idle_share=self.idle / n,
            drive_power_w=self.drive_w / n,
            band_rms_m_s2=self.levels.rms(),
        )
        if scene.oil is not None:
            power_w = {name: sum_w / n for name, sum_w in self.losses_w.items()} | {"seals": 0.0}
            run = replace(run, power_w=power_w | {"total": sum(power_w.values())})
        status, reason = assess(run) if self.ended is None else self.ended
        return replace(run, status=status, reason=reason)


def load_share(scene: Scene, force_n: FloatArray, radial_n: float) -> float:
    """Part of a radial load that a force of the rollers on the ring, [3], carries; NaN without a load."""
    return float(-force_n @ load_direction(scene)) / radial_n if radial_n else math.nan


def load_direction(scene: Scene) -> FloatArray:
    """Direction of the scene's radial load, a unit vector [3]."""
    angle = scene.load.direction_rad
    return np.array([math.cos(angle), math.sin(angle), 0.0])
