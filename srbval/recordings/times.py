"""Times of samples: columns of times, time stamps, counters, stated rates and steps, and missing samples."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.recordings.raw import RawFile, blocks_of, printable
from srbval.recordings.units import PATTERNS, rows_by_spelling, split_unit

TIME_UNITS_S = {word: float(row["factor"]) for word, row in rows_by_spelling("time").items()}
RATE_UNITS_HZ = {word: float(row["factor"]) for word, row in rows_by_spelling("rate").items()}
# Rates of vibration records. Lower rates sample no resonance that a fault excites (the lowest band here begins at
# 500 Hz), or mean times in ms; higher rates belong to acoustic emission.
PLAUSIBLE_HZ = (500.0, 5e6)
EPOCH_S = 9e8, 4e9  # seconds since 1970 in the years 1998 to 2096
DAYS = 2e4, 8e4  # since 1900, as spreadsheets count them, in the years 1954 to 2119
LARGEST_TIME = 1e19
MAX_STEP_DEVIATION = 1e-3  # of a step, in addition to the rounding of the digits
COARSEST = 0.5  # largest last digit, as a share of a step; coarser digits may hide a missing sample
RATE_MARGIN = 1e-3  # largest relative difference of two equal rates
MOST_MISSING = 0.5  # of the samples, between the first and the last
MOST_GAPS = 0.1  # of the steps; more gaps mean the steps of a solver
COUNTER_BITS = (8, 16, 32)  # sizes of counters that overflow
_UNITS = "|".join(map(re.escape, sorted(TIME_UNITS_S, key=len, reverse=True)))
_WITH_UNIT = rf"(?:(?: in |[ _/,.-]+)({_UNITS})|[ _/]*[\[(]\s*([^\])]*?)\s*[\])])?"
_TIME = re.compile(rf"(?:.*\.)?(?:(?:{PATTERNS['time']}){_WITH_UNIT}|({_UNITS}))")
_RATE, _STEP = (re.compile(rf"(?:nicm|wf)?{PATTERNS[name]}") for name in ("rate", "step"))
_DAYS = ("%Y-%m-%d", "%d.%m.%Y", "%m/%d/%Y", "%d/%m/%Y", "%Y/%m/%d", "%d-%b-%Y", "%d-%m-%Y", "%d.%m.%y", "%m/%d/%y")
STAMPS = ("ISO8601", *(f"{day} {clock}" for day in _DAYS for clock in ("%H:%M:%S.%f", "%I:%M:%S.%f%p")))
_NUMBER_AND_UNIT = re.compile(r"\s*([-+]?(?:\d+[.,]?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?![\d.,])\s*(\S*)\s*")


@dataclass(frozen=True, kw_only=True, eq=False)
class TimeColumn:
    """Sampling rate and gaps found in a column of times.

    `rates_hz` contains the sampling rate or, if a `problem` is stated, all rates that the times may mean. `times_s` [n]
    are uneven, never falling times in a known unit, from which the signal can be resampled. `places` [n] are the
    indices of the samples on an even grid if some samples are missing; a column that counts samples has `places` but no
    rate. `likely_hz` is the mean rate of times that are too coarse to state a rate.
    """

    name: str
    rates_hz: tuple[float, ...] = ()
    problem: str | None = None
    uneven: bool = False
    times_s: FloatArray | None = None
    places: NDArray[np.int64] | None = None
    likely_hz: float | None = None

    def rate_caution(self, fs_hz: float) -> str | None:
        """Caution if the record is read at a rate `fs_hz` that contradicts its times, else None."""
        if self.uneven:
            return f"{self.problem}; read as even, at {fs_hz:g} Hz"
        if not self.rates_hz or any(abs(rate / fs_hz - 1) < RATE_MARGIN for rate in self.rates_hz):
            return None
        return f"the times of {self.name} mean {self.rates_hz[0]:.9g} Hz, read at {fs_hz:.9g} Hz"

    def missing_caution(self) -> str:
        """Caution about samples that are missing and were interpolated."""
        assert self.places is not None
        gaps, count = int((np.diff(self.places) > 1).sum()), int(self.places[-1]) + 1
        missing = count - self.places.size
        share = f"{missing} of {count} samples ({100 * missing / count:.2g} %)"
        return f"{gaps} gaps by {self.name}: {share} are missing and filled with straight lines"


def is_time(name: str, unit: str | None = None, values: NDArray[np.generic] | None = None) -> bool:
    """True if a variable contains times, by its name, or by a unit of time if its `values` rise."""
    if _TIME.fullmatch(name.lower().strip()):
        return True
    unit = unit or split_unit(name)[1] or ""
    return unit.strip().lower() in TIME_UNITS_S and (values is None or is_rising(values))


def stated_rate(name: str, value: float | str) -> tuple[float, bool] | None:
    """Sampling rate [Hz] and whether its unit is stated, if `name` means a rate or a time step; otherwise None."""
    bare = re.sub(r"\s*[\[({].*", "", name)
    unit = name[len(bare) :].strip(" []{}()").lower() or None
    plain = re.sub(r"[\W_]+", "", bare.rpartition(".")[2].lower())
    rate, step = _RATE.fullmatch(plain), _STEP.fullmatch(plain)
    said = _NUMBER_AND_UNIT.fullmatch(str(value))
    if not (found := rate or step) or not said:
        return None
    number, unit = float(said[1].replace(",", ".")), said[2].lower() or unit or found[1]
    if rate:
        return (number * RATE_UNITS_HZ.get(unit or "hz", 1.0), unit in RATE_UNITS_HZ) if math.isfinite(number) else None
    hz = 1 / (number * TIME_UNITS_S.get(unit or "s", 1.0)) if number > 0 else 0.0
    return (round(hz, 6), True) if PLAUSIBLE_HZ[0] <= hz <= PLAUSIBLE_HZ[1] else None


def parse_time_stamps(texts: Sequence[str]) -> FloatArray | None:
    """Seconds since the first time stamp [n], continued past midnight; None if no format in `STAMPS` fits."""
    import pandas as pd

    series = pd.Series(texts, dtype="str").str.strip().str.replace(r"(:\d\d:\d\d)[,:](\d+)", r"\1.\2", regex=True)
    first, turn = str(series.iloc[0]), 0.0
    if re.match(r"\d{1,2}:\d\d", first):
        turn = 3600.0 if first.count(":") == 1 else 86400.0
        series = ("2000-01-01 00:" if first.count(":") == 1 else "2000-01-01 ") + series
    plain = series.str.replace(r"(\d)T(\d)", r"\1 \2", regex=True)
    plain = plain.str.replace(r"\s+([AaPp])\.?([Mm])", r"\1\2", regex=True)
    plain = plain.str.replace(r"(:\d\d)(?=[AaPp]|$)", r"\1.0", regex=True)
    for form in STAMPS:
        stamps = pd.to_datetime(series if form == "ISO8601" else plain, format=form, errors="coerce", utc=True)
        if stamps.isna().any():
            continue
        seconds = np.array((stamps - stamps.iloc[0]).dt.total_seconds(), np.float64)
        return seconds + turn * np.cumsum(np.concatenate(([0], np.diff(seconds) < -turn / 2))) if turn else seconds
    return None


def time_column(raw: RawFile, samples: int) -> TimeColumn | None:
    """Interpret the file's times, or its numbering of samples, for signals of length `samples`; None without either."""
    numeric = {name: a for name, a in raw.arrays.items() if a.size == samples > 2 and a.dtype.kind in "fiu"}
    found = [interpret_times(raw, name) for name, a in numeric.items() if is_time(name, raw.units.get(name), a)]
    rates = [column.rates_hz[0] for column in found if not column.problem and column.rates_hz]
    if rates and max(rates) > min(rates) * (1 + RATE_MARGIN):
        names = " and ".join(column.name for column in found)
        return TimeColumn(name=names, rates_hz=tuple(rates), problem=f"the times of {names} mean different rates")
    found.sort(key=lambda column: (column.problem is not None, not column.rates_hz))
    counters = {name: read_counter(a) for name, a in numeric.items() if not is_time(name)}
    skipping = {name: at for name, at in counters.items() if at is not None and at[-1] >= at.size}
    gaps = next((TimeColumn(name=printable(name), places=at) for name, at in skipping.items()), None)
    if found and gaps is not None and not found[0].problem and found[0].places is None:
        return replace(found[0], places=gaps.places)
    return found[0] if found else gaps


