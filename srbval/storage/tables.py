"""Convert tables of TOML and JSON files to frozen dataclasses, and check names, types, units and limits; write TOML.

The name of a field declared with `quantity(dimension)` ends with its SI unit (``radial_n``). Its table may contain
``radial_n = 124800.0`` (a number in SI) or ``radial = "124.8 kN"`` (text with a unit). A number without unit under the
key ``radial`` is refused, so that no file is read in the wrong unit. A dataclass whose fields have limits
inherits from `Limited`, which checks each new instance, including the result of `dataclasses.replace`.
"""

import contextlib
import dataclasses
import enum
import json
import math
import re
import tomllib
import types
import typing
from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeVar

from srbval.errors import ConfigurationError, UnknownNameError
from srbval.storage.files import read_limited

T = TypeVar("T")
NumberReader = Callable[[object, str], float]  # converts the value at a place of a table to a number

_UNITS = tomllib.loads((files("srbval.storage") / "units.toml").read_text(encoding="utf-8"))
UNIT_FACTORS: dict[str, dict[str, float]] = {name: table["units"] for name, table in _UNITS.items()}
SI_SUFFIX: dict[str, str] = {name: table["suffix"] for name, table in _UNITS.items() if "suffix" in table}
PHYSICAL_RANGES: dict[str, list[float]] = {name: table["range"] for name, table in _UNITS.items() if "range" in table}
JSON_TYPES = {bool: "boolean", int: "integer", str: "string", Path: "string"}  # all other types are tables
LONGEST_TEXT = 200  # characters of a number with its unit

_DIGITS = r"(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
NUMBER_AND_UNIT = re.compile(rf"\s*([-+]?{_DIGITS})(?:\s*/\s*({_DIGITS}))?\s*(.*?)\s*")  # or a fraction, 1/61440 s
LONGEST_KEY = 64  # parts of a dotted key; the reader's time grows with their square
KEY_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
LONG_KEY = re.compile(rf"(?<![\w-]){KEY_PART}(?:[ \t]*\.[ \t]*{KEY_PART}){{{LONGEST_KEY}}}")


def parse_quantity(value: object, dimension: str, where: str) -> float:
    """Convert `value` (a number in SI, or text with a unit) to a finite float in SI.

    `dimension` is a key of `UNIT_FACTORS`, such as ``force``; `where` names the setting in the `ConfigurationError`.
    """
    units, setting_and_value = UNIT_FACTORS[dimension], f"{where}: {quote_value(value)}"
    example = f'"1.5 {list(units)[:2][-1]}"'.replace(' "', '"')
    if isinstance(value, str):
        found = number_and_unit(value)
        if found is None:
            raise ConfigurationError(f"{setting_and_value} is not a number with a unit; write e.g. {example}.")
        number, unit = found
        if unit not in units:
            known = ", ".join(u or "none (the number alone)" for u in units)
            raise UnknownNameError(f"{where}: unit {unit!r} of {value!r} is not known here; known: {known}.")
        number *= units[unit]
    elif isinstance(value, int | float) and not isinstance(value, bool):
        number = float(value) if isinstance(value, float) or abs(value) < 2**1023 else math.inf
    else:
        raise ConfigurationError(f"{setting_and_value} is not a {dimension}; write a number or e.g. {example}.")
    if not math.isfinite(number):
        raise ConfigurationError(f"{setting_and_value} is not finite.")
    return number


def number_and_unit(text: str) -> tuple[float, str] | None:
    """Split a text into its number, possibly a fraction, and its unit, possibly empty; None without a number."""
    match = NUMBER_AND_UNIT.fullmatch(text) if len(text) <= LONGEST_TEXT else None
    if match is None:
        return None
    number, divisor = float(match[1]), float(match[2] or 1)
    return number / divisor if divisor else math.inf, match[3]


def quote_value(value: object) -> str:
    """Text of a value for an error message, also if the value is too large to print."""
    try:
        return repr(value)
    except (ValueError, RecursionError):  # thousands of digits or levels
        return f"a {type(value).__name__} too large to print"


def limited(
    *, above: float | None = None, least: float | None = None, most: float | None = None, **options: Any
) -> Any:
    """Declare a field of a `Limited` class: each number > `above`, >= `least`, <= `most`; `options` as in `field`."""
    metadata = options.pop("metadata", {}) | {"limits": (above, least, most)}
    return dataclasses.field(metadata=metadata, **options)


