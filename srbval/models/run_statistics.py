"""Running sums over a run, enough to assess it without its signals in memory."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing
from srbval.models import outputs as col
from srbval.models.balances import EnergyBalance, MomentumBalance
from srbval.models.estimates import StepError
from srbval.models.health import assess
from srbval.models.hierarchy import level_of
from srbval.models.run import RunStatus, RunSummary
from srbval.models.sensor import BandLevels, SensorFilter
from srbval.scene import Scene

# losses of a bearing in oil by source; it has no seals
LOSSES = {"sliding": col.FRICTION_POWER, "rolling": col.ROLLING_POWER, "drag": col.DRAG_POWER, "cage": col.POCKET_POWER,
          "damping": col.DAMPING_POWER}  # fmt: skip


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
    film_um: Mapping[str, float] = field(default_factory=dict)
    lambda_min: float = math.nan
    free_rollers: Mapping[str, float] = field(default_factory=dict)
    course_rad_s: tuple[float, float] = (math.nan, math.nan)  # mean cage speed in the first and in the latest chunk
    energy: EnergyBalance = field(default_factory=EnergyBalance)
    momentum: MomentumBalance = field(default_factory=MomentumBalance)

    def __post_init__(self) -> None:
        self.losses_w = dict.fromkeys(LOSSES, 0.0)
        scene = self.scene
        self.levels = BandLevels(fs_hz=scene.output_rate_hz)
        self.sensor = SensorFilter(scene.sensor_path, scene.output_rate_hz, scene.load.direction_rad)

    def add(self, out: FloatArray) -> FloatArray:
        """Count a chunk's rows in; what the model does not have is NaN and passes every test.

        What the sensor shows of it [m/s2], one a row.
        """
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
        """Do these rows show that the run is beyond recovery, so that going on would be a waste?"""
        return not self._all_finite(out) or float(out[:, col.DEEPEST].max()) > col.DEEPEST_M

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
        if scene.oil is not None:
            power_w = {name: sum_w / n for name, sum_w in self.losses_w.items()} | {"seals": 0.0}
            run = replace(run, power_w=power_w | {"total": sum(power_w.values())})
        status, reason = assess(run)
        return replace(run, status=status, reason=reason)


def load_share(scene: Scene, force_n: FloatArray, radial_n: float) -> float:
    """Part of a radial load that a force of the rollers on the ring, [3], carries; NaN without a load."""
    return float(-force_n @ load_direction(scene)) / radial_n if radial_n else math.nan


def load_direction(scene: Scene) -> FloatArray:
    """Of the scene's radial load, a unit vector [3]."""
    angle = scene.load.direction_rad
    return np.array([math.cos(angle), math.sin(angle), 0.0])
