"""Running sums over a run, with its balances of energy and momentum: enough to assess it without its signals."""

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

# losses of a bearing in oil by source; it has no seals
LOSSES = {
    "sliding": col.FRICTION_POWER,
    "rolling": col.ROLLING_POWER,
    "drag": col.DRAG_POWER,
    "cage": col.POCKET_POWER,
    "damping": col.DAMPING_POWER,
}
WORK = [col.DRIVE_POWER, col.LOAD_POWER]
LOST = [col.FRICTION_POWER, col.DAMPING_POWER, col.HOUSING_POWER, *range(col.COUNT)[col.OIL]]
STORED = [col.BODY_ENERGY, col.CONTACT_ENERGY, col.SPRING_ENERGY]

# fields of `RunStatistics` that its `RunSummary` has too
AS_THEY_ARE = ("scene", "wall_s", "cpu_s", "compile_s", "finite", "deepest_m")


class RingSupport(NamedTuple):
    """Mass and weight of the outer ring with what is fixed to it, and the housing's spring and damper; NaN: unknown."""

    mass_kg: float = math.nan
    weight_n: float = math.nan
    stiffness_n_m: float = math.nan
    damping_ns_m: float = math.nan


@dataclass
class RunningSums:
    """Sum of a run's rows, its first and its last row, [COUNT] each, see `outputs`: what its balances follow from."""

    rows: int = 0
    total: FloatArray = field(default_factory=lambda: np.zeros(col.COUNT))
    first: FloatArray = field(default_factory=lambda: np.zeros(col.COUNT))
    last: FloatArray = field(default_factory=lambda: np.zeros(col.COUNT))

    def add(self, out: FloatArray) -> None:
        """Enter a chunk's rows."""
        self.first = self.first if self.rows else out[0].copy()
        self.rows, self.last = self.rows + len(out), out[-1].copy()
        self.total = self.total + np.ascontiguousarray(out.T).sum(axis=1)

    def energy_imbalance(self, interval_s: float) -> float:
        """Work in less stored less lost, as a share of the losses; NaN if there are none.

        The energy stored is known at an interval's start, so the last interval is left out.
        """
        through = (self.total - self.last) * interval_s
        gained, lost = float((self.last - self.first)[STORED].sum()), float(through[LOST].sum())
        return (float(through[WORK].sum()) - gained - lost) / lost if lost else math.nan

    def missing_n(self, ring: RingSupport, load_n: FloatArray, interval_s: float) -> FloatArray:
        """Mean force on the ring that no other force explains, under a mean external load, [3]; NaN if unknown.

        Newton's second law in the mean: a missing force is an error of the integrator. The first row is left out, as
        the ring's speed before it is not known.
        """
        intervals = self.rows - 1 if self.rows > 1 else math.nan
        mean = (self.total - self.first) / intervals
        moved = (self.last - self.first)[col.DISPLACEMENT] / intervals
        held = ring.stiffness_n_m * (mean[col.DISPLACEMENT] - moved / 2) + ring.damping_ns_m * moved / interval_s
        weight = np.array([0.0, -ring.weight_n, 0.0])
        return mean[col.RING_FORCE] + load_n + weight - held - ring.mass_kg * mean[col.ACCELERATION]


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
    finite: bool = True
    deepest_m: float = -math.inf
    idle: int = 0
    figures: dict[str, Any] = field(default_factory=dict)
    ended: tuple[RunStatus, str] | None = None
    course_rad_s: tuple[float, float] = (math.nan, math.nan)  # mean cage speed in the first and in the latest chunk
    sums: RunningSums = field(default_factory=RunningSums)
    ring: RingSupport = field(default_factory=RingSupport)

    def __post_init__(self) -> None:
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
        latest = float(out[:, col.CAGE_SPEED].mean())
        self.course_rad_s = (latest if math.isnan(self.course_rad_s[0]) else self.course_rad_s[0], latest)
        self.deepest_m = max(self.deepest_m, float(out[:, col.DEEPEST].max()))
        self.idle += int(np.count_nonzero(out[:, col.CONTACT_ENERGY] == 0.0))
        self.sums.add(out)
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
        scene, n, interval_s = self.scene, max(self.sums.rows, 1), 1 / self.scene.output_rate_hz
        shaft, direction = scene.mean_shaft_rad_s or math.nan, load_direction(scene)
        with np.errstate(all="ignore"):  # the state may not be finite
            mean = self.sums.total / n
            missing_n = self.sums.missing_n(self.ring, scene.mean_radial_n * direction, interval_s)
            energy_imbalance = self.sums.energy_imbalance(interval_s)
        run = RunSummary(
            **self.figures,
            **{name: getattr(self, name) for name in AS_THEY_ARE},
            samples=self.sums.rows,
            status=RunStatus.OK,
            reason="",
            rolling_elements=self.bearing.rolling_elements,
            rolling_ratio=self.bearing.orders.ftf,
            cage_ratio=float(mean[col.CAGE_SPEED]) / shaft,
            cage_course=(self.course_rad_s[0] / shaft, self.course_rad_s[1] / shaft),
            roller_load_share=load_share(scene, mean[col.RING_FORCE], scene.mean_radial_n),
            energy_imbalance=energy_imbalance,
            missing_n=float(missing_n @ direction),
            idle_share=self.idle / n,
            drive_power_w=float(mean[col.DRIVE_POWER]),
            band_rms_m_s2=self.levels.rms(),
        )
        if scene.oil is not None:
            power_w = {name: float(mean[column]) for name, column in LOSSES.items()} | {"seals": 0.0}
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
