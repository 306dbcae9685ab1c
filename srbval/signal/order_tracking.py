"""Order tracking: resampling of a record from even steps of time to even steps of shaft angle."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy.linalg

from srbval.arrays import FloatArray
from srbval.errors import DataError

DRIFT_PARTS = 8  # parts of the record whose mean speeds give its drift; shorter parts contain the tachometer's noise


@dataclass(frozen=True, kw_only=True, eq=False)
class ShaftAngle:
    """Angle of the shaft over time: `turns` [k] at `time_s` [k] from the record's start, about one knot per turn.

    Between the knots it is a cubic spline, which follows a ramp but not the errors of a tachometer within a turn.
    """

    time_s: FloatArray
    turns: FloatArray

    @classmethod
    def from_speed(cls, speed_hz: FloatArray, rate_hz: float) -> Self:
        """Integrate an evenly sampled speed signal [Hz] of either sign; `DataError` for a stop or under three turns."""
        speed = speed_hz if float(np.mean(speed_hz)) >= 0 else -speed_hz
        turned = np.concatenate(([0.0], np.cumsum((speed[1:] + speed[:-1]) / (2 * rate_hz))))
        knots = max(2, math.floor(turned[-1]) + 1)
        index = np.linspace(0, speed.size - 1, knots)
        turns = np.interp(index, np.arange(speed.size), turned)
        if knots < 4 or not np.all(np.diff(turns) > 0):
            raise DataError(
                f"the speed signal covers {turned[-1]:.3g} turns, and its lowest speed is {speed.min():.3g} Hz: order "
                "tracking needs three turns and a shaft that never stops; cut the record or give a mean --rpm."
            )
        return cls(time_s=index / rate_hz, turns=turns)

    def drift_bins(self, order: float) -> float:
        """Shift [bins] of a line of this order between the slowest and fastest of `DRIFT_PARTS` parts of a record."""
        marks = np.linspace(0, self.time_s[-1], DRIFT_PARTS + 1)
        means = np.diff(np.interp(marks, self.time_s, self.turns)) / np.diff(marks)
        return float((means.max() - means.min()) * order * self.time_s[-1])

    def turns_at(self, at_s: FloatArray) -> FloatArray:
        """Turns of the shaft at rising times [n]; outside the speed signal, the speed at its nearer end is used."""
        return spline(*_extended(self.time_s, self.turns, at_s[0], at_s[-1]), at_s)

    def resample(self, samples: FloatArray, fs_hz: float, start_s: float, mean_hz: float) -> FloatArray:
        """Resample `samples` [n], the first at `start_s`, at even shaft angles, ``fs_hz / mean_hz`` per turn.

        If the result is treated as a record at `fs_hz`, the shaft turns at exactly `mean_hz`. The error of the cubic
        splines is 1e-3 for lines below a fifth of `fs_hz`, 1e-4 below a tenth. Resample an envelope rather than a
        vibration signal: the frequencies of resonances do not follow the shaft speed.
        """
        at_s = start_s + np.arange(samples.size) / fs_hz
        knots_s, turns = _extended(self.time_s, self.turns, at_s[0], at_s[-1])
        first, last = spline(knots_s, turns, at_s[[0, -1]])
        count = math.floor((last - first) * fs_hz / mean_hz) + 1
        wanted = first + np.arange(count) * (mean_hz / fs_hz)
        instants_s = spline(turns, knots_s, wanted)
        return spline(at_s, samples, np.clip(instants_s, at_s[0], at_s[-1]))


def _extended(time_s: FloatArray, turns: FloatArray, first_s: float, last_s: float) -> tuple[FloatArray, FloatArray]:
    """Extend the angle of a shaft to the times of a record: a knot at each missing end, at the speed of that end."""
    rate = np.diff(turns) / np.diff(time_s)
    if first_s < time_s[0]:
        turns = np.concatenate(([turns[0] - rate[0] * (time_s[0] - first_s)], turns))
        time_s = np.concatenate(([first_s], time_s))
    if last_s > time_s[-1]:
        turns = np.concatenate((turns, [turns[-1] + rate[-1] * (last_s - time_s[-1])]))
        time_s = np.concatenate((time_s, [last_s]))
    return time_s, turns


def spline(knots: FloatArray, values: FloatArray, at: FloatArray) -> FloatArray:
    """Values at the points `at` of the cubic spline through `values` [n] at rising `knots` [n > 3], not-a-knot ends."""
    step = np.diff(knots)  # as scipy.interpolate.CubicSpline, which takes a quarter of a second to load
    rise, end = np.diff(values) / step, (knots[2] - knots[0], knots[-1] - knots[-3])
    bands, right = np.zeros((3, knots.size)), np.empty(knots.size)  # of the equations for the slopes at the knots
    bands[0, 1], bands[0, 2:] = end[0], step[:-1]
    bands[1, 0], bands[1, 1:-1], bands[1, -1] = step[1], 2 * (step[:-1] + step[1:]), step[-2]
    bands[2, :-2], bands[2, -2] = step[1:], end[1]
    right[0] = ((step[0] + 2 * end[0]) * step[1] * rise[0] + step[0] ** 2 * rise[1]) / end[0]
    right[1:-1] = 3 * (step[1:] * rise[:-1] + step[:-1] * rise[1:])
    right[-1] = (step[-1] ** 2 * rise[-2] + (2 * end[1] + step[-1]) * step[-2] * rise[-1]) / end[1]
    slope = scipy.linalg.solve_banded((1, 1), bands, right, overwrite_ab=True, overwrite_b=True, check_finite=False)
    bend = (slope[:-1] + slope[1:] - 2 * rise) / step
    part = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, step.size - 1)
    past = at - knots[part]
    square = past * past
    cubic = (bend / step)[part] * (square * past)
    return np.asarray(values[part] + slope[part] * past + ((rise - slope[:-1]) / step - bend)[part] * square + cubic)
