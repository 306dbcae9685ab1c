"""Signals that a model from outside returns: accepted forms, checks, and conversion to the columns of a run."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.models import outputs as col
from srbval.models.run import RunStatus
from srbval.scene import SENSOR_AXIS, Scene

UNEVEN = 0.02  # largest deviation of a time from an even grid, in steps
ROUNDED, MOST_ROUNDED = 1e-6, 0.25  # further deviation of rounded times, in the largest time, and its limit in steps
RATE_DEVIATION = 1e-5  # relative; a grid of one point too many in 1 s is 5e-5 off
VECTORS = {"acceleration_m_s2": "acceleration_{}_m_s2", "ring_displacement_m": "ring_displacement_{}_m"}
FIRST_COLUMN = {
    "acceleration_m_s2": col.ACCELERATION_X,
    "ring_displacement_m": col.DISPLACEMENT_X,
    "cage_ratio": col.CAGE_SPEED,
    "drive_power_w": col.MEAN_DRIVE_POWER,
}


@dataclass(frozen=True, eq=False)
class SimulatedSignals:
    """Signals of a model from outside, as arrays or objects that NumPy converts to arrays.

    `time_s`, [n], has constant steps. Its rate is the scene's output rate or a multiple of it; the signals are then
    averaged over output intervals. The last `Scene.duration_s` is recorded; earlier times are settling.
    `acceleration_m_s2` of the outer ring: [n] along the sensor's axis, or [n, 2] or [n, 3] along x, y, z. Optional:
    `cage_ratio` (cage over shaft speed) and `drive_power_w`, numbers or [n]; `cage_angle_rad`, [n], instead of
    `cage_ratio`; `ring_displacement_m`, shaped like the acceleration; `wall_s`, the computing time that the model
    measured.
    """

    time_s: Any
    acceleration_m_s2: Any
    cage_ratio: Any = None
    cage_angle_rad: Any = None
    ring_displacement_m: Any = None
    drive_power_w: Any = None
    wall_s: float | None = None


class UnusableSignalsError(Exception):
    """Signals cannot be converted to a run; the arguments are a `RunStatus` and the reason."""


def signals_of(returned: Any) -> SimulatedSignals:
    """Convert the value that a model returned: time and acceleration, `SimulatedSignals`, or a mapping of its fields.

    A mapping, table or data set may have an entry for each axis, ``acceleration_x_m_s2``, and ``time`` for ``time_s``.
    """
    if isinstance(returned, SimulatedSignals):
        return returned
    if isinstance(returned, tuple) and len(returned) == 2:
        return SimulatedSignals(*returned)
    if not hasattr(returned, "keys"):
        raise _unusable(f"it returned {type(returned).__name__}; return (time_s, acceleration_m_s2)")
    found = {one.name: returned[one.name] for one in fields(SimulatedSignals) if one.name in returned}
    for name, of_axis in VECTORS.items():
        axes = "".join(axis for axis in "xyz" if of_axis.format(axis) in returned)
        if axes not in ("", "xy", "xyz"):
            needed = f"x and y are needed, or {name} along the sensor's axis"
            raise _unusable(f"it returned only the axes {axes} of {name}; {needed}")
        if axes:
            found[name] = np.stack([np.asarray(returned[of_axis.format(axis)]) for axis in axes], axis=1)
    found |= {"time_s": returned["time"]} if "time" in returned else {}
    if not {"time_s", "acceleration_m_s2"} <= set(found):
        raise _unusable(f"it returned {', '.join(map(str, returned))}; time_s and acceleration_m_s2 are needed")
    return SimulatedSignals(**found)


def recorded_columns(signals: SimulatedSignals, scene: Scene) -> FloatArray:
    """Convert signals to the array `Outputs.out`, [samples, COLUMN_COUNT], at the output rate; NaN: not given.

    Raises `UnusableSignalsError` if signals are not finite, uneven, too short, of a wrong shape or rate, or constant
    although the bearing has a defect.
    """
    time_s = _finite_array("time_s", signals.time_s, signals.time_s)
    rate = _even_rate(time_s)
    per = max(1, round(rate / scene.output_rate_hz))
    if abs(rate / scene.output_rate_hz / per - 1) > RATE_DEVIATION:
        raise _unusable(
            f"its rate of {rate:.8g} Hz is no multiple of the scene's output rate, {scene.output_rate_hz:.8g} Hz; "
            "return the times np.arange(n) / scene.output_rate_hz"
        )
    if len(time_s) < scene.samples * per:
        asked = f"the scene records {scene.duration_s:g} s, after {scene.settle_s:g} s of settling"
        raise _unusable(f"it returned {len(time_s) / rate:.6g} s; {asked}")
    out = np.full((scene.samples, col.COLUMN_COUNT), np.nan)
    for first, values in _signal_columns(signals, scene, time_s):
        means = values[len(values) - scene.samples * per :].reshape(scene.samples, per, -1).mean(axis=1)
        out[:, first : first + means.shape[1]] = means
    if scene.defects and not np.ptp(out[:, : col.ACCELERATION_Z], axis=0).any():
        raise UnusableSignalsError(RunStatus.SILENT, "its acceleration is constant although the bearing has a defect")
    return out


def _signal_columns(signals: SimulatedSignals, scene: Scene, time_s: FloatArray) -> Iterator[tuple[int, FloatArray]]:
    """Yield the first output column and the values, [n, columns], of each signal that is given."""
    given = {name: value for name, value in vars(signals).items() if value is not None}
    if "cage_ratio" not in given and "cage_angle_rad" in given:
        angle = np.unwrap(_finite_array("cage_angle_rad", given["cage_angle_rad"], time_s))
        given["cage_ratio"] = np.gradient(angle, time_s) / scene.mean_shaft_rad_s
    for name, first in FIRST_COLUMN.items():
        if name in given:
            values = _finite_array(name, given[name], time_s)
            values = values if values.ndim else np.full(time_s.shape, float(values))
            columns = values if values.ndim > 1 else values[:, None]
            if values.ndim > 2 or len(values) != len(time_s) or columns.shape[1] > (3 if name in VECTORS else 1):
                raise _unusable(f"{name} has the shape {values.shape}, time_s has {len(time_s)} values")
            if name in VECTORS and columns.shape[1] == 1:
                columns = columns * SENSOR_AXIS
            yield first, columns * (scene.mean_shaft_rad_s if name == "cage_ratio" else 1.0)


def _even_rate(time_s: FloatArray) -> float:
    """Sampling rate of times with constant steps [Hz]; raises `UnusableSignalsError` for other times."""
    if time_s.ndim != 1 or len(time_s) < 2 or not time_s[-1] > time_s[0]:
        raise _unusable(f"time_s, of the shape {time_s.shape}, is not a rising series of times")
    rate = (len(time_s) - 1) / float(time_s[-1] - time_s[0])
    uneven = UNEVEN + min(ROUNDED * rate * float(np.abs(time_s).max()), MOST_ROUNDED)
    if np.abs((time_s - time_s[0]) * rate - np.arange(len(time_s))).max() > uneven:
        steps = np.diff(time_s)
        raise _unusable(
            f"its times are uneven, in steps of {steps.min():.3g} to {steps.max():.3g} s; return even ones, from "
            "solve_ivp with t_eval = np.arange(n) / scene.output_rate_hz"
        )
    return rate


def _finite_array(name: str, values: Any, time_s: Any) -> FloatArray:
    """Convert values to an array of finite numbers; raises `UnusableSignalsError` if this is not possible."""
    try:
        found = np.asarray(values, np.float64)
    except (TypeError, ValueError):
        raise _unusable(f"{name} of the type {type(values).__name__} is no array of numbers") from None
    wrong = ~np.isfinite(found)
    if wrong.any():
        first = int(np.argwhere(wrong)[0][0]) if found.ndim else 0
        at = f", the first at {time_s[first]:.6g} s" if first < len(time_s) else ""
        raise UnusableSignalsError(RunStatus.NOT_FINITE, f"{wrong.sum()} values of {name} are not finite{at}")
    return found


def _unusable(reason: str) -> UnusableSignalsError:
    return UnusableSignalsError(RunStatus.UNUSABLE_SIGNALS, reason)
