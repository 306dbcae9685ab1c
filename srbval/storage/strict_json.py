"""Strict JSON: numbers as numbers, null instead of NaN or Infinity, whole files or none.

A dataclass is written as an object of its fields, in their order, without any method of its own. Two class
attributes change what is written of it::

    @dataclass(frozen=True)
    class Check:
        JSON_PROPERTIES: ClassVar = ("ok",)  # computed properties, written after the fields
        JSON_OMITTED: ClassVar = ("run",)  # fields that are not written
        ...

A class whose JSON object has another shape than its fields has a method ``to_dict()`` that returns a mapping; its
values may be anything that can be written, other dataclasses included.
"""

import dataclasses
import enum
import json
import math
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from srbval.storage.whole_file import whole_file


def json_value(value: Any) -> Any:
    """Turn `value` into what JSON knows.

    Dataclasses, mappings, NumPy scalars and arrays, enums, paths, dates and tuples are converted; a number that is
    not finite becomes None. Raises TypeError for anything else, so that no object is ever written as its repr.
    """
    if isinstance(value, enum.Enum):
        return json_value(value.value)
    if isinstance(value, np.ndarray | np.generic):
        return json_value(value.tolist())
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Path):
        return value.as_posix()
    if isinstance(value, datetime):
        return value.isoformat()
    if isinstance(value, Mapping):
        return {_key(key): json_value(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [json_value(item) for item in value]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return json_object(value)
    raise TypeError(f"{type(value).__name__} cannot be written as JSON.")


def json_object(instance: Any) -> dict[str, Any]:
    """The JSON object of a dataclass; see the module's text for what it holds."""
    if hasattr(instance, "to_dict"):
        return {_key(key): json_value(item) for key, item in instance.to_dict().items()}
    kind = type(instance)
    omitted = getattr(kind, "JSON_OMITTED", ())
    names = [field.name for field in dataclasses.fields(instance) if field.name not in omitted]
    return {name: json_value(getattr(instance, name)) for name in (*names, *getattr(kind, "JSON_PROPERTIES", ()))}


def strict_json(value: Any, *, ascii_only: bool = False) -> str:
    """One JSON document, indented by two spaces, keys in the order given, a newline at the end."""
    return json.dumps(json_value(value), indent=2, ensure_ascii=ascii_only, allow_nan=False) + "\n"


def parse_json(text: str | bytes) -> Any:
    """The value of a JSON document from a file that may be damaged: `ValueError` whatever is wrong with it.

    NaN and infinities are refused, as are values nested so deep, or integers so long, that Python's own reader gives
    up.
    """
    try:
        return json.loads(text, parse_constant=_refuse)
    except RecursionError:
        raise ValueError("nested too deep") from None


def write_json(path: Path, value: Any) -> None:
    """Write `value` to `path` at once: readers see the old file or the new one, never a half."""
    # A lone surrogate of a damaged file name becomes its own JSON escape.
    content = strict_json(value).encode("utf-8", errors="backslashreplace")
    with whole_file(path) as part:
        part.write_bytes(content)


def _refuse(constant: str) -> Any:
    raise ValueError(f"{constant} is not JSON")


def _key(key: Any) -> str:
    """The text of a key: a string, or an enum member whose value is one."""
    text = key.value if isinstance(key, enum.Enum) else key
    if not isinstance(text, str):
        raise TypeError(f"JSON key {key!r} must be text.")
    return str(text)
