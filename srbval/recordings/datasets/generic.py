"""Interpretation of files of no known data set: each vector is a channel; rate and speed are found by name."""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from srbval.errors import DataError, NoRecordingError
from srbval.recordings.raw import MIN_SAMPLES, ArrayOrText, RawFile, as_signal, blocks_of, orient_samples, printable
from srbval.recordings.reading import Channel, Reading
from srbval.recordings.recording import Origin
from srbval.recordings.speed import stated_speed
from srbval.recordings.times import PLAUSIBLE_HZ, RATE_MARGIN, all_whole, is_rising, is_time, read_counter, stated_rate
from srbval.recordings.units import CONVERTER_COUNTS, ENVELOPE, known_unit, split_unit

MAX_MATRIX_COLUMNS = 64
MAX_PROBLEMS, LONGEST_LIST = 8, 300  # of a note; characters of a list in it
LIKELY_RPM = (1.0, 120_000.0)
_RATE_IN_TEXT = re.compile(r"\d+(?:[.,]\d+)?\s*[kM]?Hz", re.IGNORECASE)
_SIMULINK = re.compile(r".*\.signals(?:\(\d+\))?\.values")
_RPM = ("rpm", "meanrpm", "speedrpm", "shaftrpm", "nicmspeed")
_SPEED = ("speed", "shaftspeed", "rotationalspeed", "nominalspeed", "meanspeed", "drehzahl")
_SAMPLES = ("data", "values", "signal", "samples", "value")  # of a struct with a name, unit and raster


def read_generic(raw: RawFile) -> Reading:
    """Create a channel from each vector or matrix column with at least `MIN_SAMPLES` samples; find rate and speed."""
    channels: dict[str, Channel] = {}
    for name, channel in _find_channels(raw):
        channels[name if name not in channels else f"{name} ({len(channels) + 1})"] = channel
    if not channels:
        held = ", ".join(f"{printable(k)} {getattr(v, 'shape', 'text')}" for k, v in list(raw.variables.items())[:6])
        raise NoRecordingError(
            f"{raw.path}: a {raw.format} file without a numeric vector of at least {MIN_SAMPLES} samples; "
            f"it contains {held or 'nothing'}."
        )
    problems = [channel.problem for channel in channels.values() if channel.problem]
    if len(problems) == len(channels):
        raise DataError(problems[0])
    rpm, rpm_problem = _named_number(raw, _stated_rpm, LIKELY_RPM)
    rate, rate_problem = _named_number(raw, stated_rate, PLAUSIBLE_HZ)
    own_rates = {channel.fs_hz for channel in channels.values()}
    taken = {(channel.variable or "").removesuffix("[1]") for channel in channels.values()}
    others = {n: a for n, a in raw.arrays.items() if n not in taken and not is_time(n, raw.units.get(n))}
    left = [f"{printable(name)} {array.shape}" for name, array in others.items() if array.size > 1]
    notes = [f"{raw.format} file of no known data set: read by the names of its variables"]
    if unknown := sorted({c.unknown_unit for c in channels.values() if c.unknown_unit}):
        notes.append(printable(f"left out: unit {', '.join(map(repr, unknown))}, which is not known", LONGEST_LIST))
    notes += [f"not to be analysed: {problem}" for problem in problems[:MAX_PROBLEMS]]
    if left:
        listed = printable(", ".join(left), LONGEST_LIST)
        notes.append(f"left out, no signal of {MIN_SAMPLES} samples or more: {listed}")
    reading = Reading(
        channels=channels,
        origin=Origin.MEASURED,
        fs_hz=rate or (own_rates.pop() if len(own_rates) == 1 else None),
        rate_problem=rate_problem,
        speed=None if rpm is None else stated_speed(rpm),
        speed_problem=rpm_problem and f"{rpm_problem}.",
        notes=tuple(notes),
    )
    return replace(reading, channel=reading.vibrations[0] if len(reading.vibrations) == 1 else None)


def with_named_signals(raw: RawFile) -> RawFile:
    """Name the signals in structs by their labels, and separate columns of times from matrices.

    A signal in a struct that Simulink saved is named by its label, else by its block. A struct with a field ``Name``
    may also state its signal's unit (``Unit``) and time step or sampling rate (``Raster``). If the first column of a
    matrix rises, it is read as the times of the other columns; Simulink saves arrays in this form.
    """
    variables, notes, units, rates = dict[str, ArrayOrText](), raw.notes, dict(raw.units), dict(raw.rates_hz)
    for name, value in raw.variables.items():
        if (columns := _split_off_times(value)) is None:
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
    for name in [name for name in variables if name.lower().endswith(".name")]:
        prefix, label = name[: -len(".name")], raw.text(name) or ""
        keys = (key for key in variables if key.lower() in {f"{prefix}.{word}".lower() for word in _SAMPLES})
        data = next((key for key in keys if np.size(variables[key]) >= MIN_SAMPLES), None)
        if data is None or not label or label in variables:
            continue
        variables[label] = variables.pop(data)
        if unit := raw.text(f"{prefix}.unit"):
            units[label] = unit
        raster = raw.number(f"{prefix}.raster") or raw.text(f"{prefix}.raster") or ""
        named = _RATE_IN_TEXT.search(raster) if isinstance(raster, str) else None
        key = "fs" if named or (isinstance(raster, float) and raster > 1) else "raster"
        if stated := stated_rate(key, named[0] if named else raster):
            rates[label] = stated[0]
    return replace(raw, variables=variables, notes=notes, units=units, rates_hz=rates)


