"""Run of the planar ring model: force tables, static balance, then integration in chunks."""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing, Fault
from srbval.errors import ConfigurationError
from srbval.models import outputs as col
from srbval.models.hierarchy import geometry_of
from srbval.models.kinematic import PrescribedMotion
from srbval.models.outputs import Outputs, split_run
from srbval.models.planar import ring_kernel
from srbval.models.planar.contacts import (
    DEFECT_STEPS,
    deepest_approach_m,
    make_element_slot,
    make_roller_slot,
    tabulate_bump,
    tabulate_force,
)
from srbval.models.planar.ring_kernel import STATE_SIZE, Motion, Ring, advance_ring
from srbval.models.run_statistics import RunStatistics, load_direction, load_share
from srbval.scene import LoadPath, Scene
from srbval.scene.parts import STANDARD_GRAVITY_M_S2

LONGEST_STEP_S = 1 / 40_000  # a fifth of a radian of the ring's highest mode, 40 steps over the shortest bump
RADIANS, STEPS_OF_PASSAGE = 0.2, 40  # the same for other bearings, which have higher modes and shorter defects
SPEEDS = 50  # times at which the passing speed is computed, to find the fastest
KERNEL_KIND = {  # kinds of a defect for the kernel; kind % 2 is the race, 0 outer, 1 inner
    Fault.OUTER: (ring_kernel.ON_OUTER,),
    Fault.INNER: (ring_kernel.ON_INNER,),
    Fault.ROLLER: (ring_kernel.ROLLER_ON_OUTER, ring_kernel.ROLLER_ON_INNER),
}
NO_MOTION = [col.ACCELERATION_Z, col.DISPLACEMENT_Z, col.CAGE_TILT_X, col.CAGE_TILT_Y, col.MEAN_RING_FORCE_Z]  # no tilt
BALANCE_STEPS = 60
RING_DIFFERENCE_M = 1e-8
LONGEST_MOVE_M = 2e-5
RING_BALANCE_N = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanarRing:
    """Planar ring model of a scene.

    `motion`: prescribed motion of shaft, cage and rollers; `kernel`: parameters of the integration; `defect_of`: for
    each row of `kernel.defects`, the index of its defect in `scene.defects`.
    """

    motion: PrescribedMotion
    defect_of: tuple[int, ...]
    kernel: Ring

    def sweep_m_s(self, table: int, time_s: FloatArray) -> FloatArray:
        """Compute at each `time_s` the speed with which contacts pass the defect in row `table` of `kernel.defects`."""
        defect, scene, orders = self.kernel.defects[table], self.motion.scene, self.motion.orders
        kind, cage = int(defect[ring_kernel.BUMP_KIND]), orders.ftf * (1 - scene.cage_slip)
        turns = (cage, 1 - cage, orders.bsf, orders.bsf)[kind]  # per turn of the shaft, by kind
        radius_m = defect[ring_kernel.RACE_RADIUS if kind < ring_kernel.ROLLER_ON_OUTER else ring_kernel.ROLLER_RADIUS]
        times, speeds, _ = scene.speed_table()
        return turns * radius_m * np.interp(time_s, times, speeds)

    @property
    def outwards(self) -> FloatArray:
        """Unit vectors from the bearing's centre to the rollers at time zero, [2, rollers]."""
        angle = np.arange(self.kernel.rollers) * 2 * np.pi / self.kernel.rollers
        return np.array([np.cos(angle), np.sin(angle)])

    def undamaged_force_n(self, ring_m: FloatArray) -> FloatArray:
        """Compute the force of all rollers, undamaged, on a ring displaced by `ring_m`: x and y [N]."""
        outwards = self.outwards
        return self.kernel.rows * outwards @ self.kernel.plain.at(-ring_m @ outwards)[ring_kernel.TABLE_FORCE]

    def stiffness_n_m(self, ring_m: FloatArray) -> FloatArray:
        """Compute the stiffness of undamaged rollers and housing at a ring displacement [N/m], [2, 2], symmetric."""
        here = self.undamaged_force_n(ring_m)
        moved = np.array([self.undamaged_force_n(ring_m + RING_DIFFERENCE_M * axis) for axis in np.eye(2)])
        contact = (here - moved) / RING_DIFFERENCE_M
        return self.kernel.stiffness * np.eye(2) + (contact + contact.T) / 2

    def damping_ns_m(self, ring_m: FloatArray) -> FloatArray:
        """Compute the damping of undamaged rollers and housing at a ring displacement [N s/m], [2, 2], symmetric."""
        outwards = self.outwards
        dampers = self.kernel.rows * self.kernel.plain.at(-ring_m @ outwards)[ring_kernel.TABLE_DAMPER]
        return self.kernel.damping * np.eye(2) + (outwards * dampers) @ outwards.T

    def balance_m(self) -> FloatArray:
        """Find the ring displacement [m] at which load, housing and undamaged rollers balance at time zero: x and y."""
        load = self.motion.radial_n(np.zeros(1))[0] * load_direction(self.motion.scene)[:2]
        load += np.array([0.0, self.kernel.weight])
        ring = np.zeros(2)
        for _ in range(BALANCE_STEPS):
            left = load + self.undamaged_force_n(ring) - self.kernel.stiffness * ring
            if np.abs(left).max() < RING_BALANCE_N:
                break
            step = np.linalg.solve(self.stiffness_n_m(ring) + 1e6 * np.eye(2), left)
            ring = ring + step * min(1.0, LONGEST_MOVE_M / float(np.linalg.norm(step)))
        return ring


