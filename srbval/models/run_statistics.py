"""Running sums over a run, from which status, results, energy and force balances are computed without its signals."""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing
from srbval.models import outputs as col
from srbval.models.health import assess
from srbval.models.hierarchy import level_of
from srbval.models.run import RunStatus, RunSummary
from srbval.models.sensor import BandLevels, SensorFilter
from srbval.scene import Scene

# losses of a bearing in oil by source, except for seals
LOSSES = {
    "sliding": col.MEAN_FRICTION_POWER,
    "rolling": col.MEAN_ROLLING_POWER,
    "drag": col.MEAN_DRAG_POWER,
    "cage": col.MEAN_POCKET_POWER,
    "damping": col.MEAN_DAMPING_POWER,
}
INPUT_POWERS = [col.MEAN_DRIVE_POWER, col.MEAN_LOAD_POWER]
LOSS_POWERS = np.r_[col.MEAN_FRICTION_POWER : col.MEAN_HOUSING_POWER + 1, col.OIL_LOSSES]
STORED_ENERGIES = [col.BODY_ENERGY_AT_START, col.CONTACT_ENERGY_AT_START, col.SPRING_ENERGY_AT_START]


class RingSupport(NamedTuple):
    """Mass and weight of the outer ring with attached parts, and the housing's spring and damper; NaN if unknown."""

    mass_kg: float = math.nan
    weight_n: float = math.nan
    stiffness_n_m: float = math.nan
    damping_ns_m: float = math.nan


@dataclass
class RunningSums:
    """Sum of a run's outputs over all intervals, and the first and last interval's outputs, [COLUMN_COUNT] each."""

    rows: int = 0
    total: FloatArray = field(default_factory=lambda: np.zeros(col.COLUMN_COUNT))
    first: FloatArray = field(default_factory=lambda: np.zeros(col.COLUMN_COUNT))
    last: FloatArray = field(default_factory=lambda: np.zeros(col.COLUMN_COUNT))

    def add(self, out: FloatArray) -> None:
        """Add the outputs of a chunk of n intervals, [n, COLUMN_COUNT]."""
        self.first = self.first if self.rows else out[0].copy()
        self.rows, self.last = self.rows + len(out), out[-1].copy()
        self.total = self.total + np.ascontiguousarray(out.T).sum(axis=1)

    def energy_imbalance(self, interval_s: float) -> float:
        """Energy imbalance: work minus increase of stored energy minus losses, over the losses; NaN without losses.

        The stored energy is known only at the start of an interval, so the last interval is left out.
        """
        through = (self.total - self.last) * interval_s
        gained, lost = float((self.last - self.first)[STORED_ENERGIES].sum()), float(through[LOSS_POWERS].sum())
        return (float(through[INPUT_POWERS].sum()) - gained - lost) / lost if lost else math.nan

    def missing_n(self, ring: RingSupport, load_n: FloatArray, interval_s: float) -> FloatArray:
        """Mean sum of the forces on the ring minus mass times acceleration [N], [3]; NaN if unknown.

        It differs from zero by the errors of the integrator. `load_n`: mean load, [3]. The first interval is left out:
        the speed before it is unknown.
        """
        intervals = self.rows - 1 if self.rows > 1 else math.nan
        mean = (self.total - self.first) / intervals
        moved = (self.last - self.first)[col.DISPLACEMENT_XYZ] / intervals
        held = ring.stiffness_n_m * (mean[col.DISPLACEMENT_XYZ] - moved / 2) + ring.damping_ns_m * moved / interval_s
        weight = np.array([0.0, -ring.weight_n, 0.0])
        return mean[col.MEAN_RING_FORCE_XYZ] + load_n + weight - held - ring.mass_kg * mean[col.ACCELERATION_XYZ]


