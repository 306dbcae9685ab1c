"""The scenes that the ladder is calibrated on: a grid about a bundled scene, and random ones within it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from srbval.bearing import Fault
from srbval.scene import Scene, load_scene, merge

RPM = (353.0, 710.0, 997.0)  # the rig's range, without its slowest speeds
RADIAL_KN = (62.4, 124.8)  # Table 5
HEIGHT_MM = (0.1, 0.2)
FITS = ("play", "printed")
KINDS = (Fault.HEALTHY, Fault.OUTER, Fault.INNER)


@dataclass(frozen=True, kw_only=True)
class LadderBase:
    """A bundled scene that rungs are compared on: its `name`, and the grid's fits of the rollers and defects' heights.

    Right is the model `reference` at a fraction of the scene's step, with the `finest` changes to the scene.
    """

    name: str
    reference: str
    fits: tuple[str, ...]
    height_mm: tuple[float, ...]
    finest: Mapping[str, Any]

    @cached_property
    def scene(self) -> Scene:
        """The bundled scene with this base's reference for its model."""
        return load_scene(self.name, {"model": self.reference})

    @property
    def ranges(self) -> tuple[tuple[float, float], ...]:
        """Least and greatest speed [rpm] and load [kN] of the grid, and height [mm] where there are several."""
        heights = ((self.height_mm[0], self.height_mm[-1]),) if len(self.height_mm) > 1 else ()
        return ((RPM[0], RPM[-1]), (RADIAL_KN[0], RADIAL_KN[-1]), *heights)


BASES = {
    "paper": LadderBase(name="paper", reference="full", fits=FITS, height_mm=HEIGHT_MM, finest={}),
    "rig": LadderBase(
        name="rig", reference="slices", fits=FITS[:1], height_mm=(-0.5,), finest={"line_contact": {"slices": 31}}
    ),
}


@dataclass(frozen=True, kw_only=True, order=True)
class CalibrationScene:
    """A scene in a few values, all others as in the bundled scene `base`. `height_mm` is 0 without a defect."""

    base: str = "paper"
    kind: str
    fit: str
    rpm: float
    radial_kn: float
    height_mm: float

    @property
    def name(self) -> str:
        """A short name."""
        height = "" if Fault(self.kind) is Fault.HEALTHY else f" {self.height_mm:g} mm"
        return f"{self.kind}{height}, {self.fit}, {self.rpm:g} rpm, {self.radial_kn:g} kN"

    def scene(self, model: str, *, seconds: float, finer: int = 1) -> Scene:
        """The scene for a model, with `finer` times as many steps as by default."""
        defect = {} if Fault(self.kind) is Fault.HEALTHY else {"height_m": self.height_mm / 1e3}
        base = BASES[self.base]
        changes = {
            "model": model,
            "duration_s": seconds,
            "shaft_speed_rad_s": self.rpm * 2 * math.pi / 60,
            "load": {"radial_n": self.radial_kn * 1e3},
            "contact": {"roller_fit": self.fit},
            "defect": {"kind": self.kind, **defect},
            "solver": {"step_s": base.scene.solver.step_s / finer},
        }
        return load_scene(self.base, merge(changes, base.finest) if finer > 1 else changes)

    def reference(self, *, seconds: float, finer: int) -> Scene:
        """The same for the base's reference model."""
        return self.scene(BASES[self.base].reference, seconds=seconds, finer=finer)
