"""Prescribed motion, passages over defects, and the kinematic model: a click, one acceleration pulse, at each passage.

The impulse and planar models use the same motion of shaft, cage and rollers, see `PrescribedMotion`.

The kinematic model computes the frequencies of the fault lines without slip. All clicks have the same arbitrary
strength, so it has no valid harmonics, sidebands, noise floor or amplitudes; a healthy bearing's signal is zero.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray, IntArray
from srbval.bearing import Fault, FaultOrders
from srbval.errors import ConfigurationError
from srbval.models import outputs as col
from srbval.models.outputs import Outputs, split_run
from srbval.models.run_statistics import RunStatistics, load_direction
from srbval.scene import Defect, Scene

CLICK_M_S2 = 1.0  # arbitrary
MOST_PASSAGES = 10_000_000  # highest number of passages in a run, which is computed at once
GRID_S = 1e-3  # step of the table from which times of angles are interpolated


@dataclass(frozen=True, kw_only=True)
class PrescribedMotion:
    """Load, and angles of shaft, cage and rollers, over time; time 0 is `Scene.settle_s` before the recording starts.

    The angles follow from the bearing's fault orders (Randall 2011, sect. 2.2.3) and the scene's `cage_slip`.
    """

    scene: Scene
    orders: FaultOrders

    def shaft_rad(self, time_s: FloatArray) -> FloatArray:
        """Shaft angle [rad], zero at the start; a speed profile is linear between entries, constant outside."""
        times, speeds, turned = self.scene.speed_table()
        i = np.maximum(np.searchsorted(times, time_s, side="right") - 1, 0)
        return turned[i] + (speeds[i] + np.interp(time_s, times, speeds)) / 2 * (time_s - times[i])

    def cage_rad(self, time_s: FloatArray) -> FloatArray:
        """Cage angle at the times `time_s` [rad]."""
        return self.orders.ftf * (1 - self.scene.cage_slip) * self.shaft_rad(time_s)

    def spin_rad(self, time_s: FloatArray) -> FloatArray:
        """Angle of the rollers about their axes, relative to the cage [rad]; they turn opposite to the shaft."""
        return -self.orders.bsf * self.shaft_rad(time_s)

    def radial_n(self, time_s: FloatArray) -> FloatArray:
        """Radial load at the times `time_s` [N]."""
        times, radial_n, _ = self.scene.load_table()
        return np.interp(time_s, times, radial_n)


def passage_times(
    defect: Defect,
    motion: PrescribedMotion,
    rolling_elements: int,
    seconds: float,
    random: np.random.Generator | None = None,
) -> tuple[FloatArray, IntArray]:
    """Times of the passages over a defect [s], in rising order, and the races hit (0 outer, 1 inner), [k] each.

    The times contain all passages from 0 to `seconds` and a few before and after. A roller's defect hits the outer race
    at even-numbered passages. Without `random`, passages are periodic in the shaft's angle. With it, each spacing has a
    random change, `Scene.slip_jitter` times a normally distributed number; the changes accumulate (stationary
    increments: Antoni & Randall 2003, J. Vib. Acoust. 125, 282). Raises `ConfigurationError` if there are more than
    `MOST_PASSAGES`.
    """
    grid = np.arange(-20 * GRID_S, seconds + 20 * GRID_S, GRID_S)
    fixed, per_turn = defect.angle_rad + motion.scene.load.zone_rad, rolling_elements / (2 * np.pi)
    if defect.kind is Fault.ROLLER:
        phase = -(motion.spin_rad(grid) + defect.angle_rad) / np.pi
    elif defect.kind is Fault.INNER:
        phase = (fixed + motion.shaft_rad(grid) - motion.cage_rad(grid)) * per_turn
    else:
        phase = (motion.cage_rad(grid) - fixed) * per_turn  # number of passages so far, an integer at each passage
    if phase[-1] - phase[0] > MOST_PASSAGES:
        raise ConfigurationError(
            f"{phase[-1] - phase[0]:.3g} passages of a defect in {seconds:g} s; the limit of the {motion.scene.model} "
            f"model is {MOST_PASSAGES:.0e}: shorten the run, or use --model full."
        )
    numbers = np.arange(np.ceil(phase[0]), np.floor(phase[-1]) + 1)
    changes = 0.0 * numbers if random is None else motion.scene.slip_jitter * random.standard_normal(len(numbers))
    time_s = np.interp(numbers + np.cumsum(changes), phase, grid)
    if defect.kind is Fault.ROLLER:
        return time_s, numbers.astype(np.int64) % 2
    return time_s, np.full(len(numbers), int(defect.kind is Fault.INNER))


def prescribed_outputs(
    stats: RunStatistics, settle: int, motion: PrescribedMotion, acceleration: FloatArray
) -> Iterator[tuple[int, Outputs]]:
    """Yield a run's outputs in chunks, from `motion` and the ring's `acceleration` in x, y [m/s2], [intervals, 2]."""
    whole, rate = len(acceleration), stats.scene.output_rate_hz
    with stats.timed():
        out = np.full((whole, col.COLUMN_COUNT), np.nan)
        out[:, [col.ACCELERATION_X, col.ACCELERATION_Y]], out[:, col.ACCELERATION_Z] = acceleration, 0.0
        out[:, col.CAGE_SPEED] = np.diff(motion.cage_rad(np.arange(whole + 1) / rate)) * rate
    for first, count in split_run(settle, whole, 0, rate):
        yield first, Outputs(out=out[first : first + count])


def run_kinematic(stats: RunStatistics, settle: int, whole: int) -> Iterator[tuple[int, Outputs]]:
    """Run the kinematic model, see `srbval.models.hierarchy`; a click between two samples is divided between them."""
    scene, rate = stats.scene, stats.scene.output_rate_hz
    motion = PrescribedMotion(scene=scene, orders=stats.bearing.orders)
    clicks = np.zeros(whole + 1)
    with stats.timed():
        for defect in scene.defects:
            times = passage_times(defect, motion, stats.bearing.rolling_elements, whole / rate)[0]
            place = times[(times >= 0) & (times * rate < whole)] * rate
            below = place.astype(np.int64)
            np.add.at(clicks, below, CLICK_M_S2 * (1 - (place - below)))
            np.add.at(clicks, below + 1, CLICK_M_S2 * (place - below))
    return prescribed_outputs(stats, settle, motion, -clicks[:whole, None] * load_direction(scene)[:2])