def quantity(dimension: str, **options: Any) -> Any:
    """Declare a field for a physical quantity in SI, of a `dimension` such as ``force``; `options` as in `limited`."""
    return limited(metadata={"dimension": dimension}, **options)


class Limited:
    """Base class of dataclasses that check the limits and physical ranges of their fields when an object is created."""

    def __post_init__(self) -> None:
        """Check all fields with limits."""
        for field in dataclasses.fields(typing.cast(Any, self)):
            if field.metadata and (value := getattr(self, field.name)) is not None:
                for number in value if isinstance(value, tuple) else (value,):
                    _check_limits(self, field, number)


def _check_limits(owner: object, field: dataclasses.Field[Any], number: float) -> None:
    if "dimension" in field.metadata:
        low, high = PHYSICAL_RANGES[field.metadata["dimension"]]
        if number and not low <= abs(number) <= high:  # also false for NaN
            raise ConfigurationError(
                f"{field.name} = {number:.6g}: its absolute value must be between {low:g} and {high:g}, or zero."
            )
    above, least, most = field.metadata["limits"]
    if (above is None or number > above) and (least is None or number >= least) and (most is None or number <= most):
        return
    limits = (("above", above), ("at least", least), ("at most", most))
    in_words = " and ".join(f"{word} {limit:g}" for word, limit in limits if limit is not None)
    table = re.sub("(?<=[a-z])(?=[A-Z])", "_", type(owner).__name__).lower()
    value = f"{number:.9g}" if isinstance(number, float) else str(number)
    raise ConfigurationError(f"{table} {field.name} = {value} must be {in_words}.")


def read_toml(path: Path, content: bytes | None = None) -> dict[str, Any]:
    """Read a TOML file, or parse its `content` if given.

    Raises `DataError` if the file cannot be read, `ConfigurationError` if it is malformed.
    """
    try:
        text = (read_limited(path) if content is None else content).decode("utf-8-sig")
        if long := LONG_KEY.search(text):
            raise ValueError(f"the key {long[0][:40]!r}... has more than {LONGEST_KEY} parts separated by dots")
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        why = "nested too deep" if isinstance(error, RecursionError) else str(error)
        why = "an integer beyond 64 bits" if why.startswith("Exceeds the limit") else why  # limit on digits in Python
        raise ConfigurationError(f"{path}: not a valid TOML file: {why}.") from None


def toml_text(table: Mapping[str, Any]) -> str:
    """TOML document of a JSON `table` without empty texts, lists and tables; a list of tables becomes ``[[key]]``."""
    document = _drop_empty(table)
    lists = {key: value for key, value in document.items() if isinstance(value, list) and isinstance(value[0], dict)}
    lines = [f"{key} = {_toml_value(value)}" for key, value in document.items() if key not in lists]
    for key, row in ((key, row) for key, rows in lists.items() for row in rows):
        lines += ["", f"[[{key}]]", *(f"{name} = {_toml_value(value)}" for name, value in row.items())]
    return "\n".join(lines) + "\n"


def _drop_empty(value: Any) -> Any:
    """Remove None, empty texts, lists and tables from a JSON value."""
    if isinstance(value, Mapping):
        return {key: kept for key, one in value.items() if (kept := _drop_empty(one)) not in (None, "", [], {})}
    return [_drop_empty(one) for one in value] if isinstance(value, list) else value


def _toml_value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml_value(one)}" for key, one in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False)  # valid in TOML too