def is_rising(values: NDArray[np.generic]) -> bool:
    """True if values never fall and mostly rise, as times do and vibrations do not."""
    with np.errstate(invalid="ignore"):
        steps = np.diff(np.ravel(values).astype(np.float64))
    return steps.size > 0 and bool((steps >= 0).all() and np.mean(steps > 0) > MOST_MISSING)


def all_whole(samples: NDArray[Any]) -> bool:
    """True if all samples are whole numbers."""
    return all(bool((block == np.floor(block)).all()) for _, block in blocks_of(samples))


def read_counter(values: NDArray[np.generic]) -> NDArray[np.int64] | None:
    """Sample numbers from 0, by a counter that may skip numbers or wrap to zero; None if `values` are no counter."""
    flat = np.asarray(values).ravel()
    with np.errstate(invalid="ignore"):
        whole = flat.size > 2 and flat.dtype.kind in "fiu" and all_whole(flat)
    if not whole or not np.abs(flat).max() < 2**52:
        return None
    steps = np.diff(flat.astype(np.int64))
    for bits in (0, *COUNTER_BITS):
        if (again := steps % 2**bits if bits else steps).min() >= 1:
            is_counter = np.median(again) == 1 and np.mean(again == 1) > MOST_MISSING
            is_counter &= bits == 0 or int(flat.max()) - int(flat.min()) >= 2 ** (bits - 1)
            return np.concatenate(([0], np.cumsum(again))) if is_counter else None
    return None


