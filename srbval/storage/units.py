"""Numbers with units at the border of the program; SI inside.

A quantity in a configuration file is a plain number in the SI unit of its field, or a string such
as ``"124.8 kN"``. Only the units a bearing scene needs are known; this is not a unit algebra.
"""

import math
import re
import tomllib
from importlib.resources import files

from srbval.errors import ConfigurationError

_TABLE = tomllib.loads((files("srbval.storage") / "units.toml").read_text(encoding="utf-8"))
UNITS: dict[str, dict[str, float]] = {name: table["units"] for name, table in _TABLE.items()}
SI_SUFFIX: dict[str, str] = {name: table["suffix"] for name, table in _TABLE.items() if "suffix" in table}
RANGES: dict[str, list[float]] = {name: table["range"] for name, table in _TABLE.items() if "range" in table}
LONGEST_TEXT = 200  # characters of a number with its unit

NUMBER_AND_UNIT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


def parse_quantity(value: object, dimension: str, where: str) -> float:
    """Read `value` (a number in SI, or a string with a unit) as a float in SI.

    `dimension` is a key of `UNITS`; `where` names the place for the error message. A string without a
    unit, an unknown unit, a boolean and a non-finite number are refused with `ConfigurationError`.
    """
    units, said = UNITS[dimension], f"{where}: {shown(value)}"
    if isinstance(value, str):
        match = NUMBER_AND_UNIT.fullmatch(value) if len(value) <= LONGEST_TEXT else None
        if match is None:
            raise ConfigurationError(f"{said} is not a number with a unit; write e.g. {_example(units)}.")
        number, unit = float(match[1]), match[2]
        if unit not in units:
            known = ", ".join(u for u in units if u) or "no unit"
            raise ConfigurationError(f"{where}: unit {unit!r} of {value!r} is not a {dimension} unit; known: {known}.")
        number *= units[unit]
    elif isinstance(value, int | float) and not isinstance(value, bool):
        number = float(value) if isinstance(value, float) or abs(value) < 2**1023 else math.inf
    else:
        raise ConfigurationError(f"{said} is not a {dimension}; write a number or e.g. {_example(units)}.")
    if not math.isfinite(number):
        raise ConfigurationError(f"{said} is not finite.")
    return number


def check_range(number: float, dimension: str, name: str) -> None:
    """Refuse a `number` in SI that is beyond the `RANGES` of its dimension, or NaN."""
    least, most = RANGES[dimension]
    if number and not least <= abs(number) <= most:
        raise ConfigurationError(f"{name} = {number:.6g}: its size must be between {least:g} and {most:g}, or zero.")


def shown(value: object) -> str:
    """The value as an error quotes it, whatever it is."""
    try:
        return repr(value)
    except (ValueError, RecursionError):  # integers of thousands of digits, lists of thousands of levels
        return f"a {type(value).__name__} too large to show"


def _example(units: dict[str, float]) -> str:
    unit = list(units)[min(1, len(units) - 1)]
    return f'"1.5 {unit}"'.replace(' "', '"')
