"""A rig with a known path: pulses of a fault behind it in both directions, over a background."""

import math
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
import scipy.signal

from srbval.arrays import FloatArray
from srbval.bearing import Fault, load_bearing
from srbval.models import outputs
from srbval.models.run import Run
from srbval.models.sensor import SensorFilter
from srbval.models.simulate import Step, simulate
from srbval.path.identify import Pair
from srbval.recordings import Origin, Recording, ShaftSpeed, SpeedSource
from srbval.scene import SensorPath, load_scene

FS_HZ, SECONDS, SHAFT_HZ = 20480.0, 2.0, 14.3
BEARING = load_bearing("skf-22240")
LINE_HZ = BEARING.orders.bpfo * SHAFT_HZ
GAINS = (0.5, 0.7, 1.0, 1.8, 1.2, 0.9, 2.0, 1.4, 0.8, 0.6)  # of third octaves from 398 to 3162 Hz
RATIO = 4.0  # of cross to load
MIDDLES_HZ = tuple(10 ** (n / 10) for n in range(26, 36))
TRUE = SensorPath(frequency_hz=MIDDLES_HZ, load=GAINS, cross=tuple(RATIO * one for one in GAINS), source="known")


class SimulatedRig(NamedTuple):
    """Input of an identification: an outer-race and an inner-race fault, each with the run that drives its path."""

    outer: Pair
    inner: Pair


def simulated_rig(seed: int, *, noise: float = 0.02) -> SimulatedRig:
    """Records behind the path `TRUE`, and runs with pulses that differ from the records' in phase and slip alone."""
    random, pairs = np.random.default_rng(seed), []
    for state in (Fault.OUTER, Fault.INNER):
        record = record_of(state.code, state, behind(pulses(random, state), TRUE) + background(random, noise))
        pairs.append(Pair(record=record, run=run_with(state, pulses(random, state))))
    return SimulatedRig(*pairs)


def pulses(random: np.random.Generator, state: Fault) -> FloatArray:
    """Accelerations [n, 3] of a ring with one pulse per passage and slip of 0.3 % of the spacing.

    A defect of the inner race turns through the load zone, which reaches 90 degrees to either side.
    """
    rate_hz = state.line_order(BEARING.orders) * SHAFT_HZ
    times = random.uniform(0, 1 / rate_hz) + np.cumsum(1 + 0.003 * random.standard_normal(400)) / rate_hz
    times = times[times < SECONDS]
    angle = 2 * math.pi * SHAFT_HZ * times if state is Fault.INNER else np.zeros(times.size)
    strength = np.maximum(np.cos(angle), 0.0)
    train = np.zeros((round(SECONDS * FS_HZ), 3))
    at = (times * FS_HZ).astype(int)
    train[at, 0], train[at, 1] = strength * np.sin(angle), -strength * np.cos(angle)  # the load pushes along -y
    shape = 30 * np.diff(scipy.signal.windows.hann(9))  # a force of half a millisecond, as a change of velocity
    return scipy.signal.oaconvolve(train, shape[:, None], axes=0)[: len(train)]


def background(random: np.random.Generator, noise: float) -> FloatArray:
    """Noise behind the path."""
    return behind(noise * random.standard_normal((round(SECONDS * FS_HZ), 3)), replace(TRUE, cross=TRUE.load))


def behind(acceleration: FloatArray, path: SensorPath) -> FloatArray:
    """Signal [n] of a sensor behind the path, from the accelerations [n, 3] of a ring under a load along -y."""
    return SensorFilter(path, FS_HZ, -math.pi / 2).add(acceleration)


def record_of(name: str, state: Fault, samples: FloatArray) -> Recording:
    """A record of one channel whose samples are means over their intervals, as those of a run."""
    speed = ShaftSpeed(value_hz=SHAFT_HZ, ci95_hz=0.001, source=SpeedSource.TACHOMETER)
    own = {"name": name, "state": state, "speed": speed, "channels": {"a": samples}, "channel": "a"}
    return Recording(origin=Origin.SIMULATED, interval_means=True, fs_hz=FS_HZ, unit="m/s2", **own)


@cache
def _rolling(state: Fault) -> Run:
    changes = {"defect": {"kind": state}, "shaft_speed": f"{60 * SHAFT_HZ} rpm", "duration": f"{SECONDS} s"}
    return simulate(load_scene("rig", {"model": "kinematic"} | changes), step=Step.UNCHECKED)


def run_with(state: Fault, acceleration: FloatArray) -> Run:
    """A run of pure rolling with these accelerations of its ring, [n, 3]."""
    run = _rolling(state)
    out = run.out.copy()
    out[:, outputs.ACCELERATION_XYZ] = acceleration
    return replace(run, out=out)