def interpret_times(raw: RawFile, name: str) -> TimeColumn:
    """Find unit, rate, gaps and problems of the variable `name`, which contains times."""
    shown, values = printable(name), np.ravel(np.asarray(raw.arrays.get(name)))
    column = TimeColumn(name=shown)
    if name in raw.unusable:
        return replace(column, problem=raw.unusable[name], uneven=True)
    with np.errstate(invalid="ignore"):  # damaged numbers are counted below
        wrong = np.count_nonzero(~(np.abs(values.astype(np.float64)) < LARGEST_TIME))
    if wrong:
        return replace(column, problem=f"{wrong} of the times of {shown} are not finite numbers", uneven=True)
    times = (values - values[0]).astype(np.float64)
    unit = _unit_of(raw, name, float(values[0]), float(times[-1]) / (times.size - 1))
    steps, usual = np.diff(times), float(np.median(np.diff(times)))
    factor = TIME_UNITS_S.get(unit or "s", 1.0)
    places = np.concatenate(([0], np.cumsum(np.round(steps / (usual if usual > 0 else np.inf))))).astype(np.int64)
    count = int(places[-1])
    mean = float(times[-1]) / max(count, 1)
    rate = 1 / (mean * factor) if mean > 0 else 0.0
    is_known = unit in TIME_UNITS_S or (not unit and PLAUSIBLE_HZ[0] <= rate <= PLAUSIBLE_HZ[1])
    gaps = np.diff(places)
    off = np.abs(times - mean * places).max()
    fits = usual > 0 and mean > 0 and gaps.min() > 0 and times.size >= (1 - MOST_MISSING) * (count + 1)
    fits = fits and np.mean(gaps > 1) <= MOST_GAPS
    exact = 0.0 if values.dtype.kind in "iu" else 2 * float(np.spacing(np.abs(values).max()))
    digit = 0.0 if off <= MAX_STEP_DEVIATION * mean + exact else _last_digit(values, COARSEST * mean)
    if not fits or (off > MAX_STEP_DEVIATION * mean + exact and not off <= 1.01 * digit + exact < COARSEST * mean):
        if (steps >= 0).all() and times[-1] > 0 and (is_known or unit is None) and np.mean(steps == 0) > MOST_MISSING:
            likely = (times.size - 1) / (float(times[-1]) * factor)
            zero = f"{int((steps == 0).sum())} of {steps.size} steps are zero; on average {likely:.6g} Hz"
            return replace(column, problem=f"the times of {shown} are too coarse for a rate: {zero}", likely_hz=likely)
        if not usual > 0:
            problem = f"the times of {shown} do not run forwards: {int((steps <= 0).sum())} of {steps.size} steps"
            return replace(column, problem=problem, uneven=True)
        jitter = np.abs(steps - usual)
        uneven = np.count_nonzero(jitter > MAX_STEP_DEVIATION * usual + digit)
        said = f"{uneven} of {steps.size} steps" if uneven else "a slow drift"
        problem = f"the times of {shown} are uneven: {said}, the worst off by {100 * jitter.max() / usual:.3g} %"
        times_s = times * factor if is_known and steps.min() >= 0 else None
        return replace(column, problem=problem, uneven=True, times_s=times_s)
    if unit and unit not in TIME_UNITS_S:
        return replace(column, problem=f"the times of {shown} are in an unknown unit, {printable(unit)!r}")
    column = replace(column, places=places if count + 1 > times.size else None)
    if is_known:
        return replace(column, rates_hz=(round(rate, 6),))
    if mean == 1:
        return replace(column, problem=f"{shown} counts the samples: a step of 1 is not a time")
    rates = {u: rate / TIME_UNITS_S[u] for u in ("s", "ms", "us")}
    readings = ", ".join(f"{hz:.6g} Hz if in {u}" for u, hz in rates.items())
    return replace(column, rates_hz=tuple(rates.values()), problem=f"{shown} has a step of {mean:.6g}, {readings}")


