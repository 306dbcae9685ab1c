"""The planar rung: tables, static balance, then integration in chunks."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import Fault
from srbval.models.chunk import COLUMNS, Chunk
from srbval.models.full.bodies import outer_ring_mass_kg
from srbval.models.full.parameters import STANDARD_GRAVITY
from srbval.models.kernel_cache import precompile
from srbval.models.planar.statics import Slot, geometry_of, make_slot, races_of
from srbval.models.planar.tables import Bump, Plain, bump_table, plain_table
from srbval.models.prescribed import Prescribed, refuse_axial
from srbval.models.run_statistics import RunStatistics
from srbval.models.simulate import chunks
from srbval.scene import LoadPath, Scene

FloatArray = NDArray[np.float64]

LONGEST_STEP_S = 1 / 40_000  # a fifth of a radian of the ring's highest mode, 40 steps over the shortest bump
KINDS = {
    (Fault.OUTER, 0): 0.0,
    (Fault.INNER, 1): 1.0,
    (Fault.ROLLER, 0): 2.0,
    (Fault.ROLLER, 1): 3.0,
}
BALANCE_STEPS = 60
NUDGE_M = 1e-8
LONGEST_MOVE_M = 2e-5
BALANCED_N = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanarRing:
    """Everything the kernel needs: see `ring_kernel.push` for `defects` and `bumps`; `defect_of`: whose each is."""

    scene: Scene
    motion: Prescribed
    slot: Slot
    rollers: int
    mass_kg: float
    stiffness_n_m: float
    plain: Plain
    defects: FloatArray
    defect_of: tuple[int, ...]
    bumps: FloatArray
    bump_start_m: float
    bump_step_m: float

    @property
    def passing_hz(self) -> float:
        """An upper bound of the rate at which rollers pass anything."""
        profile = self.scene.speed_profile
        fastest = self.scene.shaft_speed_rad_s if profile is None else max(profile.speed_rad_s)
        orders = self.motion.orders
        return max(orders.bpfi, orders.bpfo, 2 * orders.bsf) * fastest / (2 * math.pi)

    def sweep_m_s(self, table: int, time_s: FloatArray) -> FloatArray:
        """Speed at which a roller's contact passes the defect of `table`."""
        step = 1e-4
        kind = int(self.defects[table, 0])
        after, before = time_s + step, time_s - step
        if kind > 1:
            turned = self.motion.spun_rad(after) - self.motion.spun_rad(before)
            return np.abs(turned) * self.defects[table, 5] / (2 * step)
        turned = self.motion.cage_rad(after) - self.motion.cage_rad(before)
        if kind == 1:
            turned = turned - (self.motion.shaft_rad(after) - self.motion.shaft_rad(before))
        return np.abs(turned) * self.defects[table, 3] / (2 * step)

    @property
    def weight_n(self) -> float:
        """Weight of ring and housing mass along y, where the scene has gravity."""
        return -self.mass_kg * STANDARD_GRAVITY if self.scene.load.gravity else 0.0

    def undamaged_force_n(self, ring_m: FloatArray, cage_rad: float = 0.0) -> FloatArray:
        """Force of both rows on the ring displaced by `ring_m`, [2], without defects."""
        angle = cage_rad + np.arange(self.rollers) * 2 * np.pi / self.rollers
        outwards = np.array([np.cos(angle), np.sin(angle)])
        force: FloatArray = 2 * outwards @ self.plain.force_n(-ring_m @ outwards)
        return force

    def balance_m(self) -> FloatArray:
        """Ring displacement, [2], at which load, housing and undamaged rollers balance at time zero."""
        load = self.motion.radial_n(np.zeros(1))[0] * self.motion.direction + np.array([0.0, self.weight_n])

        def left(ring: FloatArray) -> FloatArray:
            return load + self.undamaged_force_n(ring) - self.stiffness_n_m * ring

        ring = np.zeros(2)
        for _ in range(BALANCE_STEPS):
            now = left(ring)
            if np.abs(now).max() < BALANCED_N:
                break
            stiffness = -np.array([left(ring + NUDGE_M * axis) - now for axis in np.eye(2)]).T / NUDGE_M
            step = np.linalg.solve(stiffness + 1e6 * np.eye(2), now)
            ring = ring + step * min(1.0, LONGEST_MOVE_M / float(np.linalg.norm(step)))
        return ring


