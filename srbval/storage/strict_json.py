"""Strict JSON: numbers as numbers, null instead of NaN or Infinity, whole files or none."""

from __future__ import annotations

import enum
import json
import math
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from srbval.storage.whole_file import whole_file


def strict(value: Any) -> Any:
    """Turn `value` into what JSON knows.

    NumPy scalars and arrays, enums, paths, dates and tuples are converted; a number that is not finite
    becomes None. Raises TypeError for anything else, so that no object is ever written as its repr.
    """
    if isinstance(value, enum.Enum):
        return strict(value.value)
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, np.ndarray | np.generic):
        return strict(value.tolist())
    if isinstance(value, Path):
        return value.as_posix()
    if isinstance(value, datetime):
        return value.isoformat()
    if isinstance(value, Mapping):
        return {_key(key): strict(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [strict(item) for item in value]
    raise TypeError(f"{type(value).__name__} has no place in a JSON file.")


def strict_json(value: Any) -> str:
    """One JSON document, two blanks of indent, keys in the order given, a newline at the end."""
    return json.dumps(strict(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def write_json(path: Path, value: Any) -> None:
    """Write `value` to `path` at once: readers see the old file or the new one, never a half."""
    # A lone surrogate of a damaged file name becomes its own JSON escape.
    content = strict_json(value).encode("utf-8", errors="backslashreplace")
    with whole_file(path) as part:
        part.write_bytes(content)


def _key(key: Any) -> str:
    if not isinstance(key, str):
        raise TypeError(f"JSON key {key!r} must be text.")
    return str(key)
