"""The planar rung: tables, static balance, then integration in chunks."""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.models import outputs as col
from srbval.models.full.bodies import outer_ring_mass_kg
from srbval.models.full.parameters import STANDARD_GRAVITY, geometry_of
from srbval.models.kernel_cache import precompile
from srbval.models.outputs import Outputs
from srbval.models.planar import ring_kernel
from srbval.models.planar.ring_kernel import STATE, Motion, Ring, advance_ring
from srbval.models.planar.statics import DEFECT_STEP_M, Plain, bump_table, make_slot, plain_table
from srbval.models.prescribed import Prescribed, refuse_axial
from srbval.models.run_statistics import RunStatistics
from srbval.models.simulate import chunks
from srbval.scene import LoadPath, Scene

LONGEST_STEP_S = 1 / 40_000  # a fifth of a radian of the ring's highest mode, 40 steps over the shortest bump
KINDS = {
    (Fault.OUTER, 0): ring_kernel.ON_OUTER,
    (Fault.INNER, 1): ring_kernel.ON_INNER,
    (Fault.ROLLER, 0): ring_kernel.ROLLER_ON_OUTER,
    (Fault.ROLLER, 1): ring_kernel.ROLLER_ON_INNER,
}
NO_MOTION = [col.ACCELERATION_Z, col.DISPLACEMENT_Z, col.CAGE_TILT_X, col.CAGE_TILT_Y, col.RING_FORCE_Z]  # nor tilt
BALANCE_STEPS = 60
NUDGE_M = 1e-8
LONGEST_MOVE_M = 2e-5
BALANCED_N = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanarRing:
    """The ring as the `kernel` reads it; `defect_of`: which defect of the scene each of its `defects` is."""

    scene: Scene
    motion: Prescribed
    plain: Plain
    defect_of: tuple[int, ...]
    kernel: Ring

    def sweep_m_s(self, table: int, time_s: FloatArray) -> FloatArray:
        """Speed at which a roller's contact passes the defect of `table`."""
        step = 1e-4
        kind = int(self.kernel.defects[table, ring_kernel.KIND])
        after, before = time_s + step, time_s - step
        if kind not in (ring_kernel.ON_OUTER, ring_kernel.ON_INNER):
            turned = self.motion.spun_rad(after) - self.motion.spun_rad(before)
            return np.abs(turned) * self.kernel.defects[table, ring_kernel.ROLLER_RADIUS] / (2 * step)
        turned = self.motion.cage_rad(after) - self.motion.cage_rad(before)
        if kind == ring_kernel.ON_INNER:
            turned = turned - (self.motion.shaft_rad(after) - self.motion.shaft_rad(before))
        return np.abs(turned) * self.kernel.defects[table, ring_kernel.RACE_RADIUS] / (2 * step)

    def undamaged_force_n(self, ring_m: FloatArray, cage_rad: float = 0.0) -> FloatArray:
        """Force of both rows on the ring displaced by `ring_m`, [2], without defects."""
        angle = cage_rad + np.arange(self.kernel.rollers) * 2 * np.pi / self.kernel.rollers
        outwards = np.array([np.cos(angle), np.sin(angle)])
        force: FloatArray = 2 * outwards @ self.plain.force_n(-ring_m @ outwards)
        return force

    def balance_m(self) -> FloatArray:
        """Ring displacement, [2], at which load, housing and undamaged rollers balance at time zero."""
        load = self.motion.radial_n(np.zeros(1))[0] * self.motion.direction + np.array([0.0, self.kernel.weight])

        def left(ring: FloatArray) -> FloatArray:
            return load + self.undamaged_force_n(ring) - self.kernel.stiffness * ring

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
    rows, bumps, owners = [], [], []
    for number, defect in enumerate(scene.defects):
        for race in [race for kind, race in KINDS if kind is defect.kind]:
            bump, position_step_m = bump_table(slot, plain, defect, race)
            fixed = defect.angle_rad + (0.0 if defect.kind is Fault.ROLLER else scene.load.zone_rad)
            radius = slot.excess_m[0] + geometry.raceway_radius_m - geometry.roller_centre_distance_m
            race_radius = slot.patches[race][defect.circle - 1].race_radius_m
            rows.append([KINDS[defect.kind, race], fixed, defect.roller - 1, race_radius, position_step_m, radius])
            bumps.append(bump)
            owners.append(number)
    motion = Prescribed(scene=scene, orders=stats.bearing.orders)
    mass = outer_ring_mass_kg(geometry, scene.bodies.density_kg_m3) + scene.housing.mass_kg
    kernel = Ring(
        mass=mass,
        stiffness=scene.housing.stiffness_n_m if scene.load.path is LoadPath.HOUSING else 0.0,
        damping=scene.housing.damping_ns_m,
        weight=-mass * STANDARD_GRAVITY if scene.load.gravity else 0.0,
        direction_x=motion.direction[0], direction_y=motion.direction[1], rollers=geometry.rollers_per_row,
        plain=plain.values, plain_start=plain.start_m, plain_step=plain.step_m,
        defects=np.array(rows, dtype=np.float64).reshape(-1, ring_kernel.DEFECT_COLUMNS),
        bumps=np.array(bumps) if bumps else np.zeros((0, 2, 2)), bump_start=plain.start_m, bump_step=DEFECT_STEP_M,
    )  # fmt: skip
    return PlanarRing(scene=scene, motion=motion, plain=plain, defect_of=tuple(owners), kernel=kernel)


def run(stats: RunStatistics, settle: int, whole: int) -> Iterator[tuple[int, Outputs]]:
    """The rung, see `srbval.models.ladder`."""
    scene, ring = stats.scene, make_ring(stats)
    stats.compile_s = precompile(scene.model)
    started = time.perf_counter()
    y, rate, trial = np.zeros(STATE), np.zeros((4, STATE)), np.zeros(STATE)
    y[:2] = ring.balance_m()
    load = float(ring.motion.radial_n(np.zeros(1))[0])
    push = np.array([*(ring.kernel.stiffness * y[:2] - load * ring.motion.direction), 0.0])
    stats.balanced_share = stats.load_share(push, load)
    stats.wall_s += time.perf_counter() - started
    per_output = math.ceil(1 / (scene.output_rate_hz * LONGEST_STEP_S))
    step = 1 / (scene.output_rate_hz * per_output)

    def take(first: int, count: int) -> FloatArray:
        out = np.full((count, col.COUNT), np.nan)
        out[:, NO_MOTION] = 0.0
        halves = (first * per_output + np.arange(2 * count * per_output + 1) / 2) * step
        motion = ring.motion
        cage = motion.cage_rad(halves)
        angles = Motion(cage, motion.shaft_rad(halves), motion.spun_rad(halves), motion.radial_n(halves))
        advance_ring(y, angles, step, ring.kernel, per_output, out, rate, trial)
        out[:, col.CAGE_SPEED] = np.diff(cage[:: 2 * per_output]) * scene.output_rate_hz
        return out

    started = time.perf_counter()
    take(0, 0)
    stats.compile_s += time.perf_counter() - started
    for first, count in chunks(settle, whole, 0, scene.output_rate_hz, per_output):
        started = time.perf_counter()
        out = take(first, count)
        stats.wall_s += time.perf_counter() - started
        yield first, Outputs(out=out)
