"""Parts of a scene: housing, masses, contact, load, defects, and tables of speed and load over time."""

import enum
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from srbval.bearing import Fault
from srbval.bearing.geometry import MIN_OSCULATION
from srbval.errors import ConfigurationError
from srbval.storage.tables import Limited, limited, quantity

STANDARD_GRAVITY_M_S2 = 9.80665
MOST_FRICTION = 100.0  # far above any material's; beyond it the step's arithmetic overflows
MOST_OFFSET_M = 2e-3  # largest offset of a roller in its pocket; rollers of the default bearing are 7 mm apart
CLOSEST_S = 1e-9  # least time between two entries of a profile: below it the slope may overflow


@dataclass(frozen=True, kw_only=True)
class Housing(Limited):
    """Housing: point mass on the outer ring, and a spring and a damper from the ring to ground, in all directions.

    The scene's key ``load.path`` decides which of them act. With ``housing``, as in Giraudo et al. 2025, all three act.
    With ``bearing`` the spring does not act, and the damper represents power lost in the structure around the ring.
    """

    mass_kg: float = quantity("mass", least=0)
    stiffness_n_m: float = quantity("stiffness", least=0)
    damping_ns_m: float = quantity("damping", least=0)


@dataclass(frozen=True, kw_only=True)
class Bodies(Limited):
    """Masses: density of rollers and outer ring, mass of the cage, or of both cages together.

    `cages`: 1, or 2, one for each row; two cages turn independently but tilt together. `row_stagger`: angle of row 2
    ahead of row 1, in roller pitches; 1 is the same as 0. `pocket_offset_m`: largest random distance of a roller from
    the middle of its cage pocket along the pitch circle (uniform distribution). Only the models full, line and slices
    use cages, stagger and offset. `free_rollers` (slices only): rollers tilt and slide axially.
    """

    density_kg_m3: float = quantity("density", above=0)
    cage_mass_kg: float = quantity("mass", above=0)
    cages: int = limited(least=1, most=2)
    row_stagger: float = limited(least=0, most=1)
    pocket_offset_m: float = quantity("length", least=0, most=MOST_OFFSET_M, default=0.0)
    free_rollers: bool = False


class RollerFit(enum.StrEnum):
    """Rule for the roller diameter: computed from the radial play, or as printed in Table 1 of Giraudo et al. 2025."""

    PLAY = "play"
    PRINTED = "printed"


@dataclass(frozen=True, kw_only=True)
class Contact(Limited):
    """Contact between a roller and a point of a raceway (Giraudo et al. 2025, eqs 18 and 19, Table 4).

    There, a raceway is replaced by three circles of `points_per_circle` points for each row of rollers; `stiffness_n_m`
    and `damping_ns_m` are per point. `radial_play_m` is the gap between the raceways minus the roller's diameter.
    """

    stiffness_n_m: float = quantity("stiffness", above=0)
    damping_ns_m: float = quantity("damping", least=0)
    smoothing_width_m: float = quantity("length", above=0)
    static_friction: float = limited(most=MOST_FRICTION)
    dynamic_friction: float = limited(least=0)
    critical_velocity_m_s: float = quantity("velocity", above=0)
    points_per_circle: int = limited(least=60, most=100_000)
    radial_play_m: float = quantity("length")
    roller_fit: RollerFit

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.static_friction < self.dynamic_friction:
            raise ConfigurationError(
                f"contact static_friction = {self.static_friction} must not be below dynamic_friction = "
                f"{self.dynamic_friction}."
            )


class Traction(enum.StrEnum):
    """Rule for the friction coefficient, from slip speed (dry), slide-to-roll ratio (lubricated) or oil film (film)."""

    DRY = "dry"
    LUBRICATED = "lubricated"
    FILM = "film"


@dataclass(frozen=True, kw_only=True)
class LineContact(Limited):
    """Contact between a roller and a race, divided into slices along the roller; for the slices model.

    `slices`: their number. `damping_s`: a contact's damping divided by its stiffness, also for the planar model's balls
    and cylindrical rollers. With lubricated `traction` the coefficient of friction is `traction_slope` times the
    slide-to-roll ratio, up to `traction_limit`; for dry traction see `Contact`. `outer_osculation`,
    `inner_osculation`: see `SphericalRollerGeometry`; None for the bearing's values.
    """

    slices: int = limited(least=3, most=201)
    damping_s: float = quantity("time", least=0)
    traction: Traction
    traction_slope: float = limited(least=1e-3, most=1e3)
    traction_limit: float = limited(least=1e-4, most=1)
    outer_osculation: float | None = limited(least=MIN_OSCULATION, most=1, default=None)
    inner_osculation: float | None = limited(least=MIN_OSCULATION, most=1, default=None)


class LoadPath(enum.StrEnum):
    """Parts that carry the load of the outer ring: rollers and the housing's spring in parallel, or only rollers."""

    HOUSING = "housing"
    BEARING = "bearing"


