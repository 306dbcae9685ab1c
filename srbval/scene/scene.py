"""A scene: everything that a run of a model depends on, in SI, frozen.

The values have no defaults here; they come from `paper.toml` (the paper's Tables 4 and 5), over which
a user's file is laid.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from srbval.config.strict import quantity
from srbval.errors import ConfigurationError

STEP_TOLERANCE = 1e-6  # how far an output interval may be from a whole number of steps, relative


class DefectKind(enum.StrEnum):
    """Where the localized defect is."""

    NONE = "none"
    OUTER = "outer"
    INNER = "inner"


class LoadPath(enum.StrEnum):
    """What carries the external load: housing spring and rollers in parallel, or the rollers alone."""

    HOUSING = "housing"
    BEARING = "bearing"


class RollerFit(enum.StrEnum):
    """How the roller diameter is found: from the radial play, or as printed in Table 1."""

    PLAY = "play"
    PRINTED = "printed"


def _positive(owner: object, *names: str) -> None:
    for name in names:
        value = getattr(owner, name)
        if not value > 0:
            raise ConfigurationError(f"{name} = {value} must be positive.")


def _not_negative(owner: object, *names: str) -> None:
    for name in names:
        value = getattr(owner, name)
        if value < 0:
            raise ConfigurationError(f"{name} = {value} must not be negative.")


@dataclass(frozen=True, kw_only=True)
class Load:
    """External force on the outer ring: `radial_n` along `direction_rad` in the x-y plane, `axial_n` along z.

    The load zone lies opposite to the direction of the force.
    """

    radial_n: float = quantity("force")
    axial_n: float = quantity("force")
    direction_rad: float = quantity("angle")
    path: LoadPath

    def __post_init__(self) -> None:
        _not_negative(self, "radial_n")

    @property
    def zone_rad(self) -> float:
        """Angle of the middle of the load zone, from x towards y [rad]."""
        return self.direction_rad + math.pi


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Contact between one raceway point and one roller (paper, eqs 18 and 19, Table 4).

    `stiffness_n_m` and `damping_ns_m` are per point, so `points_per_circle` is part of the stiffness.
    `radial_play_m` is the gap between the raceways at a roller less the roller's diameter.
    """

    stiffness_n_m: float = quantity("stiffness")
    damping_ns_m: float = quantity("damping")
    smoothing_width_m: float = quantity("length")
    static_friction: float
    dynamic_friction: float
    critical_velocity_m_s: float = quantity("velocity")
    points_per_circle: int
    radial_play_m: float = quantity("length")
    roller_fit: RollerFit

    def __post_init__(self) -> None:
        _positive(self, "stiffness_n_m", "smoothing_width_m", "critical_velocity_m_s")
        _not_negative(self, "damping_ns_m", "dynamic_friction")
        if self.static_friction < self.dynamic_friction:
            raise ConfigurationError(
                f"static_friction = {self.static_friction} must not be below dynamic_friction = "
                f"{self.dynamic_friction}."
            )
        if not 60 <= self.points_per_circle <= 100_000:
            raise ConfigurationError(f"points_per_circle = {self.points_per_circle} must be between 60 and 100000.")


@dataclass(frozen=True, kw_only=True)
class Housing:
    """Housing: point mass on the outer ring, spring and damper to ground in all three directions."""

    mass_kg: float = quantity("mass")
    stiffness_n_m: float = quantity("stiffness")
    damping_ns_m: float = quantity("damping")

    def __post_init__(self) -> None:
        _not_negative(self, "mass_kg", "stiffness_n_m", "damping_ns_m")


@dataclass(frozen=True, kw_only=True)
class Bodies:
    """Masses: `density_kg_m3` of rollers and outer ring, `cage_mass_kg` (not in the paper)."""

    density_kg_m3: float = quantity("density")
    cage_mass_kg: float = quantity("mass")

    def __post_init__(self) -> None:
        _positive(self, "density_kg_m3", "cage_mass_kg")


@dataclass(frozen=True, kw_only=True)
class Defect:
    """A localized defect: `points` neighbouring points of one circle moved by `height_m` along the normal.

    Positive heights are bumps towards the rollers (the paper), negative ones pits. `angle_rad` is that of the
    defect's middle from the middle of the load zone, at time zero. `row` is 1 (+z) or 2, `circle` 1 to 3.
    """

    kind: DefectKind
    points: int
    height_m: float = quantity("length")
    angle_rad: float = quantity("angle")
    row: int
    circle: int

    def __post_init__(self) -> None:
        for name, low, high in (("points", 1, 50), ("row", 1, 2), ("circle", 1, 3)):
            value = getattr(self, name)
            if not low <= value <= high:
                raise ConfigurationError(f"defect {name} = {value} must be between {low} and {high}.")
        if not abs(self.height_m) <= 1e-3:
            raise ConfigurationError(f"defect height_m = {self.height_m} must lie within -1 mm and 1 mm.")


@dataclass(frozen=True, kw_only=True)
class SolverSettings:
    """Time integration: the method's name and its fixed step."""

    name: str
    step_s: float = quantity("time")

    def __post_init__(self) -> None:
        _positive(self, "step_s")


@dataclass(frozen=True, kw_only=True)
class Scene:
    """One case: a bearing at a speed under a load, with or without a defect, and how it is simulated.

    `settle_s` is simulated first and not recorded. `output_rate_hz` is the rate of the recorded signals;
    an output interval must be a whole number of solver steps.
    """

    bearing: str
    model: str
    shaft_speed_rad_s: float = quantity("speed")
    duration_s: float = quantity("time")
    settle_s: float = quantity("time")
    output_rate_hz: float = quantity("frequency")
    seed: int
    load: Load
    contact: Contact
    housing: Housing
    bodies: Bodies
    defect: Defect
    solver: SolverSettings

    def __post_init__(self) -> None:
        _positive(self, "shaft_speed_rad_s", "duration_s", "output_rate_hz")
        _not_negative(self, "settle_s")
        if self.samples < 1:
            raise ConfigurationError(
                f"duration_s = {self.duration_s} is shorter than one output interval of {1 / self.output_rate_hz} s."
            )
        steps = 1 / (self.output_rate_hz * self.solver.step_s)
        if round(steps) < 1 or abs(steps / round(steps) - 1) > STEP_TOLERANCE:
            raise ConfigurationError(
                f"the output interval 1/{self.output_rate_hz:g} s is {steps:.6g} steps of {self.solver.step_s:g} s; "
                "it must be a whole number: change step or output_rate."
            )

    @property
    def shaft_hz(self) -> float:
        """Shaft speed [Hz]."""
        return self.shaft_speed_rad_s / (2 * math.pi)

    @property
    def steps_per_output(self) -> int:
        """Solver steps in one output interval."""
        return round(1 / (self.output_rate_hz * self.solver.step_s))

    @property
    def samples(self) -> int:
        """Number of recorded samples."""
        return round(self.duration_s * self.output_rate_hz)
