"""Impulse model: force pulses at the passages of a defect, with random slip, load-zone modulation and one resonance.

Method of McFadden & Smith (1984, J. Sound Vib. 96, 69); slip is a process of stationary increments
(Antoni & Randall 2003, J. Vib. Acoust. 125, 282). A pulse is the contact force between a roller and the defect, which
depends on the defect's angle in the load zone (see `srbval.models.planar.contacts`). The ring responds as a mass on the
springs of housing and contacts, linearised about static balance.

The model computes frequencies of the fault lines, pattern of their harmonics, sidebands, modulation by the load zone,
and roughly the amplitude. It does not contain: mean slip of the cage (prescribed), noise floor, vibration of a healthy
bearing (the signal is zero), effects of the ring's motion on the pulses, axial load.
"""

import math
from collections.abc import Iterator

import numpy as np
from scipy.linalg import expm

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.models.kinematic import passage_times, prescribed_outputs
from srbval.models.outputs import Outputs
from srbval.models.planar import ring_kernel
from srbval.models.planar.ring import PlanarRing, make_ring
from srbval.models.run_statistics import RunStatistics
from srbval.scene import Scene

MOST_AT_ONCE = 2_000_000  # samples of pulses computed together


def run_impulse(stats: RunStatistics, settle: int, whole: int) -> Iterator[tuple[int, Outputs]]:
    """Run the impulse model; arguments as in `srbval.models.hierarchy`."""
    scene, samples = stats.scene, whole + 1
    with stats.timed():
        ring = make_ring(scene, stats.bearing)
        balance, force = ring.balance_m(), np.zeros((samples, 2))
        motion, rollers = ring.motion, ring.kernel.rollers
        for number, defect in enumerate(scene.defects):
            random = np.random.default_rng([scene.seed, number])
            time_s, race = passage_times(defect, motion, rollers, samples / scene.output_rate_hz, random)
            if defect.kind is Fault.ROLLER:
                angle = motion.cage_rad(time_s) + (defect.roller - 1) * 2 * math.pi / rollers
            else:
                turned = motion.shaft_rad(time_s) if defect.kind is Fault.INNER else np.zeros(time_s.shape)
                angle = scene.load.zone_rad + defect.angle_rad + turned
            outwards = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
            for table in (i for i, owner in enumerate(ring.defect_of) if owner == number):
                hit = race == ring.kernel.defects[table, ring_kernel.BUMP_KIND] % 2
                _add_pulses(ring, table, time_s[hit], outwards[hit], balance, force)
        stiffness, damping = ring.stiffness_n_m(balance), ring.damping_ns_m(balance)
        velocity = _move_mass(scene, ring.kernel.mass, stiffness, damping, force)
        acceleration = np.diff(velocity, axis=0) * scene.output_rate_hz
    return prescribed_outputs(stats, settle, ring.motion, acceleration)


def _add_pulses(
    ring: PlanarRing, table: int, time_s: FloatArray, outwards: FloatArray, balance_m: FloatArray, force: FloatArray
) -> None:
    """Add the force pulses of one defect on one race to `force` [N], [samples, 2].

    `table`: index in `ring.kernel.bumps` of the table of the force over the approach of roller and race and over the
    distance from the defect's middle; `time_s`: passage times; `outwards`: unit vectors from the bearing's centre to
    the roller at these times; `balance_m`: displacement of the ring in static balance.
    """
    if len(time_s) == 0:  # the shaft is so slow that no roller passes
        return
    rate, kernel = ring.motion.scene.output_rate_hz, ring.kernel
    bumps, position_step = kernel.bumps[table], kernel.defects[table, ring_kernel.POSITION_STEP]
    at = np.clip((-outwards @ balance_m - kernel.plain.start_m) / kernel.bump_step, 0, len(bumps) - 1.001)
    below = at.astype(np.int64)
    share = (at - below)[:, None]
    pulse = (1 - share) * bumps[below] + share * bumps[below + 1]
    speed = ring.sweep_m_s(table, time_s)
    positions = pulse.shape[1] - 1
    half = min(int(np.ceil(position_step * positions / max(speed.min(), 1e-6) * rate)) + 1, force.shape[0])
    if len(time_s) > 1 and len(time_s) * (2 * half + 1) > MOST_AT_ONCE:  # one slow passage makes all pulses long
        for part in (slice(None, len(time_s) // 2), slice(len(time_s) // 2, None)):
            _add_pulses(ring, table, time_s[part], outwards[part], balance_m, force)
        return
    sample = np.round(time_s * rate).astype(np.int64)[:, None] + np.arange(-half, half + 1)
    position = np.abs(sample / rate - time_s[:, None]) * speed[:, None] / position_step
    inside = (position < positions) & (sample >= 0) & (sample < force.shape[0])
    k = np.minimum(position.astype(np.int64), positions - 1)
    weight = position - k
    height = (1 - weight) * np.take_along_axis(pulse, k, 1) + weight * np.take_along_axis(pulse, k + 1, 1)
    for axis in range(2):
        np.add.at(force[:, axis], sample[inside], (height * outwards[:, axis, None])[inside])


def _move_mass(scene: Scene, mass: float, stiffness: FloatArray, damping: FloatArray, force: FloatArray) -> FloatArray:
    """Velocity [m/s], [n, 2], of a mass on a spring and a damper (2 x 2 matrices) under a `force` of n samples, [n, 2].

    The force is linear between samples (first-order hold; Franklin, Powell & Workman, Digital Control of Dynamic
    Systems, 3rd ed., pp. 204-206). Each mode is computed alone: coupling by damping is neglected.
    """
    velocity, rate_hz, count = np.zeros_like(force), scene.output_rate_hz, len(force)
    for own, mode in zip(*np.linalg.eigh(stiffness), strict=True):
        # rates of displacement, velocity, force and the force's change in a sample, over the sampling rate
        motion = [[0.0, 1.0, 0.0, 0.0], [-own / mass, -(mode @ damping @ mode) / mass, 1 / mass, 0.0]]
        sample = expm(np.array([*motion, [0.0, 0.0, 0.0, rate_hz], [0.0] * 4]) / rate_hz)
        moved, held, risen = sample[:2, :2], sample[:2, 2], sample[:2, 3]
        # displacement and velocity after a force of 1 N in one sample, twice as long in every round
        after = (held - risen + moved @ risen)[:, None]
        while after.shape[1] < count:
            after, moved = np.hstack([after, moved @ after]), moved @ moved
        pushed, response = force @ mode, np.append(risen[1], after[1])[:count]
        spectrum = np.fft.rfft(pushed - pushed[0], 2 * count) * np.fft.rfft(response, 2 * count)
        velocity += np.fft.irfft(spectrum, 2 * count)[:count, None] * mode
    return velocity
