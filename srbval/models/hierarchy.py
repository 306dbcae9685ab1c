"""The hierarchy of models, cheapest first: one entry of ``levels.toml`` for each level of fidelity, one interface.

A level is a function ``run(stats, settle, whole)`` that yields `outputs.Outputs` of consecutive output intervals with
the number of the first; the first `settle` of the `whole` are not recorded. It adds its times to the statistics, see
`RunStatistics.timed`.
"""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

from srbval.bearing import Bearing, SphericalRollerGeometry
from srbval.errors import ConfigurationError, UnknownNameError
from srbval.models import outputs as col
from srbval.models.outside.names import is_outside
from srbval.scene import Scene
from srbval.storage.tables import read_toml


@dataclass(frozen=True, kw_only=True)
class FidelityLevel:
    """A model's `name`, its `title` in a few words, and the place of its function, as ``module:function``.

    `parameters`: place of the function that assembles the parameters of a model with the full model's equations.
    `columns`: columns of `outputs` that it fills; the others are NaN. `own_solver`: its integrator if the scene does
    not choose it. `coarser`: number of the scene's steps that it takes in one, as far as the output interval allows.
    `lacks`: questions that it cannot answer in any scene, and why. `needs`: the least that must be known of a bearing,
    one of `KNOWN_OF_BEARING`. `outside`: it is not part of the package.
    """

    name: str
    title: str
    place: str = "srbval.models.full_run:full_model"
    parameters: str | None = None
    columns: tuple[int, ...] = tuple(range(col.COUNT))
    own_solver: str | None = None
    coarser: int = 1
    lacks: Mapping[str, str] = field(default_factory=dict)
    needs: str = "geometry"
    outside: bool = False

    def runs(self, bearing: Bearing) -> bool:
        """True if enough is known of the bearing."""
        known = 2 if bearing.geometry is not None else int(bearing.elements is not None)
        return KNOWN_OF_BEARING.index(self.needs) <= known

    def check_scene(self, scene: Scene) -> None:
        """Refuse a surface for a model without continuous contacts, and oil or free rollers for one without slices."""
        for there, models, place, lack, what in (
            (scene.surface is not None, CONTINUOUS, "[surface]", "knows no waves of races and rollers", "table"),
            (scene.oil is not None, SLICED, "[oil]", "knows no oil", "table"),
            (scene.bodies.free_rollers, SLICED, "bodies free_rollers = true", "holds its rollers", "key"),
        ):
            if there and self.name not in models and not self.outside:
                use = f"use --model {' or '.join(models)}, or leave the {what} out"
                raise ConfigurationError(f"{place}: the model {self.name} {lack}; {use}.")

    def steps_per_output(self, scene: Scene) -> int:
        """Solver steps in one output interval."""
        return -(-scene.steps_per_output // self.coarser)

    def step_s(self, scene: Scene) -> float | None:
        """Solver step; None if the level has a method of its own."""
        return None if self.own_solver else 1 / (scene.output_rate_hz * self.steps_per_output(scene))

    @property
    def run(self) -> Callable[..., Any]:
        """Function that runs a scene with this level."""
        return imported(self.place)

    @property
    def make_parameters(self) -> Callable[..., Any]:
        """Function of scene and geometry that assembles the full model's parameters; `ConfigurationError` if none."""
        if self.parameters is None:
            raise ConfigurationError(f"the model {self.name} does not have the full model's equations of motion.")
        return imported(self.parameters)

    @property
    def modules(self) -> tuple[str, ...]:
        """Names of the modules that a run of this level needs, and none of another does; outside models may use all."""
        if self.outside:
            return (*(module for level in LEVELS for module in level.modules), self.place.split(":")[0])
        places = (self.place,) if self.parameters is None else (self.place, self.parameters, STEP_CHECK)
        return tuple(place.split(":")[0] for place in places)


# Estimates a step's error or chooses a step, of models with the full model's equations.
STEP_CHECK = "srbval.models.step_error:check_step"
CONTINUOUS = ("line", "slices")  # models whose contacts feel waves shorter than the distance of points
SLICED = ("slices",)  # the model that knows oil, and rollers that tilt and slide along their axes
KNOWN_OF_BEARING = ("orders", "elements", "geometry")  # the tables of a bearing's file, the richest last


def imported(place: str) -> Callable[..., Any]:
    """The function at ``module:function``, imported only when it is asked for."""
    module, name = place.split(":")
    return cast(Callable[..., Any], getattr(importlib.import_module(module), name))


COLUMNS = {
    "vibration": (col.ACCELERATION_X, col.ACCELERATION_Y, col.ACCELERATION_Z, col.CAGE_SPEED),
    "plane": tuple(range(col.DEEPEST + 1)),
}
LEVELS = tuple(
    FidelityLevel(**table | ({"columns": COLUMNS[table["columns"]]} if "columns" in table else {}))
    for table in read_toml(Path(__file__).with_name("levels.toml"))["level"]
)
MODELS = tuple(level.name for level in LEVELS)
OUTSIDE = FidelityLevel(
    name="outside",
    title="a model from outside",
    place="srbval.models.outside.run:run",
    columns=(col.ACCELERATION_X, col.ACCELERATION_Y),
    needs="orders",
    outside=True,
)
AUTO = "auto"  # no model: leave the choice to the planner, where there is one


def level_of(name: str) -> FidelityLevel:
    """The level of that name, also of a model from outside; `ConfigurationError` with the nearest name if unknown."""
    if name not in MODELS and is_outside(name):
        return replace(OUTSIDE, name=name)
    check_known("model", name, MODELS)
    return LEVELS[MODELS.index(name)]


def geometry_of(bearing: Bearing, model: str = "full") -> SphericalRollerGeometry:
    """The bearing's geometry; `ConfigurationError` for a bearing without one."""
    if bearing.geometry is None:
        instead = "impulse or kinematic" if bearing.elements is None else "planar, impulse or kinematic"
        raise ConfigurationError(
            f"bearing {bearing.name!r} has no [geometry]; the {model} model cannot run it: use --model {instead}."
        )
    return bearing.geometry


def models_of(bearing: Bearing) -> tuple[str, ...]:
    """Names of the models that can simulate the bearing, cheapest first."""
    return tuple(level.name for level in LEVELS if level.runs(bearing))


def check_known(what: str, name: str, known: tuple[str, ...]) -> None:
    """Raise `UnknownNameError` for a name that is none of the `known`."""
    if name not in known:
        raise UnknownNameError.of(f"{what} {name!r} is not known", name, known)
