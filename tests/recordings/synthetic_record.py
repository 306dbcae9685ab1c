"""Synthetic record from a seeded stochastic impulse model.

Impacts at the fault's kinematic order (McFadden & Smith, Model for the vibration produced by a single point defect in a
rolling element bearing, J. Sound Vib. 96, 1984) excite one resonance under noise. Slip makes their spacing a random
walk (Antoni & Randall, A stochastic model for simulation and diagnostics of rolling element bearings with localized
faults, J. Vib. Acoust. 125, 2003).
"""

import math
from dataclasses import replace

import numpy as np
from scipy.signal import fftconvolve

from srbval.bearing import DEFAULT_BEARING, Fault, load_bearing
from srbval.recordings import Origin, Recording
from srbval.recordings.speed import prescribed_speed
from srbval.storage.hdf5_files import CHECKED, new_hdf5

FS_HZ = 20480.0  # the rig's
RESONANCE_HZ = 2000.0
DAMPING_RATIO = 0.03
RING_S = 0.02  # the response has decayed to 5e-4 by then
SLIP_JITTER = 0.005  # standard deviation of one impact spacing, relative
IMPACT_M_S2 = 4.0
IMPACT_SPREAD = 0.2  # standard deviation of one impact's strength, relative
RATTLE_M_S2 = 0.6  # RMS of the resonance under random excitation, present in every state
NOISE_M_S2 = 0.8
LOAD_ZONE = 0.5  # load distribution factor of a bearing without play


def write_synthetic_record(path, *, state=Fault.OUTER, shaft_hz=14.3, seconds, seed=1):
    """Write a record at a steady speed in srbval's own format, with origin `Origin.STAND_IN`."""
    turns = np.arange(round(seconds * FS_HZ)) / FS_HZ * shaft_hz
    signal = vibration(state, load_bearing(DEFAULT_BEARING).orders, turns, np.random.default_rng(seed))
    stated = {"fs_hz": FS_HZ, "unit": "m/s2", "bearing": DEFAULT_BEARING, "state": state, "band_hz": (1400.0, 2800.0)}
    known = {"name": "SYNTHETIC", "origin": Origin.STAND_IN, "speed": prescribed_speed(shaft_hz)}
    with new_hdf5(path) as file:
        file.attrs.update(replace(Recording.from_array(signal, **stated), **known).facts())
        file.create_dataset("signal", data=signal, **CHECKED)


def vibration(state, orders, turns, rng):
    """Acceleration [m/s2] of a bearing in `state`, at the shaft angles `turns` [revolutions] of the samples."""
    ring = np.arange(math.ceil(RING_S * FS_HZ))
    noise = rng.normal(0, NOISE_M_S2, len(turns))
    rattle = fftconvolve(rng.normal(0, 1, len(turns)), _response(ring / FS_HZ))[: len(turns)]
    signal = noise + rattle * (RATTLE_M_S2 / np.std(rattle))
    if state is Fault.HEALTHY:
        return signal
    order, carrier = state.line_order(orders), state.sideband_order(orders)
    gaps = rng.normal(1, SLIP_JITTER, math.ceil(turns[-1] * order * (1 + 10 * SLIP_JITTER)) + 2) / order
    at_turns = rng.uniform(0, 1 / order) + np.cumsum(gaps)
    at_turns = at_turns[at_turns < turns[-1]]
    # Stribeck's load distribution over the defect's position, 0 in the direction of the load
    load = np.maximum(1 - (1 - np.cos(2 * np.pi * (carrier * at_turns))) / (2 * LOAD_ZONE), 0) ** (10 / 9)
    strength = np.abs(rng.normal(1, IMPACT_SPREAD, len(at_turns))) * load * IMPACT_M_S2
    at = np.interp(at_turns, turns, np.arange(len(turns)))
    index = np.ceil(at).astype(np.int64)[:, None] + ring  # the ringing is sampled exactly at fractional times
    ringing = strength[:, None] * _response((index - at[:, None]) / FS_HZ)
    inside = index < len(signal)
    np.add.at(signal, index[inside], ringing[inside])
    return signal


def _response(seconds):
    """Impulse response of the resonance at times [s]; amplitude about 1, zero before the impact."""
    omega = 2 * math.pi * RESONANCE_HZ
    return np.where(seconds > 0, np.exp(-DAMPING_RATIO * omega * seconds) * np.sin(omega * seconds), 0.0)
