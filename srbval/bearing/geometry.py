"""Geometry of a double-row spherical roller bearing, after Giraudo et al., Sensors 25 (2025) 2419 ("the paper")."""

import math
from dataclasses import dataclass

from srbval.bearing.kinematics import FaultOrders
from srbval.errors import ConfigurationError
from srbval.storage.tables import Limited, limited, quantity

# Axial positions of the three circles of a raceway, in units of the tilt angle (paper, below eq. 17).
CIRCLES = (0.5, 1.0, 1.5)
# Largest relative difference of a printed roller diameter from the gap between the raceways; play is far smaller.
FIT_TOLERANCE = 0.05
MIN_OSCULATION = 0.8  # real bearings: 0.96 to 0.99
MIN_ROLLER_SHARE = 0.85  # least roller over printed diameter: fit tolerance, and the largest play of a scene


@dataclass(frozen=True, kw_only=True)
class SphericalRollerGeometry(Limited):
    """Dimensions of a double-row spherical roller bearing (the paper's Table 1 and Figure 1) and derived quantities.

    The outer raceway is a sphere of radius `raceway_radius_m` about the bearing centre. The profile of each inner
    raceway is an arc of the same radius; its centre is `inner_centre_radial_m` from the shaft's axis and
    `inner_centre_axial_m` from the middle of the bearing. `pitch_radius_m` is the paper's d_p, which Table 1 calls a
    diameter; only as a radius does it give the paper's fault frequencies.

    `outer_osculation` and `inner_osculation` are the profile radius of a roller divided by the profile radius of the
    outer and inner raceway: 1 in the paper. Other values, which only the simulation model `slices` uses, change the
    profiles of rollers and inner raceways, but not the outer raceway. The comparison ``==`` ignores osculations.
    """

    raceway_radius_m: float = quantity("length", above=0)
    tilt_rad: float = quantity("angle", above=0, most=math.pi / 4)  # the contact angle
    pitch_radius_m: float = quantity("length", above=0)
    roller_width_m: float = quantity("length", above=0)
    roller_diameter_m: float = quantity("length", above=0)
    inner_centre_radial_m: float = quantity("length", above=0)
    inner_centre_axial_m: float = quantity("length", above=0)
    rollers_per_row: int = limited(least=1, default=0)
    outer_diameter_m: float = quantity("length", above=0)
    width_m: float = quantity("length", above=0)
    outer_osculation: float = limited(least=MIN_OSCULATION, most=1, default=1.0, compare=False)
    inner_osculation: float = limited(least=MIN_OSCULATION, most=1, default=1.0, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        assert self.orders.ftf > 0, "impossible dimensions are refused by the orders"
        if self.roller_width_m / 2 <= self.raceway_radius_m * math.sin(self.tilt_rad / 2):
            raise ConfigurationError(
                f"roller_width_m = {self.roller_width_m} is too short: it must exceed the distance between the "
                "outermost contact points in the model `full`, "
                f"{2 * self.raceway_radius_m * math.sin(self.tilt_rad / 2):.6g} m."
            )
        # the gap between the raceways must be about as large as the roller
        if not self.roller_centre_distance_m < self.raceway_radius_m < self.outer_diameter_m / 2:
            raise ConfigurationError(
                f"raceway_radius_m = {self.raceway_radius_m} must be between the roller centres, at "
                f"{self.roller_centre_distance_m:.6g} m, and half the outer diameter, "
                f"{self.outer_diameter_m / 2:.6g} m."
            )
        if not abs(self.zero_play_diameter_m / self.roller_diameter_m - 1) <= FIT_TOLERANCE:
            raise ConfigurationError(
                f"the gap between the raceways is {self.zero_play_diameter_m:.6g} m; it must be the roller diameter, "
                f"{self.roller_diameter_m:.6g} m, within {FIT_TOLERANCE:.0%}. Correct the dimensions; if a roller's "
                "centre is, as usual, midway between the bearing's centre and the inner profile's centre: "
                f"inner_centre_radial_m = {2 * self.pitch_radius_m:.6g}, "
                f"inner_centre_axial_m = {2 * self.pitch_radius_m * math.tan(self.tilt_rad):.6g}."
            )
        raceway, roller = self.raceway_radius_m, self.roller_diameter_m / 2
        lower = raceway - math.sqrt(max(0.0, raceway**2 - (self.roller_width_m / 2) ** 2))  # the ends of the barrel
        inner = self.inner_centre_radial_m - raceway * math.cos(CIRCLES[0] * self.tilt_rad)
        outer = raceway * math.cos(CIRCLES[-1] * self.tilt_rad)
        if not (lower < MIN_ROLLER_SHARE * roller < MIN_ROLLER_SHARE**2 * outer and inner > 0):
            raise ConfigurationError(
                f"rollers of {roller:.6g} m radius do not fit. The radius is {lower:.6g} m less at the rollers' ends; "
                f"this difference must be below {MIN_ROLLER_SHARE:.0%} of the radius. The radius must be below "
                f"{MIN_ROLLER_SHARE:.0%} of the outer raceway's least radius, {outer:.6g} m. The inner raceway's least "
                f"radius, {inner:.6g} m, must be positive."
            )

    @property
    def rolling_elements(self) -> int:
        """Number of rollers of one row."""
        return self.rollers_per_row

    @property
    def orders(self) -> FaultOrders:
        """Kinematic orders of pure rolling."""
        sizes = self.roller_diameter_m, 2 * self.pitch_radius_m, self.tilt_rad
        return FaultOrders.from_dimensions(self.rollers_per_row, *sizes)

    @property
    def roller_centre_distance_m(self) -> float:
        """Distance of a roller centre from the bearing centre [m]: pitch radius / cos(contact angle), paper eq. 12."""
        return self.pitch_radius_m / math.cos(self.tilt_rad)

    @property
    def roller_profile_radius_m(self) -> float:
        """Radius of the rollers' profile arc [m]."""
        return self.outer_osculation * self.raceway_radius_m

    @property
    def inner_profile_radius_m(self) -> float:
        """Radius of the inner raceway's profile arc [m]."""
        return self.roller_profile_radius_m / self.inner_osculation

    @property
    def zero_play_diameter_m(self) -> float:
        """Diameter of a roller without play [m]: sum of the distances of its centre from outer and inner raceway."""
        distance = self.roller_centre_distance_m
        centre = math.hypot(
            self.inner_centre_radial_m - self.pitch_radius_m,
            self.inner_centre_axial_m - distance * math.sin(self.tilt_rad),
        )
        return (self.raceway_radius_m - distance) + (self.raceway_radius_m - centre)

    def outer_ring_mass_kg(self, density_kg_m3: float) -> float:
        """Compute the mass of the outer ring [kg]: a cylinder of the outer diameter minus the sphere of the raceway.

        The sphere is cut off at the width of the ring; the lubrication groove is ignored.
        """
        half, outer = self.width_m / 2, self.outer_diameter_m / 2
        volume = 2 * math.pi * ((outer**2 - self.raceway_radius_m**2) * half + half**3 / 3)
        return density_kg_m3 * volume
