"""The scenes that the ladder is calibrated on: a grid about the paper's."""

from __future__ import annotations

import itertools
import math
from dataclasses import asdict, dataclass
from typing import Any

from srbval.scene import DefectKind, Scene, paper_scene

RPM = (353.0, 710.0, 997.0)  # the rig's range, without its slowest speeds
RADIAL_KN = (62.4, 124.8)  # Table 5
HEIGHT_MM = (0.1, 0.2)
FITS = ("play", "printed")
KINDS = (DefectKind.NONE, DefectKind.OUTER, DefectKind.INNER)


@dataclass(frozen=True, kw_only=True, order=True)
class Case:
    """A scene in a few values; all else is the paper's. `height_mm` is 0 without a defect."""

    kind: str
    fit: str
    rpm: float
    radial_kn: float
    height_mm: float

    @property
    def name(self) -> str:
        """A short name."""
        height = "" if self.kind == DefectKind.NONE else f" {self.height_mm:g} mm"
        return f"{self.kind}{height}, {self.fit}, {self.rpm:g} rpm, {self.radial_kn:g} kN"

    def scene(self, model: str, *, seconds: float, finer: int = 1) -> Scene:
        """The scene for a model, with `finer` times as many steps as by default."""
        defect = {} if self.kind == DefectKind.NONE else {"height_m": self.height_mm / 1e3}
        return paper_scene(
            model=model,
            duration_s=seconds,
            shaft_speed_rad_s=self.rpm * 2 * math.pi / 60,
            load={"radial_n": self.radial_kn * 1e3},
            contact={"roller_fit": self.fit},
            defect={"kind": self.kind, **defect},
            solver={"step_s": paper_scene().solver.step_s / finer},
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


def grid() -> list[Case]:
    """Every calibration scene."""
    return [
        Case(kind=kind.value, fit=fit, rpm=rpm, radial_kn=load, height_mm=height)
        for kind, fit, rpm, load in itertools.product(KINDS, FITS, RPM, RADIAL_KN)
        for height in ((0.0,) if kind is DefectKind.NONE else HEIGHT_MM)
    ]


def quick_grid() -> list[Case]:
    """Two scenes, for a first look."""
    return [
        Case(kind=kind.value, fit="play", rpm=710.0, radial_kn=124.8, height_mm=0.2)
        for kind in (DefectKind.OUTER, DefectKind.INNER)
    ]


def held_out() -> list[Case]:
    """Scenes between those of the grid, to test predictions on: other speeds, loads and bump heights."""
    values = (
        ("outer", "play", 450.0, 75.0, 0.12),
        ("outer", "play", 607.0, 100.0, 0.15),
        ("outer", "play", 877.0, 115.0, 0.18),
        ("outer", "printed", 523.0, 90.0, 0.15),
        ("outer", "printed", 820.0, 110.0, 0.13),
        ("outer", "printed", 650.0, 100.0, 0.17),
        ("inner", "play", 850.0, 110.0, 0.18),
        ("inner", "play", 480.0, 110.0, 0.17),
        ("inner", "play", 640.0, 80.0, 0.14),
        ("inner", "play", 937.0, 95.0, 0.12),
        ("inner", "printed", 457.0, 70.0, 0.16),
        ("inner", "printed", 760.0, 120.0, 0.19),
        ("none", "play", 560.0, 100.0, 0.0),
        ("none", "printed", 900.0, 85.0, 0.0),
    )
    return [
        Case(kind=kind, fit=fit, rpm=rpm, radial_kn=load, height_mm=height) for kind, fit, rpm, load, height in values
    ]