@dataclass
class RunStatistics:
    """Statistics of a run, accumulated chunk by chunk.

    `figures`: further fields of `RunSummary`, by name. `ended`: status and reason if the model determines them itself.
    """

    scene: Scene
    bearing: Bearing
    wall_s: float = 0.0
    cpu_s: float = 0.0
    compile_s: float = 0.0
    finite: bool = True
    deepest_m: float = -math.inf
    idle: int = 0
    figures: dict[str, Any] = field(default_factory=dict)
    ended: tuple[RunStatus, str] | None = None
    sums: RunningSums = field(default_factory=RunningSums)
    ring: RingSupport = field(default_factory=RingSupport)

    def __post_init__(self) -> None:
        scene = self.scene
        self.levels = BandLevels(fs_hz=scene.output_rate_hz)
        self.sensor = SensorFilter(scene.sensor_path, scene.output_rate_hz, scene.load.direction_rad)

    @contextmanager
    def timed(self) -> Iterator[None]:
        """Add the wall time and the processor time of a block of code to the run's times."""
        started, worked = time.perf_counter(), time.thread_time()
        yield
        self.wall_s += time.perf_counter() - started
        self.cpu_s += time.thread_time() - worked

    def add(self, out: FloatArray) -> FloatArray:
        """Add the outputs of a chunk, [n, COLUMN_COUNT] (NaN: not computed); returns the acceleration at the sensor."""
        self.deepest_m = max(self.deepest_m, float(out[:, col.MAX_PENETRATION].max()))
        self.idle += int(np.count_nonzero(out[:, col.CONTACT_ENERGY_AT_START] == 0.0))
        self.sums.add(out)
        sensor_m_s2 = self.sensor.add(out[:, col.ACCELERATION_XYZ])
        self.levels.add(sensor_m_s2)
        return sensor_m_s2

    def has_diverged(self, out: FloatArray) -> bool:
        """True if an output is not finite (`finite` is then false) or a penetration exceeds `DEPTH_LIMIT_M`."""
        self.finite = bool(np.all(np.isfinite(out[..., level_of(self.scene.model).columns])))
        return not self.finite or float(out[:, col.MAX_PENETRATION].max()) > col.DEPTH_LIMIT_M

    @np.errstate(all="ignore")  # the state may not be finite
    def summary(self) -> RunSummary:
        """Results and status of the run, from all chunks added so far."""
        scene, n, interval_s = self.scene, max(self.sums.rows, 1), 1 / self.scene.output_rate_hz
        shaft, direction = scene.mean_shaft_rad_s or math.nan, load_direction(scene)
        mean = self.sums.total / n
        missing_n = self.sums.missing_n(self.ring, scene.mean_radial_n * direction, interval_s)
        run = RunSummary(
            **self.figures,
            **{name: value for name, value in vars(self).items() if name in RunSummary.__dataclass_fields__},
            samples=self.sums.rows,
            status=RunStatus.OK,
            reason="",
            rolling_elements=self.bearing.rolling_elements,
            rolling_ratio=self.bearing.orders.ftf,
            cage_ratio=float(mean[col.CAGE_SPEED]) / shaft,
            roller_load_share=load_share(scene, mean[col.MEAN_RING_FORCE_XYZ], scene.mean_radial_n),
            energy_imbalance=self.sums.energy_imbalance(interval_s),
            missing_n=float(missing_n @ direction),
            idle_share=self.idle / n,
            drive_power_w=float(mean[col.MEAN_DRIVE_POWER]),
            band_rms_m_s2=self.levels.rms(),
        )
        if scene.oil is not None:
            power_w = {name: float(mean[column]) for name, column in LOSSES.items()} | {"seals": 0.0}
            run = replace(run, power_w=power_w | {"total": sum(power_w.values())})
        status, reason = assess(run) if self.ended is None else self.ended
        return replace(run, status=status, reason=reason)


def load_share(scene: Scene, force_n: FloatArray, radial_n: float) -> float:
    """Share of the load `radial_n` that the rollers' force on the ring, `force_n`, [3], carries; NaN without load."""
    return float(-force_n @ load_direction(scene)) / radial_n if radial_n else math.nan


def load_direction(scene: Scene) -> FloatArray:
    """Unit vector in the direction of the scene's radial load, [3]."""
    angle = scene.load.direction_rad
    return np.array([math.cos(angle), math.sin(angle), 0.0])
