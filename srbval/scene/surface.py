"""Waviness of races and rollers around their circumference; wave heights depend on wavelength by a power law.

The equations and sources are on the page "Surfaces" of the theory.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from srbval.arrays import FloatArray
from srbval.errors import ConfigurationError
from srbval.storage.tables import Limited, limited, quantity, read_toml

FILTER_CONSTANT = math.sqrt(math.log(2) / math.pi)  # halves a wave as long as the filter's cut-off, ISO 16610-21
RA_OVER_RQ = math.sqrt(2 / math.pi)  # of normally distributed heights
SHORTEST_M, LONGEST_M = 1e-4, 1.0  # of waves: a tenth of a contact's length along the race; a race's circumference
MOST_HEIGHT_M = 1e-4  # RMS


# grade numbers of ISO 1302, see ``roughness.toml``
RoughnessClass = enum.StrEnum("RoughnessClass", {f"N{grade}": f"N{grade}" for grade in range(1, 13)})  # type: ignore[misc]


@dataclass(frozen=True, kw_only=True)
class Surface(Limited):
    """Waves of the races and rollers, with wavelengths from `shortest_m` to `longest_m` and random phases.

    `outer_waviness_m`, `inner_waviness_m`, `roller_waviness_m`: RMS height of the waves on each row of a race and each
    roller; if missing, extrapolated from the `roughness_class`, or 0 without a class. Amplitudes are proportional to
    (waves per turn)^-`exponent`. Heights do not vary along a roller. Only the models ``line`` and ``slices`` use waves.
    """

    outer_waviness_m: float | None = quantity("length", least=0, most=MOST_HEIGHT_M, default=None)
    inner_waviness_m: float | None = quantity("length", least=0, most=MOST_HEIGHT_M, default=None)
    roller_waviness_m: float | None = quantity("length", least=0, most=MOST_HEIGHT_M, default=None)
    roughness_class: RoughnessClass | None = None
    exponent: float = limited(least=0, most=2, default=1.0)
    shortest_m: float = quantity("length", least=SHORTEST_M, default=1e-3)
    longest_m: float = quantity("length", most=LONGEST_M, default=50e-3)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.roughness_class is None and not any(self.given_m):
            raise ConfigurationError(
                "surface: no wave height: state roughness_class, outer_waviness, inner_waviness or roller_waviness."
            )
        if self.shortest_m >= self.longest_m:
            raise ConfigurationError(
                f"surface shortest_m = {self.shortest_m:g} must be below longest_m = {self.longest_m:g}."
            )

    @property
    def given_m(self) -> tuple[float | None, float | None, float | None]:
        """RMS heights of outer race, inner race and rollers as stated in the scene; None if not stated."""
        return self.outer_waviness_m, self.inner_waviness_m, self.roller_waviness_m

    def orders(self, round_m: float) -> FloatArray:
        """List the orders of the waves (waves per turn) on a body of the circumference `round_m`."""
        return np.arange(math.ceil(round_m / self.longest_m), math.floor(round_m / self.shortest_m) + 1.0)

    def amplitudes(self, round_m: float, height_m: float | None) -> FloatArray:
        """Amplitudes [m] by order around the circumference `round_m`, from RMS `height_m` (None: roughness class)."""
        shares: FloatArray = self.orders(round_m) ** -self.exponent
        if height_m is None:
            return math.sqrt(2 * self.density_m() * round_m ** (2 * self.exponent - 1)) * shares
        if height_m > 0 and not shares.size:
            raise ConfigurationError(
                f"surface: no whole number of waves of {self.shortest_m:g} to {self.longest_m:g} m fits around "
                f"{round_m:g} m; widen the range from shortest to longest."
            )
        return math.sqrt(2) * height_m * shares / max(float(np.linalg.norm(shares)), 1e-300)

    def density_m(self) -> float:
        """Factor g of the height spectrum g (waves/m)^(-2 `exponent`) [m^3] by roughness class; 0 without a class."""
        if self.roughness_class is None:
            return 0.0
        table = read_toml(Path(__file__).with_name("roughness.toml"))
        ra_um, settings = float(table["ra_um"][self.roughness_class]), table["settings"]["rows"]
        cutoff_mm, finest_mm = next((cutoff, finest) for most, cutoff, finest in settings if ra_um <= most)
        length = np.geomspace(finest_mm * 1e-3 / 5, 100 * cutoff_mm * 1e-3, 20_001)
        kept = (1 - _filter_gain(cutoff_mm * 1e-3, length)) * _filter_gain(finest_mm * 1e-3, length)
        heights = length ** (2 * self.exponent) * kept**2
        return float((ra_um * 1e-6 / RA_OVER_RQ) ** 2 / np.trapezoid(heights / length, np.log(length)))


def _filter_gain(cutoff_m: float, length_m: FloatArray) -> FloatArray:
    """Compute a profile filter's gain at wavelengths `length_m`; `cutoff_m`: cutoff wavelength (ISO 16610-21)."""
    return np.asarray(np.exp(-math.pi * (FILTER_CONSTANT * cutoff_m / length_m) ** 2))