@dataclass(frozen=True, kw_only=True)
class Load(Limited):
    """External force on the outer ring: `radial_n` along `direction_rad` in the x-y plane, `axial_n` along z.

    The load zone is opposite to the direction of the force. `gravity` adds the weight of rollers, outer ring and
    housing mass, along -y; Giraudo et al. 2025 do not mention gravity.
    """

    radial_n: float = quantity("force", least=0)
    axial_n: float = quantity("force")
    direction_rad: float = quantity("angle")
    path: LoadPath
    gravity: bool

    @property
    def zone_rad(self) -> float:
        """Angle of the middle of the load zone, from x towards y [rad]."""
        return self.direction_rad + math.pi


class DefectShape(enum.StrEnum):
    """Shape of a defect: flat (constant height) or round hole."""

    FLAT = "flat"
    HOLE = "hole"


@dataclass(frozen=True, kw_only=True)
class Defect(Limited):
    """Localized defect of a raceway or of one roller.

    Positive heights are bumps towards the other surface, negative heights pits. `angle_rad`: angle of the defect's
    middle at time zero, on a race from the middle of the load zone, on a roller about the roller's axis from the side
    away from the shaft. `row` is 1 (+z) or 2; `roller` counts from 1, for a roller's defect.

    In Giraudo et al. 2025 a race consists of three circles of points. The defect is on the `circle` 1 to 3; a roller's
    defect is where this circle touches the roller. Without `extent_m`, the defect is `points` neighbouring points moved
    by `height_m`, as in that paper. With `extent_m`, it has this length in the rolling direction and the given `shape`;
    `refinement` times as many points, each with proportionally less stiffness, may replace the race's points there.

    The slices model uses the true shape. A `hole` is `extent_m` across; any other shape is `width_m` wide along the
    roller (None: the distance between circles) and may have ramps of `ramp_m` at both ends along the race. The defect's
    middle is `axial_m` outwards from the roller's middle (None: on the circle). Models whose contacts are on circles
    treat a hole as a flat defect and ignore width, ramps and `axial_m`.
    """

    kind: Fault
    points: int = limited(least=1, most=50)
    height_m: float = quantity("length", least=-1e-3, most=1e-3)
    angle_rad: float = quantity("angle")
    row: int = limited(least=1, most=2)
    circle: int = limited(least=1, most=3)
    roller: int = limited(least=1, most=1000)
    shape: DefectShape
    refinement: int = limited(least=1, most=50)
    extent_m: float | None = quantity("length", above=0, most=0.05, default=None)
    width_m: float | None = quantity("length", above=0, most=0.2, default=None)
    axial_m: float | None = quantity("length", default=None)
    ramp_m: float = quantity("length", default=0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 <= self.ramp_m <= (self.extent_m or 0.0) / 2 or (self.ramp_m and self.shape is not DefectShape.FLAT):
            raise ConfigurationError(
                f"defect ramp_m = {self.ramp_m} must be between 0 and half the extent_m = {self.extent_m}, and needs "
                "shape = 'flat'."
            )
        needs_extent = self.kind is Fault.ROLLER or self.refinement > 1 or self.shape is DefectShape.HOLE
        if needs_extent and self.extent_m is None:
            raise ConfigurationError(
                "a defect that is a hole, is on a roller or has a refinement needs an extent, e.g. extent = '2 mm'."
            )


@dataclass(frozen=True, kw_only=True)
class _Profile(Limited):
    """Time profile: values at two or more increasing times `time_s`, interpolated linearly."""

    time_s: tuple[float, ...] = quantity("time")

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.time_s) < 2 or any(len(column) != len(self.time_s) for column in vars(self).values()):
            raise ConfigurationError(f"{self._what} profile: give two or more times, and one value for each time.")
        pair = next((pair for pair in itertools.pairwise(self.time_s) if not pair[1] - pair[0] >= CLOSEST_S), None)
        if pair is not None:
            raise ConfigurationError(f"{self._what} profile: times must rise by {CLOSEST_S:g} s or more; found {pair}.")

    @property
    def _what(self) -> str:
        return type(self).__name__.removesuffix("Profile").lower()

    def check_covers(self, duration_s: float) -> None:
        """Raise `ConfigurationError` if `time_s` does not cover the recorded time, 0 to `duration_s`."""
        first, last = self.time_s[0], self.time_s[-1]
        if first > 0 or last < duration_s * (1 - 1e-9):
            raise ConfigurationError(
                f"{self._what} profile covers {first:g} to {last:g} s; the run records 0 to {duration_s:g} s: "
                "extend the profile or shorten the duration."
            )

    def mean(self, values: Sequence[float], duration_s: float) -> float:
        """Compute the time average of `values`, given at `time_s`, from 0 to `duration_s`."""
        inside = [t for t in self.time_s if 0 < t < duration_s]
        times = np.array([0.0, *inside, duration_s])
        return float(np.trapezoid(np.interp(times, self.time_s, values), times) / duration_s)


@dataclass(frozen=True, kw_only=True)
class SpeedProfile(_Profile):
    """Shaft speed over the recorded time: `time_s` and `speed_rad_s`, two or more entries, never negative."""

    speed_rad_s: tuple[float, ...] = quantity("speed", least=0)


@dataclass(frozen=True, kw_only=True)
class LoadProfile(_Profile):
    """Radial and axial load over the recorded time; the direction is `direction_rad` of the table `[load]`."""

    radial_n: tuple[float, ...] = quantity("force", least=0)
    axial_n: tuple[float, ...] = quantity("force")
