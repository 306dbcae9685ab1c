"""Force pulses at the passages of a defect, with random slip, load-zone modulation and one resonance.

McFadden & Smith (1984, J. Sound Vib. 96, 69: the paper's ref. 54) with slip as a process of stationary increments
(Antoni & Randall 2003, J. Vib. Acoust. 125, 282). Each pulse has the length and height that the defect has under a
roller at that angle of the load zone (see `srbval.models.planar.contacts`); the ring answers as a mass on housing and
contacts linearised about static balance.

If only the orders of a bearing are known, the frequencies of the lines alone are right: half-sine pulses of one length
act on the housing's mass and spring. Their height is the load of the rolling element that is struck, after Stribeck's
distribution at no clearance (Harris & Kotzalas, Essential Concepts of Bearing Technology, 2006, sect. 7.4).

Answers: where the lines are, harmonic pattern, sidebands and load-zone modulation, roughly the amplitude. Cannot
answer: slip of the cage (its mean is none), noise floor, the healthy bearing (it is silent), anything that a moving
ring does to the pulses, axial load.
"""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.models.kinematic import Prescribed, passages, prescribed_outputs, refuse_axial
from srbval.models.outputs import Outputs
from srbval.models.planar import ring_kernel
from srbval.models.planar.ring import PlanarRing, make_ring
from srbval.models.run_statistics import RunStatistics
from srbval.scene import Scene

MOST_AT_ONCE = 2_000_000  # samples of pulses worked on together
# For a bearing with known orders only:
PULSE_S = 5e-4  # up to 3 kHz is excited
LINE_CONTACT = 10 / 9
HIGHEST_SHARE = 4.08  # highest load in the mean load, line contact, no clearance


def run(stats: RunStatistics, settle: int, whole: int) -> Iterator[tuple[int, Outputs]]:
    """The model, see `srbval.models.hierarchy`."""
    motion = Prescribed(scene=stats.scene, orders=stats.bearing.orders)
    with stats.timed():
        acceleration = np.diff(_ring_velocity(stats, whole + 1), axis=0) * stats.scene.output_rate_hz
    return prescribed_outputs(stats, settle, motion, acceleration)


def _ring_velocity(stats: RunStatistics, samples: int) -> FloatArray:
    """Velocity of the ring, [samples, 2]."""
    scene = stats.scene
    if stats.bearing.geometry is None and stats.bearing.elements is None:
        own, force = scene.housing, _assumed_pulses(stats, samples)
        return _velocity(scene, own.mass_kg, own.stiffness_n_m * np.eye(2), own.damping_ns_m * np.eye(2), force)
    ring = make_ring(scene, stats.bearing)
    balance = ring.balance_m()
    force = np.zeros((samples, 2))
    for number in range(len(scene.defects)):
        of_defect = np.zeros((samples, 2))
        time_s, race, angle = _passages(scene, number, ring.motion, ring.kernel.rollers, samples)
        outwards = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        for table in (i for i, owner in enumerate(ring.defect_of) if owner == number):
            hit = race == ring.kernel.defects[table, ring_kernel.BUMP_KIND] % 2
            _add(ring, table, time_s[hit], outwards[hit], balance, of_defect)
        force += of_defect
    return _velocity(scene, ring.kernel.mass, ring.stiffness_n_m(balance), ring.damping_ns_m(balance), force)


def _passages(
    scene: Scene, number: int, motion: Prescribed, rolling_elements: int, samples: int
) -> tuple[FloatArray, NDArray[np.int64], FloatArray]:
    """Passages of defect `number`, [k]: times [s], race hit (0 outer, 1 inner), and angle around the bearing [rad]."""
    defect, random = scene.defects[number], np.random.default_rng([scene.seed, number])

    def jitter(count: int) -> FloatArray:
        return scene.slip_jitter * random.standard_normal(count)

    time_s, race = passages(defect, motion, rolling_elements, samples / scene.output_rate_hz, jitter)
    if defect.kind is Fault.ROLLER:
        angle = motion.cage_rad(time_s) + (defect.roller - 1) * 2 * math.pi / rolling_elements
    else:
        turned = motion.shaft_rad(time_s) if defect.kind is Fault.INNER else np.zeros(time_s.shape)
        angle = scene.load.zone_rad + defect.angle_rad + turned
    return time_s, race, angle


