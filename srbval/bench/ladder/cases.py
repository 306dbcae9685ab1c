"""The scenes that the ladder is calibrated on: a grid about the paper's scene, and random ones within it."""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from srbval.bearing import Fault
from srbval.scene import Scene, paper_scene

RPM = (353.0, 710.0, 997.0)  # the rig's range, without its slowest speeds
RADIAL_KN = (62.4, 124.8)  # Table 5
HEIGHT_MM = (0.1, 0.2)
FITS = ("play", "printed")
KINDS = (Fault.HEALTHY, Fault.OUTER, Fault.INNER)
RANGES = ((RPM[0], RPM[-1]), (RADIAL_KN[0], RADIAL_KN[-1]), (HEIGHT_MM[0], HEIGHT_MM[-1]))
BETWEEN_SEED = 1


@dataclass(frozen=True, kw_only=True, order=True)
class CalibrationScene:
    """A scene in a few values, all others as in the paper's. `height_mm` is 0 without a defect."""

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
        return paper_scene(
            model=model,
            duration_s=seconds,
            shaft_speed_rad_s=self.rpm * 2 * math.pi / 60,
            load={"radial_n": self.radial_kn * 1e3},
            contact={"roller_fit": self.fit},
            defect={"kind": self.kind, **defect},
            solver={"step_s": paper_scene().solver.step_s / finer},
        )


def grid() -> list[CalibrationScene]:
    """Every calibration scene."""
    return [
        CalibrationScene(kind=kind.scene_word, fit=fit, rpm=rpm, radial_kn=load, height_mm=height)
        for kind, fit, rpm, load in itertools.product(KINDS, FITS, RPM, RADIAL_KN)
        for height in ((0.0,) if kind is Fault.HEALTHY else HEIGHT_MM)
    ]


def quick_grid() -> list[CalibrationScene]:
    """Two scenes, for a quick measurement."""
    return [
        CalibrationScene(kind=kind.scene_word, fit="play", rpm=710.0, radial_kn=124.8, height_mm=0.2)
        for kind in (Fault.OUTER, Fault.INNER)
    ]


def between() -> list[CalibrationScene]:
    """Random scenes within the grid: they show how much errors vary between its scenes."""
    return drawn(BETWEEN_SEED, power=3)


def drawn(seed: int, *, power: int) -> list[CalibrationScene]:
    """For each defect and roller fit 2^`power` points of a scrambled Sobol sequence over speed, load and height."""
    from scipy.stats import qmc

    found = []
    for number, (kind, fit) in enumerate(itertools.product(KINDS, FITS)):
        unit = qmc.Sobol(d=len(RANGES), scramble=True, rng=np.random.default_rng([seed, number])).random_base2(power)
        low, high = zip(*RANGES, strict=True)
        for rpm, load, height in qmc.scale(unit, low, high).tolist():
            found.append(
                CalibrationScene(
                    kind=kind.scene_word, fit=fit, rpm=round(rpm), radial_kn=round(load, 1),
                    height_mm=0.0 if kind is Fault.HEALTHY else round(height, 3),
                )
            )  # fmt: skip
    return found
