"""The scenes that the ladder is calibrated on: a grid about a bundled scene, and random ones within it."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from srbval.bearing import Fault
from srbval.scene import Scene, load_scene, merge

RPM = (353.0, 710.0, 997.0)  # the rig's range, without its slowest speeds
RADIAL_KN = (62.4, 124.8)  # Table 5
HEIGHT_MM = (0.1, 0.2)
FITS = ("play", "printed")
KINDS = (Fault.HEALTHY, Fault.OUTER, Fault.INNER)
BETWEEN_SEED = 1


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


def grid(base: str = "paper") -> list[CalibrationScene]:
    """Every calibration scene about a bundled one."""
    own = BASES[base]
    return [
        CalibrationScene(base=base, kind=kind.scene_word, fit=fit, rpm=rpm, radial_kn=load, height_mm=height)
        for kind, fit, rpm, load in itertools.product(KINDS, own.fits, RPM, RADIAL_KN)
        for height in ((0.0,) if kind is Fault.HEALTHY else own.height_mm)
    ]


def quick_grid(base: str = "paper") -> list[CalibrationScene]:
    """Two scenes, for a quick measurement."""
    height = BASES[base].height_mm[-1]
    return [
        CalibrationScene(base=base, kind=kind.scene_word, fit="play", rpm=710.0, radial_kn=124.8, height_mm=height)
        for kind in (Fault.OUTER, Fault.INNER)
    ]


def between(base: str = "paper") -> list[CalibrationScene]:
    """Random scenes within the grid: they show how much errors vary between its scenes.

    Twice as many with a defect on the inner race, the only ones with sidebands.
    """
    return drawn(BETWEEN_SEED, power=3, inner=4, base=base)


def drawn(seed: int, *, power: int, inner: int | None = None, base: str = "paper") -> list[CalibrationScene]:
    """For each defect and roller fit 2^`power` points of a scrambled Sobol sequence over speed, load and height.

    2^`inner` with a defect on the inner race.
    """
    from scipy.stats import qmc

    found, own = [], BASES[base]
    for number, (kind, fit) in enumerate(itertools.product(KINDS, own.fits)):
        sequence = qmc.Sobol(d=len(own.ranges), scramble=True, rng=np.random.default_rng([seed, number]))
        unit = sequence.random_base2(inner or power if kind is Fault.INNER else power)
        low, high = zip(*own.ranges, strict=True)
        for rpm, load, *height in qmc.scale(unit, low, high).tolist():
            found.append(
                CalibrationScene(
                    base=base, kind=kind.scene_word, fit=fit, rpm=round(rpm), radial_kn=round(load, 1),
                    height_mm=0.0 if kind is Fault.HEALTHY else round((height or own.height_mm)[0], 3),
                )
            )  # fmt: skip
    return found