def _unit_of(raw: RawFile, name: str, first: float, step: float) -> str | None:
    """Unit of times stated by the file or the name, else guessed if they are dates since 1970 or 1900, else None."""
    match = _TIME.fullmatch(name.lower().strip())
    stated = raw.units.get(name) or (match and (match[1] or match[2] or match[3])) or ""
    if stated or match is None:
        return str(stated or split_unit(name)[1] or "").strip().lower()
    for unit in ("s", "ms", "us", "ns"):
        if EPOCH_S[0] < first * TIME_UNITS_S[unit] < EPOCH_S[1]:
            return unit
    rate_hz = 1 / max(step * TIME_UNITS_S["d"], 1e-12)
    return "d" if DAYS[0] < first < DAYS[1] and PLAUSIBLE_HZ[0] <= rate_hz <= PLAUSIBLE_HZ[1] else None


def _last_digit(times: NDArray[np.generic], coarsest: float) -> float:
    """Step to which times are rounded: a power of ten below `coarsest`, or the float32 resolution; 0 if not rounded."""
    values = np.asarray(times, np.float64)
    sizes, largest = np.abs(values), float(np.abs(values).max())
    places = np.floor(np.log10(sizes, where=sizes > 0, out=np.zeros(sizes.shape)))
    leading, first = sizes / 10.0**places, math.floor(math.log10(largest))
    written = ((10.0 ** (first - n), leading * 10.0**n) for n in range(16) if 10.0 ** (first - n) < coarsest)
    digit = next((d for d, v in written if np.abs(v - np.round(v)).max() < max(1e-4, 2 * np.spacing(v.max()))), 0.0)
    single = bool((values.astype(np.float32) == values).all())
    return max(digit, float(np.spacing(np.float32(largest))) if single else 0.0)
