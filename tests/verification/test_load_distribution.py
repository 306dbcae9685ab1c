"""How the load spreads over the rollers, against a static solution of its own.

Reason: the load per roller decides penetrations, friction and the height of every impact. Source: minimum of elastic
energy, solved here by nested root finding from the point clouds of `world.py` (one slide per roller inside, the ring's
three displacements outside; scipy), without friction, smoothing or any kernel. The same roller in the limit of very
many points has a closed form (Hertz's problem for a bed of springs), which the static solution is held against in turn.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from srbval.models.full import columns as col
from tests.verification.harness import (
    PAPER_STEP_S,
    FloatArray,
    advance,
    geometry,
    layout_of,
    merged,
    paper_scene,
    parameters,
    rates,
    rolling_state,
)
from tests.verification.world import P, World, circle_profile

SOLVED_N = 1e-4  # where the nested solution stops; 1e5 N / 20 um of stiffness times rounding of 0.16 m leave 1e-7 N
LARGEST_SLIDE_M = 2e-3
START_M = 6e-5  # where the search for the ring begins, along the load
ITERATIONS, LONGEST_M, NUDGE_M = 60, 3e-5, 1e-9  # a ring that jumps clear of its rollers finds nothing to hold it
HEAVY_KG_M2 = 1e9  # a cage that stays where it is: without friction nothing else holds it
# The solutions share the geometry and differ by rounding of 1e-16 * 0.16 m at 5e7 N/m per point, below 1e-8 N each.
SAME_FORCE_N = 1e-4
# After 0.12 s the slowest swing is gone: the ring's along the shaft, where the rollers are softest and least damped.
SETTLING_STEPS = 7200
SUM_OF_CIRCLES = 2e-2  # normal forces of three circles are summed by size, the static solution's as vectors
SETTLED_M, SETTLED_N = 1e-10, 1.0
SPRING_BED = 0.02  # sums over 8 to 40 points per contact against integrals

STATIC = {
    "contact": {"static_friction": 0.0, "dynamic_friction": 0.0, "smoothing_width": "1e-13 m"},
    "shaft_speed": "1e-6 rpm",
    "housing": {"damping": "5e5 Ns/m"},  # the contacts alone would let the ring swing for seconds along the shaft
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


@pytest.mark.parametrize("name", CASES)
def test_settled_run_comes_to_the_static_solution(name: str) -> None:
    """A shaft that hardly turns: damping brings ring and rollers to rest where the static solution has them."""
    scene = paper_scene(**merged(STATIC, CASES[name]))
    model = parameters(scene)._replace(cage_axial=HEAVY_KG_M2, cage_transverse=HEAVY_KG_M2)
    y = rolling_state(model)
    where = layout_of(y)
    advance(model, y, step_s=PAPER_STEP_S, steps=SETTLING_STEPS)
    statics = Statics(World(scene, geometry()), float(y[where.cage][2]))
    ring = statics.solve(y[where.ring].copy())
    assert y[where.ring] == pytest.approx(ring, abs=SETTLED_M)
    found = rates(model, SETTLING_STEPS * PAPER_STEP_S, y)
    assert found.totals[col.RING_FORCE] == pytest.approx(statics.on_ring(ring).sum(axis=0), abs=SETTLED_N)
    per_roller = np.linalg.norm(statics.on_ring(ring), axis=1)
    assert found.load_n[0].sum(axis=1) == pytest.approx(per_roller, rel=SUM_OF_CIRCLES, abs=SETTLED_N)


def test_many_points_approach_a_bed_of_springs() -> None:
    """F = sum over circles of (K n / 2 pi R) (4/3) sqrt(2 rho) d^(3/2), 1/rho = 1/r - 1/R, for penetration d."""
    scene = paper_scene(
        **merged(STATIC, {"contact": {"points_per_circle": 8000, "stiffness": f"{5e7 * 500 / 8000} N/m"}})
    )
    statics = Statics(World(scene, geometry()))
    g, depth = geometry(), 3e-5
    gap = g.raceway_radius_m - statics.world.radius - float(np.linalg.norm(statics.middle[0]))
    found = np.linalg.norm(statics.force("outer", 0, gap + depth, np.zeros(3)))
    expected = 0.0
    for p in P:
        radius, *_ = circle_profile(g, "outer", p)
        lean = np.cos((p - 1) * g.tilt_rad)  # of the normal at the outer circles, and of the depth there
        rho = 1 / (1 / statics.world.radius - 1 / g.raceway_radius_m)
        density = scene.contact.stiffness_n_m * scene.contact.points_per_circle / (2 * np.pi * radius)
        expected += density * 4 / 3 * np.sqrt(2 * rho) * (depth * lean) ** 1.5 * lean
    assert found == pytest.approx(expected, rel=SPRING_BED)
