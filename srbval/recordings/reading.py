"""Contents of a file as a recogniser understood them, before the user's settings decide what is still open."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.recordings.raw import printable
from srbval.recordings.recording import Origin, SourceFacts
from srbval.recordings.time_column import TimeColumn

STANDARD_GRAVITY_M_S2 = 9.80665
N_PER_KN = 1e3
UNKNOWN = "unknown"

# spelling in files and options -> unit of the stored samples and factor to it
UNITS: dict[str, tuple[str, float]] = {
    "m/s2": ("m/s2", 1.0),
    "m/s^2": ("m/s2", 1.0),
    "m/s²": ("m/s2", 1.0),
    "m s-2": ("m/s2", 1.0),
    "mm/s2": ("m/s2", 1e-3),
    "g": ("m/s2", STANDARD_GRAVITY_M_S2),
    "mg": ("m/s2", STANDARD_GRAVITY_M_S2 * 1e-3),
    "V": ("V", 1.0),
    "mV": ("V", 1e-3),
    UNKNOWN: (UNKNOWN, 1.0),
}


@dataclass(frozen=True, kw_only=True, eq=False)
class Channel:
    """Samples of one channel as stored, float64, shape [n], their unit and the bearing they belong to.

    `unit` is ``unknown`` where the data set is known to state none, None where the file should have stated one.
    """

    samples: FloatArray
    unit: str | None = None
    bearing: str | None = None
    band_hz: tuple[float, float] | None = None
    state: Fault | None = None
    variable: str | None = None
    cautions: tuple[str, ...] = ()

    @property
    def recording_unit(self) -> str:
        """The unit in which a recording keeps the samples."""
        unit = self.unit or UNKNOWN
        return UNITS.get(unit, (unit, 1.0))[0]

    def converted(self) -> FloatArray:
        """A copy of the samples in `recording_unit`: a view would keep the whole file in memory."""
        factor = UNITS.get(self.unit or UNKNOWN, ("", 1.0))[1]
        return np.array(self.samples) if factor == 1.0 else self.samples * factor


@dataclass(frozen=True, kw_only=True, eq=False)
class Reading(SourceFacts):
    """Contents of a file. `channel` is None where the file leaves the choice open, as is `fs_hz`.

    `speed_problem` says why the speed found cannot be trusted; only one given by the user resolves it. `rate_problem`
    says why the rate is open, `time` what the times of the file say of it.
    """

    channels: Mapping[str, Channel]
    origin: Origin = Origin.MEASURED
    fs_hz: float | None = None
    rate_problem: str | None = None
    time: TimeColumn | None = None
    speed_problem: str | None = None
    name: str | None = None

    def all_cautions(self) -> tuple[str, ...]:
        """Those of the file and of the channel to analyse; of every channel, by its name, where that is open."""
        if self.channel is not None:
            return self.cautions + self.channels[self.channel].cautions
        return self.cautions + tuple(f"{printable(n)}: {c}" for n, ch in self.channels.items() for c in ch.cautions)
