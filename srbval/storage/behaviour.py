"""Comparison of fingerprints of behaviour, and the reference fingerprint that comes with the program.

A fingerprint has, for each part of the program, numbers and words by name; `srbval.check.fingerprint` computes one.
"""

import math
from collections.abc import Mapping
from functools import cache
from typing import Any

from srbval.errors import DataError
from srbval.storage.installation import shipped_folder
from srbval.storage.json_files import read_json

Value = float | str
Part = Mapping[str, Value]
Fingerprint = Mapping[str, Part]

FILE, KIND, SCHEMA_VERSION = "fingerprint.json", "fingerprint", 1
MOST_BYTES = 2**24
# Rounding that differs between processors and versions of libraries reaches 1e-8 in the probes; a change of 1e-6 is a
# thousandth of what any published number states.
RELATIVE = 1e-6
# Least difference that matters, by the unit that ends a name; smaller values are rounding of a theoretical zero.
LEAST = {"m_s2": 1e-5, "w": 1e-3, "m": 1e-12, "db": 1e-4, "p": 1e-6}


def tolerance(name: str, value: Value) -> float:
    """Largest difference from `value` at which a number of this name counts as equal; 0 for words."""
    if isinstance(value, str) or not math.isfinite(value):
        return 0.0
    return max(RELATIVE * abs(value), next((least for unit, least in LEAST.items() if name.endswith(f"_{unit}")), 0.0))


def same(name: str, first: Value, second: Value) -> bool:
    """True if two values of this name agree within `tolerance`; NaN agrees with NaN, a word with the same word."""
    if isinstance(first, str) or isinstance(second, str):
        return first == second
    if math.isfinite(first) and math.isfinite(second):
        return abs(first - second) <= tolerance(name, second)
    return first == second or (math.isnan(first) and math.isnan(second))


def differing(first: Part, second: Part) -> list[str]:
    """Names in both whose values differ, and names in only one of them."""
    changed = [name for name in second if name in first and not same(name, first[name], second[name])]
    return changed + [name for name in {**second, **first} if (name in first) != (name in second)]


def fingerprint_of(table: Any) -> dict[str, dict[str, Value]]:
    """The fingerprint in a JSON document, in which null stands for NaN; `ValueError` if it is none."""
    if not isinstance(table, Mapping) or not all(isinstance(values, Mapping) for values in table.values()):
        raise ValueError("no fingerprint: not a table of tables")
    return {
        part: {name: math.nan if value is None else value for name, value in values.items()}
        for part, values in table.items()
    }


@cache
def reference_fingerprint() -> Fingerprint:
    """The fingerprint that comes with the program, with which `srbval check` compares it; empty if there is none."""
    try:
        content = read_json(shipped_folder("reports") / FILE, MOST_BYTES)
        known = content["kind"] == KIND and content["schema_version"] == SCHEMA_VERSION
        return fingerprint_of(content["parts"]) if known else {}
    except (DataError, LookupError, TypeError, ValueError):
        return {}
