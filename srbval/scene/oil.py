"""Oil of a scene: viscosity by class and temperature, and the constants of film, traction and drag."""

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from srbval.errors import ConfigurationError
from srbval.storage.tables import Limited, limited, quantity, read_toml

KELVIN = 273.15
WALTHER = 0.7  # mm2/s, of ASTM D341 for viscosities above 2 mm2/s
LEAST_MM2_S = 2.0
ROELANDS_PA, ROELANDS_LOG = 1.96e8, 9.67  # pole pressure, and -ln(6.31e-5 Pa s)


@dataclass(frozen=True, kw_only=True)
class Oil(Limited):
    """Table `[oil]` of a scene, for the slices model only; ``scene/oil.toml`` contains the defaults and their sources.

    Kinematic viscosity: from the class `iso_vg` of a mineral oil (ISO 3448; 32 to 460) with viscosity index 95, or from
    `viscosity_40_mm2_s` and `viscosity_100_mm2_s`; at `temperature_c` by ASTM D341. `roughness_m`: combined RMS
    roughness of roller and race. `fill`: share of oil in the bearing's free space, for the drag on rollers with
    `drag_coefficient`. Left out are rolling resistance if `rolling_resistance` is false, drag if `fill` is 0, friction
    in cage pockets if `pocket_friction` is 0.
    """

    iso_vg: int | None = None
    viscosity_40_mm2_s: float | None = limited(least=5, most=2000, default=None)
    viscosity_100_mm2_s: float | None = limited(least=LEAST_MM2_S, most=200, default=None)
    temperature_c: float = limited(least=0, most=150)
    pressure_viscosity_1_pa: float = limited(least=5e-9, most=5e-8)
    eyring_stress_pa: float = limited(least=1e6, most=5e7)
    roughness_m: float = quantity("length", above=0, most=1e-5)
    boundary_friction: float = limited(least=0, most=0.5)
    density_kg_m3: float = quantity("density", least=600, most=1200)
    conductivity_w_mk: float = limited(least=0.05, most=1)
    rolling_resistance: bool
    fill: float = limited(least=0, most=1)
    drag_coefficient: float = limited(least=0, most=2)
    pocket_friction: float = limited(least=0, most=0.5)

    def __post_init__(self) -> None:
        super().__post_init__()
        own, classes = (self.viscosity_40_mm2_s, self.viscosity_100_mm2_s), viscosities_100_mm2_s()
        by_class = self.iso_vg in classes and own == (None, None)
        if not by_class and (self.iso_vg is not None or None in own):
            raise ConfigurationError(
                f"oil: iso_vg = {self.iso_vg}, viscosity_40_mm2_s = {own[0]}, viscosity_100_mm2_s = {own[1]}: state "
                f"only iso_vg, one of {', '.join(map(str, classes))}, or only both viscosities."
            )
        if self.points_mm2_s[1] >= self.points_mm2_s[0]:
            raise ConfigurationError(f"oil: viscosities {own} must fall from 40 to 100 degrees C.")
        if self.kinematic_mm2_s() < LEAST_MM2_S:
            raise ConfigurationError(
                f"oil temperature_c = {self.temperature_c:g}: {self.kinematic_mm2_s():.3g} mm2/s; ASTM D341 as used "
                f"here is valid above {LEAST_MM2_S:g} mm2/s: lower the temperature."
            )

    @property
    def points_mm2_s(self) -> tuple[float, float]:
        """Kinematic viscosity at 40 and 100 degrees C [mm2/s]."""
        if self.viscosity_40_mm2_s is not None and self.viscosity_100_mm2_s is not None:
            return self.viscosity_40_mm2_s, self.viscosity_100_mm2_s
        return float(self.iso_vg or 0), viscosities_100_mm2_s().get(self.iso_vg or 0, math.nan)

    @property
    def walther_slope(self) -> float:
        """Slope B in log log (nu + 0.7) = A - B log T (ASTM D341): decimal logarithms, viscosity nu [mm2/s], T [K]."""
        at_40, at_100 = (math.log10(math.log10(point + WALTHER)) for point in self.points_mm2_s)
        return (at_40 - at_100) / math.log10((100 + KELVIN) / (40 + KELVIN))

    def kinematic_mm2_s(self) -> float:
        """Compute the kinematic viscosity at the scene's temperature [mm2/s]."""
        ratio = math.log10((40 + KELVIN) / (self.temperature_c + KELVIN))
        double = math.log10(math.log10(self.points_mm2_s[0] + WALTHER)) + self.walther_slope * ratio
        return float(10**10**double - WALTHER)

    @property
    def viscosity_pa_s(self) -> float:
        """Dynamic viscosity at the scene's temperature and ambient pressure [Pa s]."""
        return self.kinematic_mm2_s() * 1e-6 * self.density_kg_m3

    @property
    def thinning_1_k(self) -> float:
        """Relative decrease of the viscosity per degree [1/K], the derivative of ASTM D341."""
        thick = self.kinematic_mm2_s() + WALTHER
        share = thick * math.log(thick) / self.kinematic_mm2_s()
        return self.walther_slope * share / (self.temperature_c + KELVIN)

    def log_thickening(self, pressure_pa: float) -> float:
        """Compute ln(viscosity under pressure / viscosity without pressure) by C. Roelands 1966, see page "Oil".

        As in Hamrock, Schmid & Jacobson, Fundamentals of Fluid Film Lubrication, 2004, ch. 4 (quoted from memory; the
        same constants in Stachowiak & Batchelor); `pressure_viscosity_1_pa` sets the exponent of this law.
        """
        scale = math.log(self.viscosity_pa_s) + ROELANDS_LOG
        exponent = self.pressure_viscosity_1_pa * ROELANDS_PA / scale
        return scale * ((1 + pressure_pa / ROELANDS_PA) ** exponent - 1)


@cache
def viscosities_100_mm2_s() -> dict[int, float]:
    """Read the kinematic viscosity at 100 degrees C of each class of ISO 3448 from ``oil.toml``."""
    table = read_toml(Path(__file__).with_name("oil.toml"))["viscosity_100_mm2_s"]
    return {int(key): float(value) for key, value in table.items()}
