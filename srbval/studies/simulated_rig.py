"""A rig of known path: pulses of a fault through it, over a background that has resonances of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.signal

from srbval.arrays import FloatArray
from srbval.bearing import Fault, load_bearing
from srbval.models.sensor import SensorFilter, along_sensor
from srbval.models.simulate import Step, simulate
from srbval.recordings import Origin, Recording, ShaftSpeed, SpeedSource
from srbval.scene import PathMode, SensorPath, load_scene

FS_HZ, SECONDS, SHAFT_HZ = 20480.0, 2.0, 14.3
BEARING = load_bearing("skf-22240")
LINE_HZ = BEARING.orders.bpfo * SHAFT_HZ
TRUE = SensorPath(
    direct=0.7, low_hz=400.0, high_hz=3150.0, source="known",
    modes=(PathMode(frequency_hz=880.0, damping_ratio=0.06, gain=0.35),
           PathMode(frequency_hz=1650.0, damping_ratio=0.04, gain=0.5)),
)  # fmt: skip


@dataclass(frozen=True)
class SimulatedRig:
    """The three records that an identification takes."""

    fault: Recording
    healthy: Recording
    excitation: Recording


def simulated_rig(
    seed: int, *, path: SensorPath = TRUE, noise: float = 0.02, size: float = 1.0, missed_db: float = 0.0
) -> SimulatedRig:
    """Records with that `path`; the true pulses are `size` times those of the simulated ring.

    Their levels differ from those by `missed_db` more, at random in each band one line wide.
    """
    random = np.random.default_rng(seed)
    ring = pulses(random)
    own_noise = [background(random, noise) for _ in range(2)]
    shown = SensorFilter(path, FS_HZ).add(size * missed(random, ring, missed_db))
    simulated = pulses(random)  # the model's own phase and slip
    return SimulatedRig(
        fault=record("OR", Fault.OUTER, shown + own_noise[0]),
        healthy=record("H", Fault.HEALTHY, own_noise[1]),
        excitation=record("simulated", Fault.OUTER, simulated),
    )


def pulses(random: np.random.Generator) -> FloatArray:
    """Accelerations of a ring that is struck once per passage, with slip of 0.3 % of the spacing."""
    train = np.zeros(round(SECONDS * FS_HZ))
    times = random.uniform(0, 1 / LINE_HZ) + np.cumsum(1 + 0.003 * random.standard_normal(400)) / LINE_HZ
    train[(times[times < SECONDS] * FS_HZ).astype(int)] = 1.0
    shape = np.diff(scipy.signal.windows.hann(9))  # a force of half a millisecond, as a change of velocity
    return np.convolve(train, 30 * shape)[: train.size]


def missed(random: np.random.Generator, ring: FloatArray, scatter_db: float) -> FloatArray:
    """The ring's samples with another level in each band about a harmonic."""
    lines = np.fft.rfft(ring)
    band = np.round(np.fft.rfftfreq(ring.size, 1 / FS_HZ) / LINE_HZ).astype(int)
    return np.fft.irfft(lines * 10 ** (scatter_db * random.standard_normal(band[-1] + 1)[band] / 20), n=ring.size)


def background(random: np.random.Generator, noise: float) -> FloatArray:
    """Noise through two modes of the structure."""
    path = SensorPath(direct=1.0, low_hz=400.0, high_hz=3150.0, source="background", modes=TRUE.modes)
    return SensorFilter(path, FS_HZ).add(noise * random.standard_normal(round(SECONDS * FS_HZ)))


def record(name: str, state: Fault, samples: FloatArray) -> Recording:
    """A record of one channel."""
    return Recording(
        name=name, origin=Origin.STAND_IN, channels={"a": samples}, channel="a", fs_hz=FS_HZ, unit="m/s2", state=state,
        speed=ShaftSpeed(value_hz=SHAFT_HZ, ci95_hz=0.001, source=SpeedSource.TACHOMETER),
    )  # fmt: skip


def ring(state: Fault, nm: float = 0.0, seed: int = 0, size: float = 1.0) -> FloatArray:
    """Accelerations of the rig scene's ring with waves of that height, its hole `size` times as large."""
    changes = {"defect": {"kind": state, "extent_m": size * 2e-3}, "shaft_speed": f"{60 * SHAFT_HZ} rpm",
               "duration": f"{SECONDS} s", "seed": seed}  # fmt: skip
    if nm:
        changes["surface"] = {f"{body}_waviness_m": nm * 1e-9 for body in ("outer", "inner", "roller")}
    run = simulate(load_scene("rig", changes), step=Step.UNCHECKED)
    assert run.status.usable, run.reason
    return along_sensor(run.acceleration_m_s2)


def behind(run: Recording, random: np.random.Generator, noise: float) -> Recording:
    """What the sensor shows of it behind the true path, with noise."""
    shown = SensorFilter(TRUE, FS_HZ).add(run.channels["a"])
    return replace(run, channels={"a": shown + background(random, noise)})
