"""Contents of a file as a recogniser understood them, before the user's settings; units and time columns."""

import math
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.recordings.raw import RawFile, printable
from srbval.recordings.recording import Origin, SourceFacts
from srbval.scene.parts import STANDARD_GRAVITY_M_S2

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
    "m/s": ("m/s", 1.0),
    "mm/s": ("m/s", 1e-3),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "V": ("V", 1.0),
    "mV": ("V", 1e-3),
    UNKNOWN: (UNKNOWN, 1.0),
}
# order of the derivative that makes an acceleration of a unit
DERIVATIVES = {"m/s": 1, "m": 2}
# units of a speed and an angle of rotation, as `known_unit` has them, and the factors to Hz and to revolutions
SPEED_HZ = {"rpm": 1 / 60, "Hz": 1.0, "rad/s": 1 / (2 * math.pi)}
REVOLUTIONS = {"rad": 1 / (2 * math.pi), "deg": 1 / 360, "rev": 1.0}
# what files write for them, without blanks, dots, carets and parentheses
SPELLINGS = {
    **dict.fromkeys(("ms-2", "m/s/s", "m/sec2", "mps2"), "m/s2"),
    **dict.fromkeys(("mms-2", "mm/s/s", "mm/sec2"), "mm/s2"),
    **dict.fromkeys(("G", "gn", "g0"), "g"),
    **dict.fromkeys(("Volt", "Volts", "volt", "volts"), "V"),
    **dict.fromkeys(("mVolt", "mvolt", "millivolt"), "mV"),
    **dict.fromkeys(("m/sec", "mps"), "m/s"),
    "mm/sec": "mm/s",
    "\u03bcm": "um",
    **dict.fromkeys(("\u00b0", "degree", "degrees"), "deg"),
    **dict.fromkeys(("1/min", "r/min", "rev/min", "U/min", "min-1", "RPM"), "rpm"),
}
_IN_NAME = re.compile(r"(.*?\S)\s*(?:[\[(]\s*([^\[\]]*?)\s*[\])]|\s(?:in|/)\s+(\S+))")
TIME_UNITS_S = {
    **dict.fromkeys(("s", "sec", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "µs", "μs", "usec", "microseconds"), 1e-6),
}
# Rates of vibration records: below, no resonance that a fault excites is sampled (the lowest band here begins at
# 500 Hz); above lies acoustic emission. A record at 0.5 to 500 kHz with its times in ms reads as 0.5 to 500 Hz.
PLAUSIBLE_HZ = (500.0, 5e6)
LARGEST_TIME = 1e15
UNEVEN = 1e-3  # of a step, beside the rounding of the digits
COARSEST = 0.5  # of a step: digits that hide no missing sample
SAME_RATE = 1e-3  # of a rate
_TIME_UNIT = rf"[ _/]({'|'.join(TIME_UNITS_S)})|[ _]*[\[(]\s*([^\])]*?)\s*[\])]"
_TIME = re.compile(rf"(?:.*\.)?(?:time_acc|timestamps?|time|zeit|tout|t)(?:{_TIME_UNIT})?")


def scaled(value: float | str | None, factor: float) -> float | None:
    """`value` times `factor`, None without a value."""
    return None if value is None else float(value) * factor


def known_unit(text: str) -> str | None:
    """The unit of `UNITS`, `SPEED_HZ` or `REVOLUTIONS` that a text out of a file means, None for any other."""
    plain = re.sub(r"[\s^*·().]", "", unicodedata.normalize("NFKC", text)).replace("\u2212", "-")
    plain = SPELLINGS.get(plain, plain)
    return plain if any(plain in known for known in (UNITS, SPEED_HZ, REVOLUTIONS)) else None


def split_unit(name: str) -> tuple[str, str | None]:
    """Split a column's title into its name and unit: ``acc DE [g]``, ``a / (m/s²)``, ``acc in g``."""
    found = _IN_NAME.fullmatch(name)
    return (found[1], found[2] or found[3] or None) if found else (name, None)


