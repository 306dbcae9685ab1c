"""A synthetic record: a seeded stochastic impulse model.

Impacts at the fault's kinematic order (McFadden & Smith, Model for the vibration produced by a single
point defect in a rolling element bearing, J. Sound Vib. 96, 1984), their spacing a random walk of slip
(Antoni & Randall, A stochastic model for simulation and diagnostics of rolling element bearings with
localized faults, J. Vib. Acoust. 125, 2003), ringing one resonance, under noise.
"""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import DEFAULT_BEARING, Fault, FaultOrders, load_bearing
from srbval.recordings.load import load_recording
from srbval.recordings.recording import Recording
from srbval.scene import BANDS_HZ
from srbval.storage.hdf5_files import CHECKED, new_hdf5

FS_HZ = 20480.0  # the rig's
BAND_HZ = BANDS_HZ["1400-2800"]
RESONANCE_HZ = 2000.0
DAMPING_RATIO = 0.03
RING_S = 0.02  # the response has decayed to 5e-4 by then
SLIP_JITTER = 0.005  # standard deviation of one impact spacing, relative
SPEED_FLUCTUATION = 0.001  # standard deviation, relative
FLUCTUATION_S = 0.5  # correlation time of the speed fluctuation
IMPACT_M_S2 = 4.0
IMPACT_SPREAD = 0.2  # standard deviation of one impact's strength, relative
RATTLE_M_S2 = 0.6  # RMS of the resonance under random excitation, present in every state
NOISE_M_S2 = 0.8
LOAD_ZONE = 0.5  # load distribution factor of a bearing without play


def write_synthetic_record(
    path: str | Path, *, state: Fault, shaft_hz: float, seconds: float, seed: int, bearing: str = DEFAULT_BEARING
) -> Recording:
    """Write a record at `shaft_hz` [Hz] over `seconds` to `path` and read it back, of origin `Origin.STAND_IN`.

    The same seed writes the same samples.
    """
    from scipy.signal import lfilter

    rng = np.random.default_rng(seed)
    # a steady speed with a slow first-order random fluctuation
    correlation = math.exp(-1 / (FLUCTUATION_S * FS_HZ))
    start = rng.normal(0, SPEED_FLUCTUATION)
    steps = rng.normal(0, SPEED_FLUCTUATION * math.sqrt(1 - correlation**2), round(seconds * FS_HZ))
    fluctuation, _ = lfilter([1.0], [1.0, -correlation], steps, zi=[correlation * start])
    turns = np.concatenate(([0.0], np.cumsum(shaft_hz * (1 + fluctuation)[:-1]))) / FS_HZ
    signal = vibration(Fault(state), load_bearing(bearing).orders, turns, rng)
    attributes: dict[str, float | str] = {
        "srbval_kind": "stand-in",
        "name": f"SYNTHETIC STAND-IN {Fault(state).value} {shaft_hz * 60:.4g} rpm seed {seed}",
        "unit": "m/s2",
        "bearing": bearing,
        "state": Fault(state).value,
        "shaft_speed_hz": float(turns[-1] - turns[0]) * FS_HZ / (len(turns) - 1),
        "band_low_hz": BAND_HZ[0],
        "band_high_hz": BAND_HZ[1],
        "note": "SYNTHETIC STAND-IN: seeded stochastic impulse model, not a measurement",
    }
    variable = (signal, "m s-2", "synthetic stand-in acceleration")
    write_hdf5(Path(path), fs_hz=FS_HZ, variables={"acceleration_m_s2": variable}, attributes=attributes)
    return load_recording(path)


def vibration(state: Fault, orders: FaultOrders, turns: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Acceleration [m/s2], shape of `turns` (shaft turns at each sample), of a bearing in `state`."""
    from scipy.signal import fftconvolve

    ring = np.arange(math.ceil(RING_S * FS_HZ))
    noise = rng.normal(0, NOISE_M_S2, len(turns))
    rattle = fftconvolve(rng.normal(0, 1, len(turns)), _response(ring / FS_HZ))[: len(turns)]
    signal: FloatArray = noise + rattle * (RATTLE_M_S2 / np.std(rattle))
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


def _response(seconds: FloatArray) -> FloatArray:
    """Impulse response of the resonance, amplitude about 1, zero before the impact."""
    omega = 2 * math.pi * RESONANCE_HZ
    return np.where(seconds > 0, np.exp(-DAMPING_RATIO * omega * seconds) * np.sin(omega * seconds), 0.0)


def write_hdf5(
    path: Path,
    *,
    fs_hz: float,
    variables: Mapping[str, tuple[FloatArray, str, str]],
    attributes: Mapping[str, float | str],
) -> None:
    """Write variables over a common `time_s` scale, readable by xarray (engine ``h5netcdf``).

    `variables` by name: samples, shape [n], SI unit as text, and what it is. `attributes` are the file's own,
    ``srbval_kind``, ``name``, ``state``, ``bearing``, ``shaft_speed_hz`` and the rest; `schema_version` and `fs_hz` are
    added. Raises `DataError` where the place cannot be written.
    """
    (length,) = {len(values) for values, *_ in variables.values()}
    with new_hdf5(path) as file:
        file.attrs.update({"fs_hz": fs_hz, **attributes})
        time = file.create_dataset("time_s", data=np.arange(length) / fs_hz, **CHECKED)
        time.attrs.update({"units": "s", "long_name": "time"})
        time.make_scale("time_s")
        for name, (values, units, long_name) in variables.items():
            dataset = file.create_dataset(name, data=values, **CHECKED)
            dataset.dims[0].attach_scale(time)
            dataset.attrs.update({"units": units, "long_name": long_name})
