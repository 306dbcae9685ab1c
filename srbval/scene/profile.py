"""Speed and load over time, as tables; between two entries values change linearly."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from srbval.errors import ConfigurationError
from srbval.storage.tables import Checked, quantity

CLOSEST_S = 1e-9  # two entries; nearer, the slope between them may overflow


def _check_table(what: str, time_s: Sequence[float], *columns: Sequence[float]) -> None:
    if len(time_s) < 2 or any(len(column) != len(time_s) for column in columns):
        raise ConfigurationError(f"{what} profile: it needs two or more times and one value for each.")
    if not all(math.isfinite(value) for column in (time_s, *columns) for value in column):
        raise ConfigurationError(f"{what} profile: every time and value must be a finite number.")
    pair = next((pair for pair in itertools.pairwise(time_s) if not pair[1] - pair[0] >= CLOSEST_S), None)
    if pair is not None:
        raise ConfigurationError(f"{what} profile: times must rise by {CLOSEST_S:g} s or more; found {pair}.")


@dataclass(frozen=True, kw_only=True)
class _Profile(Checked):
    """A table over `time_s`, two or more entries that rise; `WHAT` names it in messages."""

    WHAT: ClassVar[str]

    time_s: tuple[float, ...] = quantity("time")

    def check_covers(self, duration_s: float) -> None:
        """Refuse a table that leaves part of the recorded time open."""
        first, last = self.time_s[0], self.time_s[-1]
        if first > 0 or last < duration_s * (1 - 1e-9):
            raise ConfigurationError(
                f"{self.WHAT} profile covers {first:g} to {last:g} s; the run records 0 to {duration_s:g} s: "
                "extend the profile or shorten the duration."
            )

    def _mean(self, values: Sequence[float], duration_s: float) -> float:
        inside = [t for t in self.time_s if 0 < t < duration_s]
        times = np.array([0.0, *inside, duration_s])
        return float(np.trapezoid(np.interp(times, self.time_s, values), times) / duration_s)


@dataclass(frozen=True, kw_only=True)
class SpeedProfile(_Profile):
    """Shaft speed over the recorded time: `time_s` and `speed_rad_s`, two or more entries, never negative."""

    WHAT = "speed"

    speed_rad_s: tuple[float, ...] = quantity("speed", least=0)

    def __post_init__(self) -> None:
        _check_table("speed", self.time_s, self.speed_rad_s)
        super().__post_init__()

    @classmethod
    def sampled(cls, function: Callable[[float], float], duration_s: float, step_s: float = 1e-3) -> SpeedProfile:
        """Table of ``function(time_s)`` [rad/s] every `step_s`, from 0 to `duration_s`."""
        times = np.linspace(0.0, duration_s, max(2, math.ceil(duration_s / step_s) + 1))
        return cls(time_s=tuple(times.tolist()), speed_rad_s=tuple(float(function(t)) for t in times.tolist()))

    def mean(self, duration_s: float) -> float:
        """Mean speed from 0 to `duration_s` [rad/s]."""
        return self._mean(self.speed_rad_s, duration_s)


@dataclass(frozen=True, kw_only=True)
class LoadProfile(_Profile):
    """Radial and axial load over the recorded time; the direction stays that of the constant load."""

    WHAT = "load"

    radial_n: tuple[float, ...] = quantity("force", least=0)
    axial_n: tuple[float, ...] = quantity("force")

    def __post_init__(self) -> None:
        _check_table("load", self.time_s, self.radial_n, self.axial_n)
        super().__post_init__()

    def mean_radial_n(self, duration_s: float) -> float:
        """Mean radial load from 0 to `duration_s` [N]."""
        return self._mean(self.radial_n, duration_s)
