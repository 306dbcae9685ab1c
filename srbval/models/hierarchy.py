"""The hierarchy of models, cheapest first: ``levels.toml`` defines the levels of fidelity, which share one interface.

The function of a level, ``run_<model>(stats, settle, whole)``, simulates `whole` output intervals, the first `settle`
of which are not recorded. It yields pairs, each for some consecutive intervals: number of the first of them, and their
`outputs.Outputs`. The function adds its computing time to `stats`, see `RunStatistics.timed`.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from srbval.bearing import Bearing, SphericalRollerGeometry
from srbval.errors import ConfigurationError, UnknownNameError
from srbval.models import outputs as col
from srbval.models.outside.names import is_outside
from srbval.scene import Scene
from srbval.storage.tables import read_toml


@dataclass(frozen=True, kw_only=True)
class FidelityLevel:
    """Model of the hierarchy: `name`, short `title`, `place` (``module:function``) of the function that runs it.

    `parameters`: place of the function that assembles the model's parameters, None if the model does not use the full
    model's equations. `columns`: numbers of the columns in `outputs` that the model computes; the others are NaN.
    `own_solver`: name of the model's integrator, None if the scene chooses the solver. `coarser`: largest ratio of the
    model's step to the scene's step. `lacks`: questions that the model can never answer, such as "slip", and why.
    `needs`: table of a bearing's file that the model requires, one of `KNOWN_OF_BEARING`. `outside`: true if the model
    is not part of the package.
    """

    name: str
    title: str
    place: str = "srbval.models.full_run:run_full"
    parameters: str | None = None
    columns: tuple[int, ...] = tuple(range(col.COLUMN_COUNT))
    own_solver: str | None = None
    coarser: int = 1
    lacks: Mapping[str, str] = field(default_factory=dict)
    needs: str = "geometry"
    outside: bool = False

    def runs(self, bearing: Bearing) -> bool:
        """True if the bearing's data suffice for this model."""
        known = 2 if bearing.geometry is not None else int(bearing.elements is not None)
        return KNOWN_OF_BEARING.index(self.needs) <= known

    def check_scene(self, scene: Scene) -> None:
        """Raise `ConfigurationError` if this model cannot simulate the waviness, oil or tilting rollers of a scene."""
        for there, models, entry, lack in (
            (scene.surface is not None, CONTINUOUS, "[surface]", "waves of surfaces"),
            (scene.oil is not None, SLICED, "[oil]", "oil"),
            (scene.bodies.free_rollers, SLICED, "bodies free_rollers", "tilting rollers"),
        ):
            if there and self.name not in models and not self.outside:
                raise ConfigurationError(
                    f"{entry}: the model {self.name} does not simulate {lack}; use --model {' or '.join(models)}, or "
                    f"leave {entry} out."
                )

    def steps_per_output(self, scene: Scene) -> int:
        """Number of solver steps in one output interval."""
        return -(-scene.steps_per_output // self.coarser)

    def step_s(self, scene: Scene) -> float | None:
        """Solver step [s]; None if the model has its own integrator."""
        return None if self.own_solver else 1 / (scene.output_rate_hz * self.steps_per_output(scene))

    @property
    def run(self) -> Callable[..., Iterator[tuple[int, col.Outputs]]]:
        """Function that runs a scene with this model; `srbval.models.hierarchy` describes its interface."""
        return resolve_name(self.place)

    @property
    def make_parameters(self) -> Callable[..., Any]:
        """Function that makes the model's parameters from scene and geometry; `ConfigurationError` if there is none."""
        if self.parameters is None:
            raise ConfigurationError(f"the task needs the full model's equations, not {self.name}: use --model full.")
        return resolve_name(self.parameters)

    @property
    def modules(self) -> tuple[str, ...]:
        """Names of the modules that a run may load; a model from outside the package may load all bundled models."""
        if self.outside:
            return (*(module for level in LEVELS for module in level.modules), self.place.split(":")[0])
        places = (self.place,) if self.parameters is None else (self.place, self.parameters, STEP_CHECK)
        return tuple(place.split(":")[0] for place in places)


# Function that estimates a step's error or chooses a step, for models with the full model's equations.
STEP_CHECK = "srbval.models.step_error:check_step"
CONTINUOUS = ("line", "slices")  # models in which waves shorter than the spacing of contact points have an effect
SLICED = ("slices",)  # models with oil, and with rollers that tilt and slide along their axes
KNOWN_OF_BEARING = ("orders", "elements", "geometry")  # tables of a bearing's file, the most detailed last
COLUMN_SETS = {
    "vibration": (col.ACCELERATION_X, col.ACCELERATION_Y, col.ACCELERATION_Z, col.CAGE_SPEED),
    "plane": tuple(range(col.MAX_PENETRATION + 1)),
}
LEVELS = tuple(
    FidelityLevel(**table | ({"columns": COLUMN_SETS[table["columns"]]} if "columns" in table else {}))
    for table in read_toml(Path(__file__).with_name("levels.toml"))["level"]
)
MODELS = tuple(level.name for level in LEVELS)
OUTSIDE_LEVEL = FidelityLevel(
    name="outside",
    title="a model from outside",
    place="srbval.models.outside.run:run_outside",
    columns=(col.ACCELERATION_X, col.ACCELERATION_Y),
    needs="orders",
    outside=True,
)
AUTO = "auto"  # in place of a model: the planner chooses the model, in commands that have a planner


def level_of(name: str) -> FidelityLevel:
    """Return the model `name`, bundled or from outside the package; an unknown name raises `ConfigurationError`."""
    if name not in MODELS and is_outside(name):
        return replace(OUTSIDE_LEVEL, name=name)
    check_known("model", name, MODELS)
    return LEVELS[MODELS.index(name)]


def geometry_of(bearing: Bearing, model: str = "full") -> SphericalRollerGeometry:
    """Return the geometry of `bearing`; if the bearing has none, raise `ConfigurationError`, which names `model`."""
    if bearing.geometry is None:
        instead = "kinematic" if bearing.elements is None else "planar, impulse or kinematic"
        raise ConfigurationError(
            f"bearing {bearing.name!r} has no [geometry]; the {model} model cannot run it: use --model {instead}."
        )
    return bearing.geometry


def models_of(bearing: Bearing) -> tuple[str, ...]:
    """Names of the models that can simulate the bearing, cheapest first."""
    return tuple(level.name for level in LEVELS if level.runs(bearing))


def check_known(what: str, name: str, known: tuple[str, ...]) -> None:
    """Raise `UnknownNameError` if `name` is not in `known`; `what`: kind of name for the message, such as "solver"."""
    if name not in known:
        raise UnknownNameError.of(f"{what} {name!r} is not known", name, known)
