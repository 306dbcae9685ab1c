"""Recogniser for files of no known data set: named vectors, with rate and speed from variables of known names."""

import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from srbval.errors import NoRecordingError
from srbval.recordings.raw import RATE_NAME, RawFile, Value, as_signal, printable, samples_down
from srbval.recordings.reading import PLAUSIBLE_HZ, Channel, Reading, is_time, known_unit, split_unit
from srbval.recordings.recording import Origin
from srbval.recordings.speed import stated_speed

MIN_SAMPLES = 256
MAX_COLUMNS = 64
NAMED = 8  # variables in a list
STATED_CI95_RPM = 1.0
LIKELY_RPM = (1.0, 120_000.0)
Range = tuple[float, float]
_SIMULINK = re.compile(r".*\.signals(?:\(\d+\))?\.values")
_RPM = re.compile(r"(?:.*\.)?(?:rpm|mean_rpm|speed_rpm|shaft_rpm)")


def read_generic(raw: RawFile) -> Reading:
    """Take every numeric vector of at least `MIN_SAMPLES`, or matrix column, as a channel; no fact is guessed."""
    channels: dict[str, Channel] = {}
    for name, channel in _candidates(raw):
        channels[name if name not in channels else f"{name} ({len(channels) + 1})"] = channel
    if not channels:
        held = ", ".join(f"{printable(k)} {getattr(v, 'shape', 'text')}" for k, v in list(raw.variables.items())[:6])
        raise NoRecordingError(
            f"{raw.path}: a {raw.format} file without a numeric vector of at least {MIN_SAMPLES} samples; "
            f"it holds {held or 'nothing'}."
        )
    rpm, rpm_problem = _named_number(raw, _RPM, LIKELY_RPM)
    rate, rate_problem = _named_number(raw, RATE_NAME, PLAUSIBLE_HZ)
    own_rates = {channel.fs_hz for channel in channels.values()}
    taken = {(channel.variable or "").removesuffix("[1]") for channel in channels.values()}
    vectors = {name: array for name in raw.variables if (array := raw.array(name)) is not None and array.size > 1}
    left = [f"{printable(n)} {a.shape}" for n, a in vectors.items() if n not in taken and not is_time(n)]
    notes = [f"{raw.format} file of no known data set: read by the names of its variables"]
    said = {text for name in (*taken, "") if (text := _unit_text(raw, name)) is not None}
    if unknown := sorted(printable(text) for text in said if known_unit(text) is None):
        notes.append(f"left out: unit {', '.join(map(repr, unknown[:NAMED]))}, which is not known")
    if left:
        more = f" and {len(left) - NAMED} more" if len(left) > NAMED else ""
        notes.append(f"left out, no signal of {MIN_SAMPLES} samples or more: {', '.join(left[:NAMED])}{more}")
    reading = Reading(
        channels=channels,
        origin=Origin.MEASURED,
        fs_hz=rate or (own_rates.pop() if len(own_rates) == 1 else None),
        rate_problem=rate_problem,
        speed=None if rpm is None else stated_speed(rpm, STATED_CI95_RPM),
        speed_problem=rpm_problem and f"{rpm_problem}.",
        notes=tuple(notes),
    )
    return replace(reading, channel=reading.vibrations[0] if len(reading.vibrations) == 1 else None)


def with_named_signals(raw: RawFile) -> RawFile:
    """Name the signals of Simulink's structures after their labels or blocks, and split times off matrices.

    The first column of a matrix is its times if it never falls, as in Simulink's arrays; a vibration does not do that.
    """
    variables, notes = dict[str, Value](), raw.notes
    for name, value in raw.variables.items():
        if (columns := _after_times(value)) is None:
            variables[name] = value
            continue
        variables |= {f"{name}.time": columns[0]} | {f"{name}[{i}]": one for i, one in enumerate(columns[1:], 2)}
        notes += (f"the first column of {printable(name)} is read as its times",)
    for name in [name for name in variables if _SIMULINK.fullmatch(name)]:
        prefix = name.removesuffix(".values")
        block = raw.text(f"{prefix}.blockName") or raw.text(f"{prefix.rpartition('.')[0]}.blockName") or ""
        label = raw.text(f"{prefix}.label") or block.rpartition("/")[2].replace("\n", " ")
        if label and label not in variables:
            variables[label] = variables.pop(name)
    return replace(raw, variables=variables, notes=notes)


