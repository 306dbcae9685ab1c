"""The impulse rung: all pulses of a run, then one linear filter."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import Fault
from srbval.models.chunk import COLUMNS, Chunk
from srbval.models.impulse.plain import plain_force
from srbval.models.passages import passages
from srbval.models.planar.rung import NUDGE_M, PlanarRing, make_ring
from srbval.models.prescribed import Prescribed
from srbval.models.run_statistics import RunStatistics
from srbval.models.simulate import chunks
from srbval.scene import Scene

FloatArray = NDArray[np.float64]


def run(stats: RunStatistics, settle: int, whole: int) -> Iterator[tuple[int, Chunk]]:
    """The rung, see `srbval.models.ladder`."""
    started = time.perf_counter()
    rate = stats.scene.output_rate_hz
    motion = Prescribed(scene=stats.scene, orders=stats.bearing.orders)
    out = np.full((whole, COLUMNS), np.nan)
    out[:, :2] = np.diff(_ring_velocity(stats, whole + 1), axis=0) * rate
    out[:, 2] = 0.0
    out[:, 6] = np.diff(motion.cage_rad(np.arange(whole + 1) / rate)) * rate
    stats.wall_s += time.perf_counter() - started
    for first, count in chunks(settle, whole, 0, rate):
        yield first, Chunk(out=out[first : first + count])


def _ring_velocity(stats: RunStatistics, samples: int) -> FloatArray:
    """Velocity of the ring, [samples, 2]; without the raceways' geometry as `plain` has it."""
    scene = stats.scene
    if stats.bearing.geometry is None:
        stiffness = scene.housing.stiffness_n_m * np.eye(2)
        return _velocity(scene, scene.housing.mass_kg, stiffness, plain_force(stats, samples))
    ring = make_ring(stats)
    balance = ring.balance_m()
    force = np.zeros((samples, 2))
    for number in range(len(scene.defects)):
        force += _pulses(ring, number, balance, samples)
    here = ring.undamaged_force_n(balance)
    contact = -np.array([ring.undamaged_force_n(balance + NUDGE_M * axis) - here for axis in np.eye(2)]) / NUDGE_M
    stiffness = ring.stiffness_n_m * np.eye(2) + (contact + contact.T) / 2
    return _velocity(scene, ring.mass_kg, stiffness, force)


def _pulses(ring: PlanarRing, number: int, balance_m: FloatArray, samples: int) -> FloatArray:
    """Force of defect `number` on the ring at each sample, [samples, 2], the ring held at `balance_m`."""
    scene, motion, rate = ring.scene, ring.motion, ring.scene.output_rate_hz
    defect = scene.defects[number]
    random = np.random.default_rng([scene.seed, number])
    jitter = scene.slip_jitter * random.standard_normal(int(samples / rate * ring.passing_hz) + 1000)
    hits = passages(defect, motion, ring.rollers, scene.load.zone_rad, samples / rate, jitter)
    angle = _where(ring, number, hits.time_s)
    outwards = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    force = np.zeros((samples, 2))
    tables = [i for i in range(len(ring.defects)) if ring.defect_of[i] == number]
    for table in tables:
        hit = hits.race == ring.defects[table, 0] % 2
        _add(ring, table, hits.time_s[hit], outwards[hit], balance_m, force)
    return force


def _where(ring: PlanarRing, number: int, time_s: FloatArray) -> FloatArray:
    """Angle around the bearing at which the defect is at each time [rad]."""
    defect, zone = ring.scene.defects[number], ring.scene.load.zone_rad
    if defect.kind is Fault.ROLLER:
        return ring.motion.cage_rad(time_s) + (defect.roller - 1) * 2 * np.pi / ring.rollers
    turned = ring.motion.shaft_rad(time_s) if defect.kind is Fault.INNER else np.zeros(time_s.shape)
    return zone + defect.angle_rad + turned


def _add(
    ring: PlanarRing, table: int, time_s: FloatArray, outwards: FloatArray, balance_m: FloatArray, force: FloatArray
) -> None:
    """Add the pulses of one defect on one race: what its table says at the approach and place of each sample."""
    rate = ring.scene.output_rate_hz
    at = np.clip((-outwards @ balance_m - ring.bump_start_m) / ring.bump_step_m, 0, ring.bumps.shape[1] - 1.001)
    below = at.astype(np.int64)
    share = (at - below)[:, None]
    pulse = (1 - share) * ring.bumps[table, below] + share * ring.bumps[table, below + 1]
    speed = ring.sweep_m_s(table, time_s)
    places = pulse.shape[1] - 1
    half = int(np.ceil(ring.defects[table, 4] * places / max(speed.min(), 1e-6) * rate)) + 1
    half = min(half, force.shape[0])
    sample = np.round(time_s * rate).astype(np.int64)[:, None] + np.arange(-half, half + 1)
    place = np.abs(sample / rate - time_s[:, None]) * speed[:, None] / ring.defects[table, 4]
    inside = (place < places) & (sample >= 0) & (sample < force.shape[0])
    k = np.minimum(place.astype(np.int64), places - 1)
    weight = place - k
    height = (1 - weight) * np.take_along_axis(pulse, k, 1) + weight * np.take_along_axis(pulse, k + 1, 1)
    for axis in range(2):
        np.add.at(force[:, axis], sample[inside], (height * outwards[:, axis, None])[inside])


def _velocity(scene: Scene, mass: float, stiffness: FloatArray, force: FloatArray) -> FloatArray:
    """Velocity under `force`, [n, 2]: `mass` on `stiffness`, [2, 2], and the housing's damper, first-order hold."""
    import scipy.signal

    damping = scene.housing.damping_ns_m
    velocity = np.zeros_like(force)
    for own, mode in zip(*np.linalg.eigh(stiffness), strict=True):
        a = np.array([[0.0, 1.0], [-own / mass, -damping / mass]])
        system = (a, np.array([[0.0], [1 / mass]]), np.array([[0.0, 1.0]]), np.zeros((1, 1)))
        discrete = scipy.signal.cont2discrete(system, 1 / scene.output_rate_hz, method="foh")
        above, below = scipy.signal.ss2tf(*discrete[:4])
        pushed = force @ mode
        velocity += scipy.signal.lfilter(above[0], below, pushed - pushed[0])[:, None] * mode
    return velocity