def make_ring(scene: Scene, bearing: Bearing) -> PlanarRing:
    """Build the scene's planar ring; raises `ConfigurationError` for axial load, or a bearing without dimensions."""
    axial_n = scene.load_table()[2]
    if axial_n.any():
        raise ConfigurationError(
            f"axial load {max(axial_n, key=abs):g} N: the {scene.model} model has no axial motion: leave the axial "
            "load out, or use --model full with a bearing that has a [geometry]."
        )
    elements = bearing.elements
    if bearing.geometry is None and elements is not None:
        slot = make_element_slot(scene, elements)
        highest = sum(max(0.0, d.height_m) for d in scene.defects) + max(0.0, sum(slot.excess_m))
        plain = tabulate_force(slot, highest, deepest_approach_m(slot, scene, elements))
        rollers, of_rows, radius_m = elements.rolling_elements, elements.rows, elements.element_diameter_m / 2
        mass = scene.housing.mass_kg
    else:
        geometry = geometry_of(bearing, scene.model)
        slot = make_roller_slot(scene, geometry)
        highest = sum(abs(d.height_m) for d in scene.defects) + max(0.0, sum(slot.excess_m))
        plain = tabulate_force(slot, highest)
        rollers, of_rows = geometry.rollers_per_row, 2
        radius_m = slot.excess_m[0] + geometry.raceway_radius_m - geometry.roller_centre_distance_m
        mass = geometry.outer_ring_mass_kg(scene.bodies.density_kg_m3) + scene.housing.mass_kg
    rows, bumps, owners = [], [], []
    for number, defect in enumerate(scene.defects):
        for kind in KERNEL_KIND[defect.kind]:
            bump, race_radius_m, position_step_m = tabulate_bump(slot, plain, defect, kind % 2)
            fixed = defect.angle_rad + (0.0 if defect.kind is Fault.ROLLER else scene.load.zone_rad)
            rows.append([kind, fixed, defect.roller - 1, race_radius_m, position_step_m, radius_m])
            bumps.append(bump)
            owners.append(number)
    motion, (direction_x, direction_y, _) = PrescribedMotion(scene=scene, orders=bearing.orders), load_direction(scene)
    kernel = Ring(
        mass=mass,
        stiffness=scene.housing.stiffness_n_m if scene.load.path is LoadPath.HOUSING else 0.0,
        damping=scene.housing.damping_ns_m,
        weight=-mass * STANDARD_GRAVITY_M_S2 if scene.load.gravity else 0.0,
        direction_x=direction_x,
        direction_y=direction_y,
        rollers=rollers,
        rows=float(of_rows),
        plain=plain,
        defects=np.array(rows, dtype=np.float64).reshape(-1, ring_kernel.BUMP_COLUMNS),
        bumps=np.array(bumps) if bumps else np.zeros((0, 2, 2)),
        bump_step=DEFECT_STEPS * plain.step_m,
    )
    return PlanarRing(motion=motion, defect_of=tuple(owners), kernel=kernel)


def _longest_step_s(ring: PlanarRing, balance_m: FloatArray) -> float:
    """Compute the longest time step [s], at most `LONGEST_STEP_S`.

    In one step the ring's fastest vibration advances by 0.2 rad at most, and a contact by 1/40 of a defect's length.
    """
    softest = np.finfo(float).tiny
    mode = math.sqrt(max(float(np.linalg.eigvalsh(ring.stiffness_n_m(balance_m))[-1]), softest) / ring.kernel.mass)
    longest = min(LONGEST_STEP_S, RADIANS / mode)
    time_s = np.linspace(0.0, ring.motion.scene.settle_s + ring.motion.scene.duration_s, SPEEDS)
    for table, row in enumerate(ring.kernel.defects):
        length = 2 * row[ring_kernel.POSITION_STEP] * (ring.kernel.bumps.shape[2] - 1)
        fastest = max(float(ring.sweep_m_s(table, time_s).max()), softest)
        longest = min(longest, length / fastest / STEPS_OF_PASSAGE)
    return longest


def run_planar(stats: RunStatistics, settle: int, whole: int) -> Iterator[tuple[int, Outputs]]:
    """Run the planar ring model; arguments and result as in `srbval.models.hierarchy`."""
    scene, ring = stats.scene, make_ring(stats.scene, stats.bearing)
    y, rate, trial = np.zeros(STATE_SIZE), np.zeros((4, STATE_SIZE)), np.zeros(STATE_SIZE)
    with stats.timed():
        y[:2] = ring.balance_m()
        load = float(ring.motion.radial_n(np.zeros(1))[0])
        push = np.array([*(ring.kernel.stiffness * y[:2] - load * load_direction(scene)[:2]), 0.0])
        stats.figures["balanced_share"] = load_share(scene, push, load)
    longest_s = LONGEST_STEP_S if stats.bearing.geometry is not None else _longest_step_s(ring, y[:2])
    per_output = math.ceil(1 / (scene.output_rate_hz * longest_s))
    step = 1 / (scene.output_rate_hz * per_output)

    def take(first: int, count: int) -> FloatArray:
        out = np.full((count, col.COLUMN_COUNT), np.nan)
        out[:, NO_MOTION] = 0.0
        halves = (first * per_output + np.arange(2 * count * per_output + 1) / 2) * step
        motion = ring.motion
        cage = motion.cage_rad(halves)
        angles = Motion(cage, motion.shaft_rad(halves), motion.spin_rad(halves), motion.radial_n(halves))
        advance_ring(y, angles, step, ring.kernel, per_output, out, rate, trial)
        out[:, col.CAGE_SPEED] = np.diff(cage[:: 2 * per_output]) * scene.output_rate_hz
        return out

    started = time.perf_counter()
    take(0, 0)
    stats.compile_s += time.perf_counter() - started
    for first, count in split_run(settle, whole, 0, scene.output_rate_hz, per_output):
        with stats.timed():
            out = take(first, count)
        yield first, Outputs(out=out)
