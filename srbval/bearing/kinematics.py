"""Kinematic fault orders and frequencies of a rolling bearing: pure rolling, outer ring at rest."""

from __future__ import annotations

import math
from dataclasses import dataclass

from srbval.errors import ConfigurationError
from srbval.storage.tables import Limited, limited

MOST = 1000  # rolling elements of a row, and passages per shaft revolution


@dataclass(frozen=True, kw_only=True)
class FaultOrders(Limited):
    """Fault lines per shaft revolution, dimensionless.

    `bsf` is the rolling element's spin relative to the cage; a defect on it meets a race twice per
    spin, so its line is ``2xBSF``. `bpfo` + `bpfi` is the number of rolling elements of a row.
    """

    bpfo: float = limited(above=0, most=MOST)
    bpfi: float = limited(above=0, most=MOST)
    bsf: float = limited(above=0, most=MOST)
    ftf: float = limited(above=0, most=MOST)

    @classmethod
    def from_dimensions(
        cls, *, rolling_elements: int, element_diameter_m: float, pitch_diameter_m: float, contact_angle_rad: float
    ) -> FaultOrders:
        """Orders from the geometry (Randall, Vibration-based Condition Monitoring, 2011, sect. 2.2.3).

        ``rolling_elements`` counts one row. Assumes no slip and a stationary outer ring.
        """
        if not 1 <= rolling_elements <= MOST:
            raise ConfigurationError(f"rolling_elements = {rolling_elements} must be 1 or more, at most {MOST}.")
        if not (element_diameter_m > 0 and pitch_diameter_m > 0):
            raise ConfigurationError(
                f"element diameter {element_diameter_m} m, pitch diameter {pitch_diameter_m} m: both must be positive."
            )
        ratio = element_diameter_m / pitch_diameter_m * math.cos(contact_angle_rad)
        if not 0 < ratio < 1:
            raise ConfigurationError(
                f"element diameter {element_diameter_m} m on a pitch diameter of {pitch_diameter_m} m: the "
                f"ratio times cos(contact angle) is {ratio:.4g} and must lie between 0 and 1."
            )
        return cls(
            bpfo=rolling_elements / 2 * (1 - ratio),
            bpfi=rolling_elements / 2 * (1 + ratio),
            bsf=pitch_diameter_m / (2 * element_diameter_m) * (1 - ratio**2),
            ftf=(1 - ratio) / 2,
        )

    def at(self, shaft_hz: float) -> FaultFrequencies:
        """Frequencies at a shaft speed of `shaft_hz` [Hz]."""
        return FaultFrequencies(
            shaft_hz=shaft_hz, **{f"{name}_hz": order * shaft_hz for name, order in vars(self).items()}
        )


@dataclass(frozen=True, kw_only=True)
class FaultFrequencies:
    """Fault frequencies at one shaft speed [Hz]."""

    shaft_hz: float
    bpfo_hz: float
    bpfi_hz: float
    bsf_hz: float
    ftf_hz: float