def _add(
    ring: PlanarRing, table: int, time_s: FloatArray, outwards: FloatArray, balance_m: FloatArray, force: FloatArray
) -> None:
    """Add the pulses of one defect on one race: what its table says at the approach and position of each sample."""
    if len(time_s) == 0:  # turning so slowly that none passes
        return
    rate, kernel = ring.scene.output_rate_hz, ring.kernel
    bumps, position_step = kernel.bumps[table], kernel.defects[table, ring_kernel.POSITION_STEP]
    at = np.clip((-outwards @ balance_m - kernel.bump_start) / kernel.bump_step, 0, len(bumps) - 1.001)
    below = at.astype(np.int64)
    share = (at - below)[:, None]
    pulse = (1 - share) * bumps[below] + share * bumps[below + 1]
    speed = ring.sweep_m_s(table, time_s)
    positions = pulse.shape[1] - 1
    half = int(np.ceil(position_step * positions / max(speed.min(), 1e-6) * rate)) + 1
    half = min(half, force.shape[0])
    if len(time_s) > 1 and len(time_s) * (2 * half + 1) > MOST_AT_ONCE:  # a slow passage makes all of them wide
        for part in (slice(None, len(time_s) // 2), slice(len(time_s) // 2, None)):
            _add(ring, table, time_s[part], outwards[part], balance_m, force)
        return
    sample = np.round(time_s * rate).astype(np.int64)[:, None] + np.arange(-half, half + 1)
    position = np.abs(sample / rate - time_s[:, None]) * speed[:, None] / position_step
    inside = (position < positions) & (sample >= 0) & (sample < force.shape[0])
    k = np.minimum(position.astype(np.int64), positions - 1)
    weight = position - k
    height = (1 - weight) * np.take_along_axis(pulse, k, 1) + weight * np.take_along_axis(pulse, k + 1, 1)
    for axis in range(2):
        np.add.at(force[:, axis], sample[inside], (height * outwards[:, axis, None])[inside])


def _assumed_pulses(stats: RunStatistics, samples: int) -> FloatArray:
    """Force of the half-sine pulses on the ring of a bearing with orders alone at each sample, [samples, 2]."""
    scene, bearing = stats.scene, stats.bearing
    refuse_axial(scene)
    motion = Prescribed(scene=scene, orders=bearing.orders)
    force, rate_hz = np.zeros((samples, 2)), scene.output_rate_hz
    half = math.ceil(PULSE_S / 2 * rate_hz) + 1
    for number in range(len(scene.defects)):
        time_s, _, angle = _passages(scene, number, motion, bearing.rolling_elements, samples)
        load_n = motion.radial_n(time_s) * HIGHEST_SHARE / bearing.rolling_elements
        strength = load_n * np.maximum(np.cos(angle - scene.load.zone_rad), 0.0) ** LINE_CONTACT
        height = strength[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
        sample = np.round(time_s * rate_hz).astype(np.int64)[:, None] + np.arange(-half, half + 1)
        away = (sample / rate_hz - time_s[:, None]) / PULSE_S
        inside = (np.abs(away) < 0.5) & (sample >= 0) & (sample < samples)
        for axis in range(2):
            np.add.at(force[:, axis], sample[inside], (np.cos(np.pi * away) * height[:, axis, None])[inside])
    return force


def _velocity(scene: Scene, mass: float, stiffness: FloatArray, damping: FloatArray, force: FloatArray) -> FloatArray:
    """Velocity under `force`, [n, 2]: `mass` on `stiffness` and `damping`, [2, 2], first-order hold.

    By the modes of the stiffness; what damping couples them is left out.
    """
    import scipy.signal

    velocity = np.zeros_like(force)
    for own, mode in zip(*np.linalg.eigh(stiffness), strict=True):
        a = np.array([[0.0, 1.0], [-own / mass, -(mode @ damping @ mode) / mass]])
        system = (a, np.array([[0.0], [1 / mass]]), np.array([[0.0, 1.0]]), np.zeros((1, 1)))
        discrete = scipy.signal.cont2discrete(system, 1 / scene.output_rate_hz, method="foh")
        above, below = scipy.signal.ss2tf(*discrete[:4])
        pushed = force @ mode
        velocity += scipy.signal.lfilter(above[0], below, pushed - pushed[0])[:, None] * mode
    return velocity