@dataclass(frozen=True, kw_only=True, eq=False)
class TimeColumn:
    """Meaning of times: `rates_hz` are the possible rates, the first one settled unless there is a `problem`.

    `times_s` [n] are uneven times that never fall and whose unit is known, so that the signal can be resampled.
    """

    name: str
    rates_hz: tuple[float, ...] = ()
    problem: str | None = None
    uneven: bool = False
    times_s: FloatArray | None = None

    def against(self, fs_hz: float) -> str | None:
        """The caution for a record that is read at `fs_hz` [Hz] all the same."""
        if self.uneven:
            return f"{self.problem}; read as even, at {fs_hz:g} Hz"
        if not self.rates_hz or any(abs(rate / fs_hz - 1) < SAME_RATE for rate in self.rates_hz):
            return None
        return f"the times of {self.name} mean {self.rates_hz[0]:.9g} Hz, read at {fs_hz:.9g} Hz"


def is_time(name: str) -> bool:
    """True if a variable of this name contains times."""
    return _TIME.fullmatch(name.lower()) is not None


def time_column(raw: RawFile, samples: int) -> TimeColumn | None:
    """Meaning of the file's times for a signal of so many `samples`; None without any."""
    arrays = {name: array for name in raw.variables if is_time(name) and (array := raw.array(name)) is not None}
    found = [_times_of(raw, name) for name, a in arrays.items() if a.size == samples > 2 and a.dtype.kind in "fiu"]
    rates = [column.rates_hz[0] for column in found if not column.problem]
    if rates and max(rates) > min(rates) * (1 + SAME_RATE):
        names = " and ".join(column.name for column in found)
        return TimeColumn(name=names, rates_hz=tuple(rates), problem=f"the times of {names} mean different rates")
    return found[0] if found else None


def _times_of(raw: RawFile, name: str) -> TimeColumn:
    match, shown = _TIME.fullmatch(name.lower()), printable(name)
    assert match, "only times are read"
    with np.errstate(invalid="ignore"):  # damaged numbers, which are counted below
        times = np.array(raw.array(name), np.float64).ravel()
    if wrong := np.count_nonzero(~(np.abs(times) < LARGEST_TIME)):
        return TimeColumn(name=shown, problem=f"{wrong} of the times of {shown} are not finite numbers", uneven=True)
    unit = raw.units.get(name, match[1] or match[2] or "").strip().lower()
    steps = np.diff(times)
    mean = float(np.mean(steps))
    off = np.abs(times - times[0] - mean * np.arange(times.size)).max()
    rate = 1 / (mean * TIME_UNITS_S.get(unit or "s", 1.0)) if mean > 0 else 0.0
    is_known = unit in TIME_UNITS_S or (not unit and PLAUSIBLE_HZ[0] <= rate <= PLAUSIBLE_HZ[1])
    if mean <= 0 or (off > UNEVEN * mean and not off <= 1.01 * _rounding(times) < COARSEST * mean):
        usable = is_known and steps.min() >= 0 and np.median(steps) > 0
        times_s = times * TIME_UNITS_S[unit or "s"] if usable else None
        return TimeColumn(name=shown, problem=_unevenness(shown, times, steps), uneven=True, times_s=times_s)
    if unit and unit not in TIME_UNITS_S:
        return TimeColumn(name=shown, problem=f"the times of {shown} are in {printable(unit)!r}")
    if is_known:
        return TimeColumn(name=shown, rates_hz=(round(rate, 6),))
    if (steps == 1).all():
        return TimeColumn(name=shown, problem=f"{shown} counts the samples: a step of 1 is not a time")
    readings = ", ".join(f"{rate / TIME_UNITS_S[u]:.6g} Hz if in {u}" for u in ("s", "ms", "us"))
    rates = (rate, rate * 1e3, rate * 1e6)
    return TimeColumn(name=shown, rates_hz=rates, problem=f"{shown} has a step of {mean:.6g}, {readings}")