def walk_leaves(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the values of nested tables with their dotted keys."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from walk_leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def nest_value(key: str, value: Any) -> dict[str, Any]:
    """Nested tables that contain `value` under the dotted `key`."""
    first, dot, rest = key.partition(".")
    return {first: nest_value(rest, value) if dot else value}


def build(cls: type[T], table: object, where: str) -> T:
    """Create a `cls` (frozen dataclass) from `table`; `where` names the table in error messages.

    Raises `ConfigurationError` for an unknown or missing key and a value of the wrong type or unit. null becomes NaN if
    the field is a float, so that the output of `to_json` can be read again.
    """
    if not isinstance(table, Mapping):
        raise ConfigurationError(f"{where}: expected a table, found {quote_value(table)}.")
    hints, fields, spelling = _keys_of_fields(cls)  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for key, raw in table.items():
        if key not in spelling:
            raise UnknownNameError.of(f"{where}: unknown key {key!r}", key, spelling)
        name = spelling[key]
        if name in values:
            raise ConfigurationError(f"{where}: give only one of the keys {without_unit(fields[name])!r} and {name!r}.")
        values[name] = _read_value(raw, hints[name], f"{where}.{key}", partial(_read_number, fields[name], key))
    required = (n for n, f in fields.items() if f.default is f.default_factory is dataclasses.MISSING)
    if missing := [n for n in required if n not in values]:
        raise ConfigurationError(f"{where}: missing key {missing[0]!r}.")
    return cls(**values)


@cache
def _keys_of_fields(cls: type) -> tuple[dict[str, Any], dict[str, dataclasses.Field[Any]], dict[str, str]]:
    """Types and fields of a dataclass, by field name; and the field name for each key accepted in a table."""
    fields = {f.name: f for f in dataclasses.fields(cls) if f.init}
    spelling = {name: name for name in fields} | {without_unit(field): name for name, field in fields.items()}
    return typing.get_type_hints(cls), fields, spelling


def without_unit(field: dataclasses.Field[Any]) -> str:
    """Name of a field without the suffix of its SI unit."""
    return field.name.removesuffix(SI_SUFFIX.get(field.metadata.get("dimension", ""), ""))


def _read_value(raw: object, hint: Any, where: str, number: NumberReader) -> Any:
    kind, inner = typing.get_origin(hint) or hint, typing.get_args(hint)
    kind = getattr(kind, "__value__", kind)  # an alias of a type, as NumPy's NDArray is from 2.5 on
    kind = typing.get_origin(kind) or kind
    if kind in (types.UnionType, typing.Union):
        return _read_union(raw, inner, where, number)
    if kind is float:
        return math.nan if raw is None else number(raw, where)
    if kind is tuple:
        if not isinstance(raw, list) or (inner[1:] != (...,) and len(raw) != len(inner)):
            raise ConfigurationError(f"{where}: expected a list, found {quote_value(raw)}.")
        hints = [inner[0]] * len(raw) if inner[1:] == (...,) else inner
        items = enumerate(zip(raw, hints, strict=True))
        return tuple(_read_value(item, one, f"{where}[{i}]", number) for i, (item, one) in items)
    if kind in (dict, Mapping) and isinstance(raw, dict) and inner:
        return {
            _read_value(k, inner[0], where, number): _read_value(v, inner[1], f"{where}.{k}", number)
            for k, v in raw.items()
        }
    if dataclasses.is_dataclass(kind):
        return build(typing.cast(Any, kind), raw, where)
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        try:
            return kind(raw)
        except ValueError:
            known = [str(member.value) for member in kind]
            raise UnknownNameError.of(f"{where}: {quote_value(raw)} is not known", quote_value(raw), known) from None
    if kind is Path and isinstance(raw, str):
        return Path(raw)
    if kind is not Any and (not isinstance(raw, kind) or (isinstance(raw, bool) and kind is not bool)):
        raise ConfigurationError(f"{where}: expected {JSON_TYPES.get(kind, 'table')}, found {quote_value(raw)}.")
    return raw


def _read_union(raw: object, hints: tuple[Any, ...], where: str, number: NumberReader) -> Any:
    """Read `raw` as its own type if this is one of the types `hints`, else as the first of them that accepts it."""
    if raw is None and types.NoneType in hints:
        return None
    *others, last = sorted((h for h in hints if h is not types.NoneType), key=lambda hint: hint is not type(raw))
    for hint in others:
        with contextlib.suppress(ConfigurationError):
            return _read_value(raw, hint, where, number)
    return _read_value(raw, last, where, number)


def _read_number(field: dataclasses.Field[Any], key: str, raw: object, where: str) -> float:
    """Read a number: in SI for a `key` like ``radial_n``, as text with a unit for one like ``radial``."""
    dimension = field.metadata.get("dimension")
    if dimension and (key == field.name) == isinstance(raw, str):
        what = "is text" if isinstance(raw, str) else "has no unit"
        raise ConfigurationError(
            f"{where}: {quote_value(raw)} {what}. Write text with a unit as {without_unit(field)!r}, or the number in "
            f"SI as {field.name!r}."
        )
    return parse_quantity(raw, dimension or _number_without_dimension(field), where)


def _number_without_dimension(field: dataclasses.Field[Any]) -> str:
    """Key in `UNIT_FACTORS` of a field without a dimension, which is a share unless its name ends in ``_pct``."""
    return "percentage" if field.name.endswith("_pct") else "one"
