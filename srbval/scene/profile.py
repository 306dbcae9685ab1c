"""Speed and load over time, as tables; between two entries values change linearly."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from srbval.config.strict import quantity
from srbval.errors import ConfigurationError


def _check_table(what: str, time_s: Sequence[float], *columns: Sequence[float]) -> None:
    if len(time_s) < 2 or any(len(column) != len(time_s) for column in columns):
        raise ConfigurationError(f"{what} profile: it needs two or more times and one value for each.")
    if not all(math.isfinite(value) for column in (time_s, *columns) for value in column):
        raise ConfigurationError(f"{what} profile: every time and value must be a finite number.")
    if any(later <= earlier for earlier, later in itertools.pairwise(time_s)):
        raise ConfigurationError(f"{what} profile: times must rise; found {list(time_s)}.")


def _check_covers(what: str, time_s: Sequence[float], duration_s: float) -> None:
    if time_s[0] > 0 or time_s[-1] < duration_s * (1 - 1e-9):
        raise ConfigurationError(
            f"{what} profile covers {time_s[0]:g} to {time_s[-1]:g} s; the run records 0 to {duration_s:g} s: "
            "extend the profile or shorten the duration."
        )


def _mean(time_s: Sequence[float], values: Sequence[float], duration_s: float) -> float:
    """Mean of a table from 0 to `duration_s`."""
    inside = [t for t in time_s if 0 < t < duration_s]
    times = np.array([0.0, *inside, duration_s])
    return float(np.trapezoid(np.interp(times, time_s, values), times) / duration_s)


@dataclass(frozen=True, kw_only=True)
class SpeedProfile:
    """Shaft speed over the recorded time: `time_s` and `speed_rad_s`, two or more entries, never negative."""

    time_s: tuple[float, ...] = quantity("time")
    speed_rad_s: tuple[float, ...] = quantity("speed")

    def __post_init__(self) -> None:
        _check_table("speed", self.time_s, self.speed_rad_s)
        if min(self.speed_rad_s) < 0:
            raise ConfigurationError(f"speed profile: {min(self.speed_rad_s)} rad/s must not be negative.")

    @classmethod
    def sampled(cls, function: Callable[[float], float], duration_s: float, step_s: float = 1e-3) -> SpeedProfile:
        """Table of ``function(time_s)`` [rad/s] every `step_s`, from 0 to `duration_s`."""
        times = np.linspace(0.0, duration_s, max(2, math.ceil(duration_s / step_s) + 1))
        return cls(time_s=tuple(times.tolist()), speed_rad_s=tuple(float(function(t)) for t in times.tolist()))

    def check_covers(self, duration_s: float) -> None:
        """Refuse a table that leaves part of the recorded time open."""
        _check_covers("speed", self.time_s, duration_s)

    def mean(self, duration_s: float) -> float:
        """Mean speed from 0 to `duration_s` [rad/s]."""
        return _mean(self.time_s, self.speed_rad_s, duration_s)


@dataclass(frozen=True, kw_only=True)
class LoadProfile:
    """Radial and axial load over the recorded time; the direction stays that of the constant load."""

    time_s: tuple[float, ...] = quantity("time")
    radial_n: tuple[float, ...] = quantity("force")
    axial_n: tuple[float, ...] = quantity("force")

    def __post_init__(self) -> None:
        _check_table("load", self.time_s, self.radial_n, self.axial_n)
        if min(self.radial_n) < 0:
            raise ConfigurationError(f"load profile: radial load {min(self.radial_n)} N must not be negative.")

    def check_covers(self, duration_s: float) -> None:
        """Refuse a table that leaves part of the recorded time open."""
        _check_covers("load", self.time_s, duration_s)

    def mean_radial_n(self, duration_s: float) -> float:
        """Mean radial load from 0 to `duration_s` [N]."""
        return _mean(self.time_s, self.radial_n, duration_s)
