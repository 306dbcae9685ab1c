"""The impulse rung of a bearing whose raceways are not known: places of pulses are right, their strength is assumed.

Half-sine pulses of one length, on a housing of its own mass and spring. Their height is the load of the rolling element
that is struck, after Stribeck's distribution at no clearance (Harris & Kotzalas, Essential Concepts of Bearing
Technology, 2006, sect. 7.4), with the exponent of line contact. Contacts add no stiffness.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import Fault
from srbval.models.passages import passages
from srbval.models.prescribed import Prescribed, refuse_axial
from srbval.models.run_statistics import RunStatistics
from srbval.scene import Defect

FloatArray = NDArray[np.float64]

PULSE_S = 5e-4  # up to 3 kHz is excited
LINE_CONTACT = 10 / 9
HIGHEST_SHARE = 4.08  # of the load over the number of elements, line contact, no clearance


def plain_force(stats: RunStatistics, samples: int) -> FloatArray:
    """Force of all pulses on the ring at each sample, [samples, 2]."""
    scene, bearing = stats.scene, stats.bearing
    refuse_axial(scene)
    motion = Prescribed(scene=scene, orders=bearing.orders)
    seconds = samples / scene.output_rate_hz
    force = np.zeros((samples, 2))
    for number, defect in enumerate(scene.defects):
        random = np.random.default_rng([scene.seed, number])
        most = int(seconds * scene.shaft_hz * 4 * bearing.rolling_elements) + 1000
        jitter = scene.slip_jitter * random.standard_normal(most)
        hits = passages(defect, motion, bearing.rolling_elements, scene.load.zone_rad, seconds, jitter)
        angle = _where(defect, motion, bearing.rolling_elements, hits.time_s)
        away = np.cos(angle - scene.load.zone_rad)
        load_n = motion.radial_n(hits.time_s) * HIGHEST_SHARE / bearing.rolling_elements
        strength = load_n * np.maximum(away, 0.0) ** LINE_CONTACT
        _add(force, hits.time_s, strength[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1), scene.output_rate_hz)
    return force


def _where(defect: Defect, motion: Prescribed, elements: int, time_s: FloatArray) -> FloatArray:
    """Angle around the bearing at which the defect is at each time [rad]."""
    if defect.kind is Fault.ROLLER:
        return motion.cage_rad(time_s) + (defect.roller - 1) * 2 * math.pi / elements
    turned = motion.shaft_rad(time_s) if defect.kind is Fault.INNER else np.zeros(time_s.shape)
    return motion.scene.load.zone_rad + defect.angle_rad + turned


def _add(force: FloatArray, time_s: FloatArray, height: FloatArray, rate_hz: float) -> None:
    half = math.ceil(PULSE_S / 2 * rate_hz) + 1
    sample = np.round(time_s * rate_hz).astype(np.int64)[:, None] + np.arange(-half, half + 1)
    away = (sample / rate_hz - time_s[:, None]) / PULSE_S
    inside = (np.abs(away) < 0.5) & (sample >= 0) & (sample < force.shape[0])
    shape = np.cos(np.pi * away)
    for axis in range(2):
        np.add.at(force[:, axis], sample[inside], (shape * height[:, axis, None])[inside])