def make_ring(stats: RunStatistics) -> PlanarRing:
    """The scene's planar ring; `ConfigurationError` for an axial load or a bearing without geometry."""
    scene = stats.scene
    refuse_axial(scene)
    geometry = geometry_of(stats.bearing, scene.model)
    slot = make_slot(scene, geometry)
    plain = plain_table(slot, sum(abs(d.height_m) for d in scene.defects))
    rows, tables, owners = [], [], []
    for number, defect in enumerate(scene.defects):
        for race in races_of(defect):
            table = bump_table(slot, plain, defect, race=race)
            patch = (slot.outer, slot.inner)[race][defect.circle - 1]
            fixed = defect.angle_rad + (0.0 if defect.kind is Fault.ROLLER else scene.load.zone_rad)
            radius = slot.outer_excess_m + geometry.raceway_radius_m - geometry.roller_centre_distance_m
            rows.append(
                [KINDS[defect.kind, race], fixed, defect.roller - 1, patch.race_radius_m, table.place_m, radius]
            )
            tables.append(table)
            owners.append(number)
    return PlanarRing(
        scene=scene,
        motion=Prescribed(scene=scene, orders=stats.bearing.orders),
        slot=slot,
        rollers=geometry.rollers_per_row,
        mass_kg=outer_ring_mass_kg(geometry, scene.bodies.density_kg_m3) + scene.housing.mass_kg,
        stiffness_n_m=scene.housing.stiffness_n_m if scene.load.path is LoadPath.HOUSING else 0.0,
        plain=plain,
        defects=np.array(rows, dtype=np.float64).reshape(-1, 6),
        defect_of=tuple(owners),
        bumps=_stacked(tables),
        bump_start_m=tables[0].start_m if tables else 0.0,
        bump_step_m=tables[0].step_m if tables else 1.0,
    )


def _stacked(tables: list[Bump]) -> FloatArray:
    return np.array([table.values for table in tables]) if tables else np.zeros((0, 2, 2))


def run(stats: RunStatistics, settle: int, whole: int) -> Iterator[tuple[int, Chunk]]:
    """The rung, see `srbval.models.ladder`."""
    scene, ring = stats.scene, make_ring(stats)
    stats.compile_s = precompile(scene.model)
    from srbval.models.planar.ring_kernel import STATE, advance_ring

    started = time.perf_counter()
    y, rate, trial, found = np.zeros(STATE), np.zeros((4, STATE)), np.zeros(STATE), np.zeros(3)
    y[:2] = ring.balance_m()
    load = float(ring.motion.radial_n(np.zeros(1))[0])
    push = np.array([*(ring.stiffness_n_m * y[:2] - load * ring.motion.direction), 0.0])
    stats.balanced_share = stats.load_share(push, load)
    stats.wall_s += time.perf_counter() - started
    per_output = math.ceil(1 / (scene.output_rate_hz * LONGEST_STEP_S))
    step = 1 / (scene.output_rate_hz * per_output)

    def take(first: int, count: int) -> FloatArray:
        out = np.full((count, COLUMNS), np.nan)
        out[:, [2, 5, 7, 8, 11]] = 0.0  # no axial motion, no tilt
        halves = (first * per_output + np.arange(2 * count * per_output + 1) / 2) * step
        motion = ring.motion
        cage = motion.cage_rad(halves)
        advance_ring(
            y, cage, motion.shaft_rad(halves), motion.spun_rad(halves), motion.radial_n(halves), step, ring.mass_kg,
            ring.stiffness_n_m, scene.housing.damping_ns_m, *motion.direction, ring.weight_n, ring.rollers,
            ring.plain.values, ring.plain.start_m, ring.plain.step_m, ring.defects, ring.bumps, ring.bump_start_m,
            ring.bump_step_m, per_output, out, rate, trial, found,
        )  # fmt: skip
        out[:, 6] = np.diff(cage[:: 2 * per_output]) * scene.output_rate_hz
        return out

    started = time.perf_counter()
    take(0, 0)
    stats.compile_s += time.perf_counter() - started
    for first, count in chunks(settle, whole, 0, scene.output_rate_hz):
        started = time.perf_counter()
        out = take(first, count)
        stats.wall_s += time.perf_counter() - started
        yield first, Chunk(out=out)
