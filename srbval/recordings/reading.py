"""Contents of a file as a recogniser understood them, before the user's settings decide what is still open."""

import math
import re
import unicodedata
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
# units of a shaft speed, as `known_unit` has them, and the factor to Hz
SPEED_HZ = {"rpm": 1 / 60, "Hz": 1.0, "rad/s": 1 / (2 * math.pi)}
# what files write for them, without blanks, dots, carets and parentheses
SPELLINGS = {
    **dict.fromkeys(("ms-2", "m/s/s", "m/sec2", "mps2"), "m/s2"),
    **dict.fromkeys(("mms-2", "mm/s/s", "mm/sec2"), "mm/s2"),
    **dict.fromkeys(("G", "gn", "g0"), "g"),
    **dict.fromkeys(("Volt", "Volts", "volt", "volts"), "V"),
    **dict.fromkeys(("mVolt", "mvolt", "millivolt"), "mV"),
    **dict.fromkeys(("1/min", "r/min", "rev/min", "U/min", "min-1", "RPM"), "rpm"),
}
_IN_NAME = re.compile(r"(.*?\S)\s*(?:[\[(]\s*([^\[\]]*?)\s*[\])]|\s(?:in|/)\s+(\S+))")


def known_unit(text: str) -> str | None:
    """The unit of `UNITS` or `SPEED_HZ` that a text out of a file means, None for any other."""
    plain = re.sub(r"[\s^*·().]", "", unicodedata.normalize("NFKC", text)).replace("\u2212", "-")
    plain = SPELLINGS.get(plain, plain)
    return plain if plain in UNITS or plain in SPEED_HZ else None


def split_unit(name: str) -> tuple[str, str | None]:
    """The name of a column and what stands there for a unit: ``acc DE [g]``, ``a / (m/s²)``, ``acc in g``."""
    found = _IN_NAME.fullmatch(name)
    return (found[1], found[2] or found[3] or None) if found else (name, None)


@dataclass(frozen=True, kw_only=True, eq=False)
class Channel:
    """Samples of one channel as stored, float64, shape [n], their unit and the bearing they belong to.

    `unit` is ``unknown`` where the data set is known to state none, None where the file should have stated one; the
    samples times `factor` are in it. `fs_hz` is the channel's own sampling rate, where the file states one.
    """

    samples: FloatArray
    unit: str | None = None
    bearing: str | None = None
    band_hz: tuple[float, float] | None = None
    state: Fault | None = None
    variable: str | None = None
    cautions: tuple[str, ...] = ()
    factor: float = 1.0
    fs_hz: float | None = None

    @property
    def recording_unit(self) -> str:
        """The unit in which a recording keeps the samples."""
        unit = self.unit or UNKNOWN
        return UNITS.get(unit, (unit, 1.0))[0]

    def converted(self) -> FloatArray:
        """A copy of the samples in `recording_unit`: a view would keep the whole file in memory."""
        factor = self.factor * UNITS.get(self.unit or UNKNOWN, ("", 1.0))[1]
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

    @property
    def vibrations(self) -> tuple[str, ...]:
        """Names of the channels that may be analysed: those that are not a shaft speed."""
        return tuple(name for name, channel in self.channels.items() if channel.unit not in SPEED_HZ)

    def all_cautions(self) -> tuple[str, ...]:
        """Those of the file and of the channel to analyse; of every channel, by its name, where that is open."""
        if self.channel is not None:
            return self.cautions + self.channels[self.channel].cautions
        return self.cautions + tuple(f"{printable(n)}: {c}" for n, ch in self.channels.items() for c in ch.cautions)
