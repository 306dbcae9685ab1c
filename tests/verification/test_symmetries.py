"""What geometry maps onto itself must map the rates onto themselves: turns by a pitch, mirrored rows, reversed shaft.

Reason: a symmetry is broken by any axis, row, side or direction of rotation that is treated differently by mistake, and
it holds for every force at once, without any expected value. Source: invariance of the equations under rotation and
reflection; forces, velocities and positions are vectors, angular velocities and torques pseudo-vectors. The circles
have 19 x 26 = 494 points, so that a turn by one roller pitch maps the points onto points. At an instant symmetric
states differ by rounding alone.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from srbval.models.full import columns as col
from tests.verification.cases import disturbed
from tests.verification.harness import (
    PRINTED_FIT,
    FloatArray,
    layout_of,
    paper_scene,
    parameters,
    rates,
    shaft_reversed,
)

PER_ROW, POINTS = 19, 494
PITCH_DEG = 360 / PER_ROW
# Penetrations of 1e-5 m are differences of lengths of 0.16 m: rounding of 2e-16 * 0.16 / 1e-5 of a force, and friction
# on the slope of its law multiplies that by a few.
INSTANT = 1e-9
BASE: dict[str, Any] = {
    "contact": PRINTED_FIT | {"points_per_circle": POINTS, "critical_velocity": "0.5 m/s"},
    "load": {"axial": "20 kN", "direction": "-72 deg"},
}
DEFECTS: dict[str, dict[str, Any]] = {
    "healthy": {"kind": "none"},
    "outer": {"kind": "outer", "points": 1, "height": "0.05 mm", "angle": "-9 deg"},
    "inner": {"kind": "inner", "points": 1, "height": "0.05 mm", "angle": "-2 deg", "circle": 3},
    "roller": {
        "kind": "roller",
        "extent": "4 mm",
        "height": "0.02 mm",
        "shape": "cosine",
        "angle": "9 deg",
        "roller": 6,
    },
}


@dataclass(frozen=True)
class Symmetry:
    """A map of rollers onto rollers and of vectors onto vectors, and the scene and shaft it leads to.

    `matrix`: orthogonal, world axes. `rollers`: index of the roller that each one comes from. `spin`: sign of spins.
    """

    matrix: FloatArray
    rollers: FloatArray
    spin: float
    scene: Callable[[dict[str, Any]], dict[str, Any]]
    reverses: bool = False

    def state(self, y: FloatArray) -> FloatArray:
        """The image of a state with an untilted cage, or of its rates."""
        where, image = layout_of(y), y.copy()
        pseudo = np.linalg.det(self.matrix) * self.matrix
        for part in (where.slide, where.slide_rate):
            image[part] = y[part][self.rollers]
        for part in (where.rotation, where.spin):
            image[part] = self.spin * y[part][self.rollers]
        for part in (where.ring, where.ring_rate):
            image[part] = self.matrix @ y[part]
        image[where.cage_rate] = pseudo @ y[where.cage_rate]
        image[where.cage] = pseudo @ y[where.cage]
        return image


def turned_by(pitches: int) -> Symmetry:
    """Load, defect and start angle turned, so that each roller comes to where one `pitches` further on was."""
    angle = np.radians(pitches * PITCH_DEG)
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def scene(table: dict[str, Any]) -> dict[str, Any]:
        direction = float(table["load"]["direction"].split()[0]) + pitches * PITCH_DEG
        defect = dict(table["defect"])
        if defect["kind"] == "roller":
            defect["roller"] = (defect["roller"] - 1 + pitches) % PER_ROW + 1
        return table | {"load": table["load"] | {"direction": f"{direction:.17g} deg"}, "defect": defect}

    row = (np.arange(PER_ROW) - pitches) % PER_ROW
    return Symmetry(matrix, np.concatenate([row, PER_ROW + row]), 1.0, scene)


def rows_mirrored() -> Symmetry:
    """z to -z: rows change places, axial components their sign."""

    def scene(table: dict[str, Any]) -> dict[str, Any]:
        return table | {
            "load": table["load"] | {"axial": "-" + table["load"]["axial"]},
            "defect": table["defect"] | {"row": 2},
        }

    rollers = np.concatenate([np.arange(PER_ROW, 2 * PER_ROW), np.arange(PER_ROW)])
    return Symmetry(np.diag([1.0, 1.0, -1.0]), rollers, 1.0, scene)


def shaft_turned_back() -> Symmetry:
    """y to -y: the shaft turns the other way, load and defect lie on the other side."""

    def scene(table: dict[str, Any]) -> dict[str, Any]:
        def other(text: str) -> str:
            return f"{-float(text.split()[0])} deg"

        defect = dict(table["defect"])
        if "angle" in defect:
            defect["angle"] = other(defect["angle"])
        if defect["kind"] == "roller":
            defect["roller"] = (1 - defect["roller"]) % PER_ROW + 1
        return table | {"load": table["load"] | {"direction": other(table["load"]["direction"])}, "defect": defect}

    row = -np.arange(PER_ROW) % PER_ROW
    return Symmetry(np.diag([1.0, -1.0, 1.0]), np.concatenate([row, PER_ROW + row]), -1.0, scene, reverses=True)


SYMMETRIES = {"seven pitches": turned_by(7), "rows mirrored": rows_mirrored(), "shaft reversed": shaft_turned_back()}


@pytest.mark.parametrize("defect", DEFECTS)
@pytest.mark.parametrize("name", SYMMETRIES)
def test_rates_at_an_instant(name: str, defect: str) -> None:
    """Everything off its place but the cage's tilt, whose angles do not transform as a vector."""
    symmetry, table = SYMMETRIES[name], BASE | {"defect": DEFECTS[defect]}
    model, image_model = parameters(paper_scene(**table)), parameters(paper_scene(**symmetry.scene(table)))
    y = disturbed(model, seed=4, cage_angle=0.0)
    where = layout_of(y)
    y[where.cage] = 0.0
    if symmetry.reverses:
        image_model = shaft_reversed(image_model)
    found, image = rates(model, 0.0, y), rates(image_model, 0.0, symmetry.state(y))
    expected = symmetry.state(found.rate)
    for part in (where.slide_rate, where.spin, where.cage_rate, where.ring_rate):
        assert image.rate[part] == pytest.approx(expected[part], abs=INSTANT * np.abs(expected[part]).max())
    reversed_sign = -1.0 if symmetry.reverses else 1.0
    assert image.totals[col.SHAFT_TORQUE] == pytest.approx(reversed_sign * found.totals[col.SHAFT_TORQUE], rel=INSTANT)
    assert image.load_n == pytest.approx(found.load_n[:, symmetry.rollers], abs=INSTANT * found.load_n.max())