def _rounding(times: FloatArray) -> float:
    """The last digit that all times share: of their decimals, or of single precision; 0 in full precision."""
    scaled = ((10.0**-decimals, times * 10.0**decimals) for decimals in range(12))
    digit = next((step for step, values in scaled if np.abs(values - np.round(values)).max() < 1e-4), 0.0)
    single = (times.astype(np.float32) == times).all()
    return max(digit, float(np.spacing(np.float32(np.abs(times).max()))) if single else 0.0)


def _unevenness(name: str, times: FloatArray, steps: FloatArray) -> str:
    usual = float(np.median(steps))
    if not usual > 0:
        return f"the times of {name} do not run forwards: {int((steps <= 0).sum())} of {steps.size} steps"
    off = np.abs(steps - usual)
    which = {"backwards": steps < 0, "repeated": steps == 0, "gaps": steps > 1.5 * usual}
    which["otherwise uneven"] = (off > UNEVEN * usual + _rounding(times)) & (steps > 0) & ~which["gaps"]
    said = ", ".join(f"{wrong.sum()} {what}" for what, wrong in which.items() if wrong.any()) or "a slow drift"
    worst = 100 * off.max() / usual
    return f"the times of {name} are uneven: {said} of {steps.size} steps, the worst off by {worst:.3g} %"


@dataclass(frozen=True, kw_only=True, eq=False)
class Channel:
    """Samples of one channel as stored, float64, [n]; times `factor` they are in its `unit`.

    `unit` is ``unknown`` if the data set is known to state none, None if the file should have stated one. With
    `whole_numbers` the samples are a converter's, of an unknown scale.
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
    whole_numbers: bool = False

    @property
    def scale_missing(self) -> bool:
        """True if a unit is stated, but not how many of it a sample of 1 is."""
        return self.whole_numbers and self.unit not in (None, UNKNOWN)

    @property
    def rotates(self) -> bool:
        """True for the speed or the angle of a rotation, which is no vibration."""
        return self.unit in SPEED_HZ or self.unit in REVOLUTIONS

    @property
    def recording_unit(self) -> str:
        """The unit in which a recording keeps the samples."""
        unit = UNKNOWN if self.scale_missing else self.unit or UNKNOWN
        return UNITS.get(unit, (unit, 1.0))[0]

    def converted(self) -> FloatArray:
        """A copy of the samples in `recording_unit`: a view would keep the whole file in memory."""
        factor = 1.0 if self.scale_missing else self.factor * UNITS.get(self.unit or UNKNOWN, ("", 1.0))[1]
        return np.array(self.samples) if factor == 1.0 else self.samples * factor


@dataclass(frozen=True, kw_only=True, eq=False)
class Reading(SourceFacts):
    """Contents of a file; `channel` and `fs_hz` are None if the file leaves them open, the latter for `rate_problem`.

    `times` are the file's times by the length of the signals that they belong to. `speed_problem` is the reason not to
    trust the speed in the file; only a speed from the user resolves it.
    """

    channels: Mapping[str, Channel]
    origin: Origin = Origin.MEASURED
    fs_hz: float | None = None
    rate_problem: str | None = None
    times: Mapping[int, TimeColumn] = field(default_factory=dict)
    speed_problem: str | None = None
    name: str | None = None

    @property
    def vibrations(self) -> tuple[str, ...]:
        """Names of the channels that may be analysed: all that are no rotation."""
        return tuple(name for name, channel in self.channels.items() if not channel.rotates)

    @property
    def main(self) -> Channel:
        """The channel to analyse, or the first one if the choice is open."""
        names = self.axes or self.vibrations or tuple(self.channels)
        return self.channels[names[0] if self.channel is None else self.channel]

    @property
    def time(self) -> TimeColumn | None:
        """Times of the channel to analyse."""
        return self.times.get(self.main.samples.size)

    def all_cautions(self) -> tuple[str, ...]:
        """Cautions of the file and of the channel to analyse; of every channel, by its name, if the choice is open."""
        if self.channel is not None:
            return self.cautions + self.channels[self.channel].cautions
        return self.cautions + tuple(f"{printable(n)}: {c}" for n, ch in self.channels.items() for c in ch.cautions)
