"""A rig of known path: pulses of a fault through it in both directions, over a background of its own."""

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import scipy.signal

from srbval.arrays import FloatArray
from srbval.bearing import Fault, load_bearing
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
TRUE = SensorPath(
    frequency_hz=tuple(10 ** (n / 10) for n in range(26, 36)), load=GAINS, cross=tuple(RATIO * one for one in GAINS),
    source="known",
)  # fmt: skip


@dataclass(frozen=True)
class SimulatedRig:
    """What an identification takes: an outer-race and an inner-race fault, each with the run that drives its path."""

    outer: Pair
    inner: Pair


def simulated_rig(
    seed: int, *, path: SensorPath = TRUE, noise: float = 0.02, missed_db: float = 0.0
) -> SimulatedRig:  # fmt: skip
    """Records with that `path`; their pulses differ by `missed_db` from the runs', in each band one line wide."""
    random = np.random.default_rng(seed)
    pairs = []
    for state in (Fault.OUTER, Fault.INNER):
        ring = np.column_stack([missed(random, one, missed_db) for one in pulses(random, state).T])
        record = record_of(state.code, state, behind(ring, path) + background(random, noise))
        pairs.append(Pair(record=record, run=run_with(state, pulses(random, state))))  # its own phase and slip
    return SimulatedRig(*pairs)


def pulses(random: np.random.Generator, state: Fault) -> FloatArray:
    """Accelerations [n, 3] of a ring that is struck once per passage, with slip of 0.3 % of the spacing.

    A defect of the inner race turns through the load zone, which reaches 90 degrees either way.
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


def missed(random: np.random.Generator, ring: FloatArray, scatter_db: float) -> FloatArray:
    """The ring's samples with another level in each band about a harmonic."""
    lines = np.fft.rfft(ring)
    band = np.round(np.fft.rfftfreq(ring.size, 1 / FS_HZ) / LINE_HZ).astype(int)
    return np.fft.irfft(lines * 10 ** (scatter_db * random.standard_normal(band[-1] + 1)[band] / 20), n=ring.size)


def background(random: np.random.Generator, noise: float) -> FloatArray:
    """Noise as the structure colours it."""
    return behind(noise * random.standard_normal((round(SECONDS * FS_HZ), 3)), replace(TRUE, cross=TRUE.load))


def behind(acceleration: FloatArray, path: SensorPath) -> FloatArray:
    """What a sensor behind the path shows of a ring under a load along -y, [n, 3] to [n]."""
    return SensorFilter(path, FS_HZ, -math.pi / 2).add(acceleration)


def record_of(name: str, state: Fault, samples: FloatArray) -> Recording:
    """A record of one channel, its samples means over their intervals as a run's are."""
    return Recording(
        name=name, origin=Origin.SIMULATED, channels={"a": samples}, channel="a", fs_hz=FS_HZ, unit="m/s2", state=state,
        speed=ShaftSpeed(value_hz=SHAFT_HZ, ci95_hz=0.001, source=SpeedSource.TACHOMETER),
    )  # fmt: skip


@cache
def _rolling(state: Fault) -> Run:
    changes = {"model": "kinematic", "defect": {"kind": state}, "shaft_speed": f"{60 * SHAFT_HZ} rpm",
               "duration": f"{SECONDS} s"}  # fmt: skip
    return simulate(load_scene("rig", changes), step=Step.UNCHECKED)


def run_with(state: Fault, acceleration: FloatArray) -> Run:
    """A run of pure rolling with these accelerations of its ring, [n, 3]."""
    return replace(_rolling(state), acceleration_m_s2=acceleration)


def rough_run(state: Fault, nm: float = 0.0, seed: int = 0) -> Run:
    """The rig scene with waves of that height."""
    changes = {"defect": {"kind": state, "extent_m": 2e-3}, "shaft_speed": f"{60 * SHAFT_HZ} rpm",
               "duration": f"{SECONDS} s", "seed": seed}  # fmt: skip
    if nm:
        changes["surface"] = {f"{body}_waviness_m": nm * 1e-9 for body in ("outer", "inner", "roller")}
    return simulate(load_scene("rig", changes), step=Step.UNCHECKED).require_usable("a rough rig's run")