def _split_off_times(value: ArrayOrText) -> NDArray[np.generic] | None:
    """Columns of a matrix as an array [columns, samples] if the first column contains times; otherwise None."""
    if isinstance(value, str) or value.ndim != 2 or value.dtype.kind not in "fiu":
        return None
    columns = orient_samples(value).T
    if not 2 <= len(columns) <= MAX_MATRIX_COLUMNS or columns.shape[1] < MIN_SAMPLES:
        return None
    return columns if is_rising(columns[0]) and (np.diff(columns[0]) != 1).any() else None


def _find_channels(raw: RawFile) -> Iterator[tuple[str, Channel]]:
    for variable, name, column in _vectors(raw):
        text = _unit_text(raw, variable)
        unit, problem, shown = known_unit(text or ""), None, f"{raw.path}: {printable(name)}"
        if is_time(name, text, column) or read_counter(column) is not None:
            continue
        try:
            raw.check_usable(variable)
            samples = as_signal(column, shown)
        except DataError as error:
            problem, samples = str(error), np.ravel(column).astype(np.float64)
        if not any(np.isfinite(block).any() for _, block in blocks_of(samples)):
            if variable not in raw.unusable:  # an empty column
                continue
        elif unit == ENVELOPE:
            problem = f"{shown} is in gE, an acceleration envelope of a meter, demodulated: export the acceleration."
        rpm = unit is None and _stated_rpm(name, 1.0) is not None
        whole = unit in (None, CONVERTER_COUNTS) and all_whole(samples)
        channel = Channel(
            samples=samples,
            unit="rpm" if rpm else unit,
            variable=name,
            fs_hz=raw.rates_hz.get(variable),
            whole_numbers=not rpm and ((raw.full_scale and unit is None) or whole),
            unknown_unit=printable(text) if text and unit is None else None,
            problem=problem,
        )
        yield printable(name), channel


def _unit_text(raw: RawFile, variable: str) -> str | None:
    """Unit of a variable as written in the file or in the variable's name; a known unit is preferred to others."""
    prefix = variable.rpartition(".")[0]
    keys = (f"{variable}_unit", f"{variable}.unit", f"{prefix}.unit", f"{prefix}.units", "unit", "units")
    texts = [text for text in (raw.units.get(variable), *(raw.text(key) for key in keys)) if text]
    named = split_unit(variable)[1]
    known = (text for text in (*texts[:1], named, *texts) if text and known_unit(text))
    bracket = named if named and re.search(r"[\[(]", variable) else None
    return next(known, texts[0] if texts else bracket)


def _vectors(raw: RawFile) -> Iterator[tuple[str, str, NDArray[np.generic]]]:
    """Yield variable, channel name and samples of each numeric vector and of each column of a matrix."""
    for name, array in raw.arrays.items():
        if array.dtype.kind not in "fiu" or array.size < MIN_SAMPLES:
            continue
        if max(array.shape) == array.size:
            yield name, name, array
        elif array.ndim == 2 and min(array.shape) <= MAX_MATRIX_COLUMNS and max(array.shape) >= MIN_SAMPLES:
            yield from ((name, f"{name}[{i}]", column) for i, column in enumerate(orient_samples(array).T, 1))


def _stated_rpm(name: str, value: float | str) -> tuple[float, bool] | None:
    """Shaft speed [rpm] if `name` means one, with False as a sign that its unit is not certain; otherwise None."""
    bare, unit = split_unit(name)
    plain = re.sub(r"[\W_]+", "", name.rpartition(".")[2].lower())
    said = str(value).split()
    in_rpm = "rpm" in (known_unit(unit or ""), known_unit(said[1] if len(said) == 2 else ""))
    if not (plain in _RPM or (in_rpm and re.sub(r"[\W_]+", "", bare.lower()) in _SPEED)):
        return None
    try:
        return float(said[0].replace(",", ".")), False
    except (ValueError, IndexError):
        return None


def _named_number(
    raw: RawFile, interpret: Callable[[str, float | str], tuple[float, bool] | None], likely: tuple[float, float]
) -> tuple[float | None, str | None]:
    """Find a number by the name of its variable or attribute; return it and None, or None and the problem.

    `interpret` returns the number and True if its unit is stated, or None if the name means another quantity. Numbers
    that contradict each other, and a number outside the range `likely` without a stated unit, are problems.
    """
    found: dict[str, tuple[float, bool]] = {}
    for name in (*raw.variables, *raw.attributes):
        if interpret(name, 1.0) is None and interpret(name, 1e-4) is None:
            continue
        value = raw.number(name) if raw.number(name) is not None else raw.text(name)
        if value is not None and (stated := interpret(name, value)) is not None:
            found[printable(name)] = stated
    numbers = [number for number, _ in found.values()]
    said = " and ".join(f"{name} = {number:g}" for name, number in zip(found, numbers, strict=True))
    if numbers and max(numbers) - min(numbers) > RATE_MARGIN * abs(max(numbers)):
        return None, f"{said} contradict each other"
    number, in_unit = next(iter(found.values()), (None, False))
    if number is None or (in_unit and number > 0) or likely[0] <= number <= likely[1]:
        return number, None
    return None, f"{said} is not within {likely[0]:g} to {likely[1]:g}, perhaps in another unit"
