"""A file as a recogniser understood it, before the user's options settle what is still open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import Fault
from srbval.recordings.recording import Origin, ShaftSpeed, SpeedSignal


@dataclass(frozen=True, kw_only=True, eq=False)
class Channel:
    """Samples of one channel as stored, float64, shape [n], their unit and the bearing they belong to.

    `unit` is ``unknown`` where the data set is known to state none, None where the file should have said.
    """

    samples: NDArray[np.float64]
    unit: str | None = None
    bearing: str | None = None
    band_hz: tuple[float, float] | None = None
    state: Fault | None = None
    variable: str | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Reading:
    """What a file holds. `channel` is None where the file leaves the choice open, as is `fs_hz`.

    `speed_problem` says why the speed found cannot be trusted; only one given by the user settles it.
    """

    channels: Mapping[str, Channel]
    origin: Origin = Origin.MEASURED
    dataset: str | None = None
    channel: str | None = None
    axes: tuple[str, str] | None = None
    fs_hz: float | None = None
    speed: ShaftSpeed | None = None
    speed_signal: SpeedSignal | None = None
    speed_problem: str | None = None
    radial_n: float | None = None
    axial_n: float | None = None
    nominal_rpm: float | None = None
    name: str | None = None
    notes: tuple[str, ...] = field(default=())

    @property
    def samples(self) -> int:
        """Samples of the longest channel."""
        return max(len(c.samples) for c in self.channels.values())
