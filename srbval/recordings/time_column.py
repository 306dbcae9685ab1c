"""The sampling rate that a time column states: only where it is even within its own digits and its unit is known."""

import re
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.recordings.raw import RawFile, printable

UNITS_S = {
    **dict.fromkeys(("s", "sec", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "µs", "μs", "usec", "microseconds"), 1e-6),
}
# Rates of vibration records: below, no resonance that a fault excites is sampled (the lowest band here begins at
# 500 Hz); above lies acoustic emission. A record at 0.5 to 500 kHz with its times in ms reads as 0.5 to 500 Hz.
PLAUSIBLE_HZ = (500.0, 5e6)
LARGEST = 1e15
UNEVEN = 1e-3  # of a step, beside the rounding of the digits
COARSEST = 0.5  # of a step: digits that hide no missing sample
AGREES = 1e-3  # of a rate
_UNIT = rf"[ _/]({'|'.join(UNITS_S)})|[ _]*[\[(]\s*([^\])]*?)\s*[\])]"
_TIME = re.compile(rf"(?:.*\.)?(?:time_acc|timestamps?|time|zeit|t)(?:{_UNIT})?")


@dataclass(frozen=True, kw_only=True)
class TimeColumn:
    """What times mean: `rates_hz` are the possible rates, the first one settled unless there is a `problem`."""

    name: str
    rates_hz: tuple[float, ...] = ()
    problem: str | None = None
    uneven: bool = False

    def against(self, fs_hz: float) -> str | None:
        """The caution for a record that is read at `fs_hz` [Hz] all the same."""
        if self.uneven:
            return f"{self.problem}; read as even, at {fs_hz:g} Hz"
        if not self.rates_hz or any(abs(rate / fs_hz - 1) < AGREES for rate in self.rates_hz):
            return None
        return f"the times of {self.name} mean {self.rates_hz[0]:.9g} Hz, read at {fs_hz:.9g} Hz"


def is_time(name: str) -> bool:
    """Whether a variable of this name holds times."""
    return _TIME.fullmatch(name.lower()) is not None


def time_column(raw: RawFile, samples: int) -> TimeColumn | None:
    """What the file's times for a signal of so many `samples` say; None without any."""
    arrays = {name: array for name in raw.variables if is_time(name) and (array := raw.array(name)) is not None}
    found = [_read(raw, name) for name, a in arrays.items() if a.size == samples > 2 and a.dtype.kind in "fiu"]
    rates = [column.rates_hz[0] for column in found if not column.problem]
    if rates and max(rates) > min(rates) * (1 + AGREES):
        names = " and ".join(column.name for column in found)
        return TimeColumn(name=names, problem=f"the times of {names} mean different rates", uneven=True)
    return found[0] if found else None


def _read(raw: RawFile, name: str) -> TimeColumn:
    match, shown, times = _TIME.fullmatch(name.lower()), printable(name), np.array(raw.array(name), np.float64).ravel()
    assert match is not None, "only times are read"
    if wrong := np.count_nonzero(~(np.abs(times) < LARGEST)):
        return TimeColumn(name=shown, problem=f"{wrong} of the times of {shown} are not finite numbers", uneven=True)
    unit = raw.units.get(name, match[1] or match[2] or "").strip().lower()
    steps = np.diff(times)
    mean = float(np.mean(steps))
    off = np.abs(times - times[0] - mean * np.arange(times.size)).max()
    if mean <= 0 or (off > UNEVEN * mean and not off <= 1.01 * _rounding(times) < COARSEST * mean):
        return TimeColumn(name=shown, problem=_unevenness(shown, times, steps), uneven=True)
    if unit and unit not in UNITS_S:
        return TimeColumn(name=shown, problem=f"the times of {shown} are in {printable(unit)!r}")
    rate = 1 / (mean * UNITS_S[unit or "s"])
    if unit or PLAUSIBLE_HZ[0] <= rate <= PLAUSIBLE_HZ[1]:
        return TimeColumn(name=shown, rates_hz=(round(rate, 6),))
    if (steps == 1).all():
        return TimeColumn(name=shown, problem=f"{shown} counts the samples: a step of 1 is not a time")
    readings = ", ".join(f"{rate / UNITS_S[u]:.6g} Hz if in {u}" for u in ("s", "ms", "us"))
    rates = (rate, rate * 1e3, rate * 1e6)
    return TimeColumn(name=shown, rates_hz=rates, problem=f"{shown} has a step of {mean:.6g}, {readings}")


def _rounding(times: FloatArray) -> float:
    """The last digit that all times share: of their decimals, or of single precision; 0 in full precision."""
    digit = 0.0
    for decimals in range(12):
        if np.abs(times * 10.0**decimals - np.round(times * 10.0**decimals)).max() < 1e-4:
            digit = 10.0**-decimals
            break
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