def _after_times(value: Value) -> NDArray[np.generic] | None:
    """Columns of a matrix, [k, n], if the first one never falls and mostly rises, as times do; else None."""
    if isinstance(value, str) or value.ndim != 2 or value.dtype.kind not in "fiu":
        return None
    columns = samples_down(value).T
    if not 2 <= len(columns) <= MAX_COLUMNS or columns.shape[1] < MIN_SAMPLES:
        return None
    with np.errstate(invalid="ignore"):
        steps = np.diff(columns[0].astype(np.float64))
    are_times = (steps >= 0).all() and np.mean(steps > 0) > 0.5 and (steps != 1).any()
    return columns if are_times else None


def _candidates(raw: RawFile) -> Iterator[tuple[str, Channel]]:
    for variable, name, column in _vectors(raw):
        values = column.ravel()
        with np.errstate(invalid="ignore"):  # infinities, which are refused below
            is_number_of_sample = values[0] in (0, 1) and (np.diff(values) == 1).all()
        if is_time(name) or is_number_of_sample:
            continue
        samples, fs_hz = as_signal(column, f"{raw.path}: {name}"), raw.rates_hz.get(variable)
        unit = known_unit(_unit_text(raw, variable) or ("rpm" if _RPM.fullmatch(name.lower()) else ""))
        whole = unit is None and (raw.full_scale or column.dtype.kind in "iu")
        yield printable(name), Channel(samples=samples, unit=unit, variable=name, fs_hz=fs_hz, whole_numbers=whole)


def _unit_text(raw: RawFile, variable: str) -> str | None:
    """Unit of a variable as the file states it: the first that is known, else the first text."""
    prefix = variable.rpartition(".")[0]
    keys = (f"{variable}_unit", f"{variable}.unit", f"{prefix}.unit", f"{prefix}.units", "unit", "units")
    texts = [text for text in (raw.units.get(variable), *(raw.text(key) for key in keys)) if text]
    known = (text for text in (*texts[:1], split_unit(variable)[1], *texts) if text and known_unit(text))
    return next(known, texts[0] if texts else None)


def _vectors(raw: RawFile) -> Iterator[tuple[str, str, NDArray[np.generic]]]:
    """Variable, name of the vector, and the vector: a matrix has one per column."""
    for name in raw.variables:
        array = raw.array(name)
        if array is None or array.dtype.kind not in "fiu" or array.size < MIN_SAMPLES:
            continue
        raw.check_usable(name)
        if max(array.shape) == array.size:
            yield name, name, array
        elif array.ndim == 2 and min(array.shape) <= MAX_COLUMNS and max(array.shape) >= MIN_SAMPLES:
            yield from ((name, f"{name}[{i}]", column) for i, column in enumerate(samples_down(array).T, 1))


def _named_number(raw: RawFile, pattern: re.Pattern[str], likely: Range) -> tuple[float | None, str | None]:
    """The number under the names of `pattern`, or why it is not used: outside `likely` a name must state the unit."""
    names = [n for n in (*raw.variables, *raw.attributes) if pattern.fullmatch(n.lower())]
    found = {printable(name): number for name in names if (number := raw.number(name)) is not None}
    said = " and ".join(f"{name} = {number:g}" for name, number in found.items())
    if len(set(found.values())) > 1:
        return None, f"{said} contradict each other"
    number = next(iter(found.values()), None)
    in_hz = number is not None and number > 0 and any(name.lower().endswith("hz") for name in found)
    if number is None or in_hz or likely[0] <= number <= likely[1]:
        return number, None
    return None, f"{said} is not within {likely[0]:g} to {likely[1]:g}, perhaps in another unit"
