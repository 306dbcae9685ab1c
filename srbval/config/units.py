"""Numbers with units at the border of the program; SI inside.

A quantity in a configuration file is a plain number in the SI unit of its field, or a string such
as ``"124.8 kN"``. Only the units a bearing scene needs are known; this is not a unit algebra.
"""

import math
import re

from srbval.errors import ConfigurationError

# dimension -> unit -> factor to SI. "speed" is a rotation rate; its SI unit here is rad/s.
UNITS: dict[str, dict[str, float]] = {
    "length": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "in": 0.0254},
    "force": {"N": 1.0, "kN": 1e3, "MN": 1e6},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0},
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "speed": {"rad/s": 1.0, "rpm": 2 * math.pi / 60, "Hz": 2 * math.pi},
    "angle": {"rad": 1.0, "deg": math.pi / 180, "°": math.pi / 180},
    "mass": {"kg": 1.0, "g": 1e-3},
    "stiffness": {"N/m": 1.0, "kN/mm": 1e6, "N/mm": 1e3},
    "damping": {"N s/m": 1.0, "Ns/m": 1.0},
    "velocity": {"m/s": 1.0, "mm/s": 1e-3},
    "density": {"kg/m3": 1.0, "kg/m^3": 1.0},
    "one": {"": 1.0, "%": 0.01},
}

NUMBER_AND_UNIT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


def parse_quantity(value: object, dimension: str, where: str) -> float:
    """Read `value` (a number in SI, or a string with a unit) as a float in SI.

    `dimension` is a key of `UNITS`; `where` names the place for the error message. A string without a
    unit, an unknown unit, a boolean and a non-finite number are refused with `ConfigurationError`.
    """
    units = UNITS[dimension]
    if isinstance(value, str):
        match = NUMBER_AND_UNIT.fullmatch(value)
        if match is None:
            raise ConfigurationError(f"{where}: {value!r} is not a number with a unit; write e.g. {_example(units)}.")
        number, unit = float(match[1]), match[2]
        if unit not in units:
            known = ", ".join(u for u in units if u) or "no unit"
            raise ConfigurationError(f"{where}: unit {unit!r} of {value!r} is not a {dimension} unit; known: {known}.")
        number *= units[unit]
    elif isinstance(value, int | float) and not isinstance(value, bool):
        number = float(value)
    else:
        raise ConfigurationError(f"{where}: {value!r} is not a {dimension}; write a number or e.g. {_example(units)}.")
    if not math.isfinite(number):
        raise ConfigurationError(f"{where}: {value!r} is not finite.")
    return number


def _example(units: dict[str, float]) -> str:
    unit = list(units)[min(1, len(units) - 1)]
    return f'"1.5 {unit}"'.replace(' "', '"')
