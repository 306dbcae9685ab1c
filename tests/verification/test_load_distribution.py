"""How the load spreads over the rollers, against a static solution of its own.

Reason: the load per roller decides penetrations, friction and the height of every impact. Source: minimum of elastic
energy, solved here by nested root finding from the point clouds of `world.py` (one slide per roller inside, the ring's
three displacements outside; scipy), without friction, smoothing or any kernel.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from srbval.models.full import columns as col
from tests.verification.harness import (
    FloatArray,
    geometry,
    layout_of,
    merged,
    paper_scene,
    parameters,
    rates,
    rolling_state,
)
from tests.verification.world import World

SOLVED_N = 1e-4  # where the nested solution stops; 1e5 N / 20 um of stiffness times rounding of 0.16 m leave 1e-7 N
LARGEST_SLIDE_M = 2e-3
START_M = 6e-5  # where the search for the ring begins, along the load
ITERATIONS, LONGEST_M, NUDGE_M = 60, 3e-5, 1e-9  # a ring that jumps clear of its rollers finds nothing to hold it
# The solutions share the geometry and differ by rounding of 1e-16 * 0.16 m at 5e7 N/m per point, below 1e-8 N each.
SAME_FORCE_N = 1e-4

STATIC = {
    "contact": {"static_friction": 0.0, "dynamic_friction": 0.0, "smoothing_width": "1e-13 m"},
    "shaft_speed": "1e-6 rpm",
}
CASES: dict[str, dict[str, Any]] = {
    "housing carries its part": {},
    "printed diameter": {"contact": {"roller_fit": "printed"}},
    "through the bearing alone": {"load": {"path": "bearing"}},
    "radial and axial, printed diameter": {
        "contact": {"roller_fit": "printed"},
        "load": {"axial": "49 kN", "path": "bearing", "direction": "-75 deg"},
    },
}


@dataclass
class Statics:
    """Rollers at rest in a cage held at `cage_rad`, inner ring fixed, outer ring displaced."""

    world: World
    cage_rad: float = 0.0

    def __post_init__(self) -> None:
        w = self.world
        angle = w.slot_angle + self.cage_rad
        tilt = w.g.tilt_rad
        self.slot = np.stack(
            [np.cos(tilt) * np.cos(angle), np.cos(tilt) * np.sin(angle), np.sin(tilt) * w.side], axis=1
        )
        self.axis = np.stack(
            [-np.sin(tilt) * w.side * np.cos(angle), -np.sin(tilt) * w.side * np.sin(angle), np.full(38, np.cos(tilt))],
            axis=1,
        )
        middle = w.g.pitch_radius_m / np.cos(tilt) * self.slot
        self.near = {
            (race, j): cloud.position[((cloud.position - middle[j]) ** 2).sum(axis=1) < 0.03**2]
            for race, cloud in w.clouds.items()
            for j in range(38)
        }
        self.middle = middle

    def force(self, race: str, j: int, slide: float, ring: FloatArray) -> FloatArray:
        """Force of one race's points on roller j [N]: K_c times penetration, along the barrel's normals."""
        points = self.near[race, j] + (ring if race == "outer" else 0.0)
        arm = points - self.middle[j] - slide * self.slot[j]
        along = arm @ self.axis[j]
        across = arm - along[:, None] * self.axis[j]
        rho = np.linalg.norm(across, axis=1)
        profile = self.world.g.raceway_radius_m
        to_arc = across * (1 + (profile - self.world.radius) / rho)[:, None] + along[:, None] * self.axis[j]
        distance = np.linalg.norm(to_arc, axis=1)
        spring = self.world.scene.contact.stiffness_n_m * np.maximum(profile - distance, 0.0)
        total: FloatArray = -(spring / distance) @ to_arc
        return total

    def slide(self, j: int, ring: FloatArray) -> float:
        """Where roller j rests between the races; midway in its gap where nothing presses it."""

        def along(slide: float) -> float:
            both = self.force("outer", j, slide, ring) + self.force("inner", j, slide, ring)
            return float(both @ self.slot[j])

        return float(brentq(along, -LARGEST_SLIDE_M, LARGEST_SLIDE_M, xtol=1e-16, rtol=1e-15))

    def on_ring(self, ring: FloatArray) -> FloatArray:
        """Force of each roller on the outer ring, [38, 3]."""
        return -np.array([self.force("outer", j, self.slide(j, ring), ring) for j in range(38)])

    def solve(self, start: FloatArray | None = None) -> FloatArray:
        """Displacement of the outer ring in balance with the load [m]: Newton's method with short steps.

        A `start` near the solution saves steps and nothing else: there is one solution.
        """
        load = self.world.external_load(0.0)

        def left(ring: FloatArray) -> FloatArray:
            balance: FloatArray = load - self.world.housing_stiffness() * ring + self.on_ring(ring).sum(axis=0)
            return balance

        ring: FloatArray = START_M * load / np.linalg.norm(load) if start is None else start
        for _ in range(ITERATIONS):
            balance = left(ring)
            if np.abs(balance).max() < SOLVED_N:
                return ring
            slope = np.array([left(ring + NUDGE_M * axis) - balance for axis in np.eye(3)]).T / NUDGE_M
            step = np.linalg.solve(slope, -balance)
            ring = ring + step * min(1.0, LONGEST_M / float(np.linalg.norm(step)))
        raise AssertionError(f"no static solution: {balance} N are left")


@pytest.mark.parametrize("name", CASES)
def test_static_solution_balances_the_model(name: str) -> None:
    """The model at rest in the solved position: no roller and no ring is pushed, and every roller carries its part."""
    scene = paper_scene(**merged(STATIC, CASES[name]))
    model, statics = parameters(scene), Statics(World(scene, geometry()))
    ring = statics.solve()
    carried = statics.on_ring(ring)
    y = rolling_state(model)
    where = layout_of(y)
    y[where.half :] = 0.0
    y[where.ring] = ring
    y[where.slide] = [statics.slide(j, ring) for j in range(where.rollers)]
    found = rates(model, 0.0, y)
    assert model.roller_mass * found.rate[where.slide_rate] == pytest.approx(0.0, abs=SAME_FORCE_N)
    assert model.ring_mass * found.rate[where.ring_rate] == pytest.approx(0.0, abs=SAME_FORCE_N * where.rollers)
    pressed = found.totals[col.RING_FORCE]
    for j in range(where.rollers):  # taking a roller away from the outer race takes its force off the ring
        without = y.copy()
        without[j] -= 1e-3
        left = rates(model, 0.0, without).totals[col.RING_FORCE]
        assert pressed - left == pytest.approx(carried[j], abs=SAME_FORCE_N)
    loaded = np.linalg.norm(carried, axis=1) > 1.0
    assert 5 <= loaded.sum() <= where.rollers
    total = carried.sum(axis=0) - statics.world.housing_stiffness() * ring
    assert total == pytest.approx(-statics.world.external_load(0.0), abs=SAME_FORCE_N * where.rollers)
