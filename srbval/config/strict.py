"""Strict configuration: a TOML table becomes a frozen dataclass, or a clear error.

A field declared with `quantity(dimension)` is named with its SI unit (``radial_n``). Its table may say
``radial_n = 124800.0`` (a number, SI) or ``radial = "124.8 kN"`` (text with a unit); a bare number
under the unit-less key is refused, so no file can be read in the wrong unit.
"""

import dataclasses
import difflib
import enum
import re
import tomllib
import types
import typing
from collections.abc import Collection, Mapping
from datetime import date, time
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from srbval.config.small_file import read_small_file
from srbval.config.units import SI_SUFFIX, check_range, parse_quantity, shown
from srbval.errors import ConfigurationError

T = TypeVar("T")

DEEPEST = 16  # levels of a TOML file; none of ours has more than five
LONGEST_KEY = 64  # parts of a dotted key; the reader's time grows with their square
KEY_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
LONG_KEY = re.compile(rf"(?<![\w-]){KEY_PART}(?:[ \t]*\.[ \t]*{KEY_PART}){{{LONGEST_KEY}}}")


def quantity(dimension: str, **field_options: Any) -> Any:
    """Declare a dataclass field that holds a physical quantity in SI."""
    return dataclasses.field(metadata={"dimension": dimension}, **field_options)


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file; a missing or unreadable file is a `DataError`, a malformed one a `ConfigurationError`."""
    content = read_small_file(path)
    try:
        text = content.decode("utf-8")
        if LONG_KEY.search(text):
            raise ValueError(f"a key of more than {LONGEST_KEY} parts")
        document = tomllib.loads(text)
        _check_values(document)
    except (ValueError, RecursionError) as error:
        why = f"nested deeper than {DEEPEST} levels" if isinstance(error, RecursionError) else str(error)
        why = "an integer beyond 64 bits" if why.startswith("Exceeds the limit") else why  # Python's own, of its digits
        raise ConfigurationError(f"{path}: not a valid TOML file: {why}.") from None
    return document


def _check_values(document: object) -> None:
    """`RecursionError` for values nested too deep, `ValueError` for integers beyond TOML's own 64 bits, and dates."""
    level = [document]
    for _ in range(DEEPEST):
        level = [v for outer in level if isinstance(outer, dict | list)
                 for v in (outer.values() if isinstance(outer, dict) else outer)]  # fmt: skip
        for value in level:
            if isinstance(value, int) and not -(2**63) <= value < 2**63:
                raise ValueError("an integer beyond 64 bits")
            if isinstance(value, date | time):
                raise ValueError(f"{value} is a date or time, which no key accepts")
    if level:
        raise RecursionError


def check_ranges(owner: Any) -> None:
    """Refuse quantities of a dataclass that no machine has, see `units.RANGES`."""
    for field in dataclasses.fields(owner):
        value = getattr(owner, field.name) if "dimension" in field.metadata else None
        for number in value if isinstance(value, tuple) else () if value is None else (value,):
            check_range(number, field.metadata["dimension"], field.name)


def build(cls: type[T], table: Mapping[str, Any], where: str) -> T:
    """Make a `cls` (frozen dataclass) from `table`; `where` names the table in error messages.

    Unknown keys are refused with the nearest known one; a missing required key, a value of the wrong
    type or unit likewise (`ConfigurationError`). Values are checked further by the class itself.
    """
    if not isinstance(table, Mapping):
        raise ConfigurationError(f"{where}: expected a table, found {shown(table)}.")
    hints, fields, spelling = _declared(cls)  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for key, raw in table.items():
        if key not in spelling:
            raise ConfigurationError(f"{where}: unknown key {key!r}{nearest(key, spelling)}.")
        name = spelling[key]
        if name in values:
            raise ConfigurationError(f"{where}: {key!r} is given twice, as {name!r} and without its unit.")
        values[name] = _convert(raw, hints[name], fields[name], key, f"{where}.{key}")
    required = (n for n, f in fields.items() if f.default is f.default_factory is dataclasses.MISSING)
    missing = [n for n in required if n not in values]
    if missing:
        raise ConfigurationError(f"{where}: missing key {missing[0]!r}.")
    return cls(**values)


@cache
def _declared(cls: type) -> tuple[dict[str, Any], dict[str, dataclasses.Field[Any]], dict[str, str]]:
    """Types and fields of a dataclass by name, and the names by the keys that spell them."""
    fields = {f.name: f for f in dataclasses.fields(cls) if f.init}
    return typing.get_type_hints(cls), fields, {key: name for name, field in fields.items() for key in _keys(field)}


def _keys(field: dataclasses.Field[Any]) -> tuple[str, ...]:
    suffix = SI_SUFFIX.get(field.metadata.get("dimension", ""), "")
    return (field.name, field.name.removesuffix(suffix)) if suffix else (field.name,)


def nearest(key: str, known: Collection[str]) -> str:
    """What to add to the refusal of `key`: the nearest of those `known`, else all of them."""
    close = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    return f"; did you mean {close[0]!r}?" if close else f"; known: {', '.join(sorted(known))}"


def _convert(raw: object, hint: Any, field: dataclasses.Field[Any], key: str, where: str) -> object:
    if "dimension" not in field.metadata:
        return _convert_plain(raw, hint, where)
    if typing.get_origin(hint) is not tuple:
        return _convert_quantity(raw, field, key, where)
    if not isinstance(raw, list):
        raise ConfigurationError(f"{where}: expected a list, found {shown(raw)}.")
    return tuple(_convert_quantity(value, field, key, f"{where}[{i}]") for i, value in enumerate(raw))


def _convert_quantity(raw: object, field: dataclasses.Field[Any], key: str, where: str) -> float:
    if key == field.name and isinstance(raw, str):
        raise ConfigurationError(f"{where}: a number in SI is expected; for {shown(raw)} write {_keys(field)[-1]!r}.")
    if key != field.name and not isinstance(raw, str):
        raise ConfigurationError(
            f"{where}: {shown(raw)} has no unit; write text with a unit, or the SI number as {field.name!r}."
        )
    return parse_quantity(raw, field.metadata["dimension"], where)


def _convert_plain(raw: object, hint: Any, where: str) -> object:
    if typing.get_origin(hint) in (types.UnionType, typing.Union):
        hint = next(a for a in typing.get_args(hint) if a is not type(None))
    if typing.get_origin(hint) is tuple:
        if not isinstance(raw, list):
            raise ConfigurationError(f"{where}: expected a list, found {shown(raw)}.")
        return tuple(_convert_plain(r, typing.get_args(hint)[0], f"{where}[{i}]") for i, r in enumerate(raw))
    if dataclasses.is_dataclass(hint):
        return build(typing.cast(Any, hint), typing.cast(Any, raw), where)
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return _convert_enum(raw, hint, where)
    return _convert_scalar(raw, hint, where)


def _convert_enum(raw: object, hint: type[enum.Enum], where: str) -> enum.Enum:
    try:
        return hint(raw)
    except ValueError:
        known = [str(member.value) for member in hint]
        raise ConfigurationError(f"{where}: {shown(raw)} is not known{nearest(shown(raw), known)}.") from None


def _convert_scalar(raw: object, hint: type, where: str) -> object:
    if hint is float and isinstance(raw, int | float | str) and not isinstance(raw, bool):
        return parse_quantity(raw, "one", where)
    if not isinstance(raw, hint) or (isinstance(raw, bool) and hint is not bool):
        raise ConfigurationError(f"{where}: expected {hint.__name__}, found {shown(raw)}.")
    return raw
