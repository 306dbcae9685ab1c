"""Housing and masses."""

from __future__ import annotations

from dataclasses import dataclass

from srbval.config.strict import quantity
from srbval.scene.checks import not_negative, positive


@dataclass(frozen=True, kw_only=True)
class Housing:
    """Housing: point mass on the outer ring, spring and damper to ground in all three directions."""

    mass_kg: float = quantity("mass")
    stiffness_n_m: float = quantity("stiffness")
    damping_ns_m: float = quantity("damping")

    def __post_init__(self) -> None:
        not_negative(self, "mass_kg", "stiffness_n_m", "damping_ns_m")


@dataclass(frozen=True, kw_only=True)
class Bodies:
    """Masses: `density_kg_m3` of rollers and outer ring, `cage_mass_kg` (not in the paper)."""

    density_kg_m3: float = quantity("density")
    cage_mass_kg: float = quantity("mass")

    def __post_init__(self) -> None:
        positive(self, "density_kg_m3", "cage_mass_kg")
