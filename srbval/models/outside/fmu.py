"""Runs co-simulation units (FMU) of the Functional Mock-up Interface (FMI 2 and 3) with `fmpy`.

The TOML file ``bearing.toml`` beside ``bearing.fmu`` names the variables of the FMU::

    [scene]                                # setting of the scene (key with SI unit) = variable that receives it
    shaft_speed_rad_s = "shaft_speed"
    "load.radial_n" = { variable = "radial_load", unit = "kN" }
    "defect.kind" = { variable = "defect", none = 0, outer = 1, inner = 2, roller = 3 }

    [signals]                              # signal of `SimulatedSignals` (vectors: each axis) = output variable
    acceleration_x_m_s2 = "housing.a_x"
    acceleration_y_m_s2 = "housing.a_y"
    cage_angle_rad = "cage.phi"

The unit of a variable is that in the FMU's model description, otherwise the unit in the TOML file. The communication
step is the solver step of the scene.
"""

from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from srbval.errors import ConfigurationError, DataError, UnknownNameError
from srbval.models.outside.signals import VECTORS, SimulatedSignals
from srbval.models.run_file import scene_dict
from srbval.scene import Scene, paper_scene
from srbval.storage.installation import import_library
from srbval.storage.tables import SI_SUFFIX, UNIT_FACTORS, read_toml, walk_leaves

SUFFIXES = {"_m_s2": {"m/s2": 1.0, "m/s^2": 1.0, "mm/s2": 1e-3, "g": 9.80665}, "_w": {"W": 1.0, "kW": 1e3}}
SUFFIXES |= {suffix: UNIT_FACTORS[dimension] for dimension, suffix in SI_SUFFIX.items()}
FMU_SIGNALS = tuple(one.name for one in fields(SimulatedSignals) if one.name not in ("time_s", "wall_s"))
FMU_SIGNALS += tuple(of_axis.format(axis) for of_axis in VECTORS.values() for axis in "xyz")


class FmuVariable(NamedTuple):
    """Variable `name` of an FMU, which receives the scene's setting `key` or computes the signal `key`.

    `unit`: the variable's unit in SI units, such as 1000 for kN; `codes`: numbers that stand for words, e.g. outer = 1.
    """

    key: str
    name: str
    unit: float
    codes: Mapping[str, float]

    def number(self, value: Any) -> float:
        """Convert a setting to a number in the variable's unit; `ConfigurationError` for a word that has no number."""
        if isinstance(value, str) and value not in self.codes:
            raise ConfigurationError(f"{self.key} = {value!r} needs a number: add {value} = NUMBER to the FMU's TOML.")
        return float(self.codes.get(value, value)) / self.unit


def load_fmu(path: Path) -> Callable[[Scene], Mapping[str, Any]]:
    """Return a function that simulates a scene with the FMU at `path`.

    Code of the FMU is executed only when the returned function is called. Raises `ConfigurationError` if a library is
    missing, if the FMU has no co-simulation, or if the TOML file beside the FMU has an unknown key, variable or unit;
    `DataError` if the FMU or this file is missing or damaged.
    """
    fmpy = import_library("fmpy", "a model in an FMU")
    where = path.with_suffix(".toml")
    table = read_toml(where)
    try:
        description = fmpy.read_model_description(str(path))
    except Exception as error:  # a damaged archive or description fails in many ways
        raise DataError(f"{path}: cannot read this FMU ({type(error).__name__}: {error}). Export it again.") from None
    if description.coSimulation is None:
        raise ConfigurationError(f"{path} contains no co-simulation; export it as a co-simulation FMU.")
    known = {variable.name: variable for variable in description.modelVariables}
    parts = {"scene": tuple(dict(walk_leaves(scene_dict(paper_scene())))), "signals": FMU_SIGNALS}
    given, read = (
        [_variable(f"{where} [{part}]", key, entry, known, allowed) for key, entry in table.get(part, {}).items()]
        for part, allowed in parts.items()
    )
    if not any(one.key.startswith("acceleration") for one in read):
        needed = "acceleration_m_s2, or acceleration_x_m_s2 and acceleration_y_m_s2"
        raise ConfigurationError(f"{where} [signals] has no acceleration; add {needed}.")

    def simulate(scene: Scene) -> Mapping[str, Any]:
        values, step_s = dict(walk_leaves(scene_dict(scene))), scene.solver.step_s
        steps = round((scene.settle_s + scene.duration_s) / step_s)
        found = fmpy.simulate_fmu(
            str(path),
            start_time=0.0,
            stop_time=steps * step_s,
            output_interval=step_s,
            fmi_type="CoSimulation",
            start_values={one.name: one.number(values[one.key]) for one in given},
            output=[one.name for one in read],
        )
        if len(found) < steps:
            raise RuntimeError(f"the FMU stopped at {found['time'][-1]:.6g} of {steps * step_s:.6g} s")
        signals = {one.key: np.asarray(found[one.name], np.float64) * one.unit for one in read}
        return signals | {"time_s": found["time"]}

    return simulate


def _variable(place: str, key: str, entry: Any, variables: Mapping[str, Any], keys: tuple[str, ...]) -> FmuVariable:
    """Convert the `entry` of a `key` in the TOML table `place`; an error if key, variable or unit is wrong.

    `variables`: variables of the FMU by name; `keys`: keys that the table may have.
    """
    if key not in keys:
        raise UnknownNameError.of(f"{place}: {key!r} is not known", key, keys)
    codes: dict[str, Any] = {"variable": entry} if isinstance(entry, str) else dict(entry)
    name, stated = str(codes.pop("variable", "")), str(codes.pop("unit", ""))
    if name not in variables:
        raise UnknownNameError.of(f"{place} {key}: the FMU has no variable {name!r}", name, tuple(variables))
    described = variables[name].unit or getattr(variables[name].declaredType, "unit", None) or ""
    if stated and described and stated != described:
        raise ConfigurationError(
            f"{place} {key}: the unit {stated!r} differs from the FMU's {described!r}: leave out unit = {stated!r}."
        )
    units = SUFFIXES.get(max((suffix for suffix in SUFFIXES if key.endswith(suffix)), key=len, default=""), {"": 1.0})
    unit = stated or described
    if unit not in units and (unit or len(units) > 1):
        has = f"the unit {unit!r}" if unit else "no unit in the FMU's description; state it here"
        raise ConfigurationError(f"{place} {key}: the variable {name!r} has {has}. Known units: {', '.join(units)}.")
    return FmuVariable(key, name, units.get(unit, 1.0), codes)
