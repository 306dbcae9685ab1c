"""Quantities by which runs are compared: cage over shaft speed, noise floor of the envelope, RMS in a band."""

import math

import numpy as np
import scipy.fft

from srbval.arrays import FloatArray
from srbval.models.run import Run
from srbval.models.sensor import hann
from srbval.reading.pipeline import SIMULATED_BAND_HZ, process
from srbval.recordings import recording_from_run

FLOOR_HZ = (60.0, 90.0)  # below BPFO and BPFI; contains multiples of the shaft speed only
BAND_NAME = "{:g}-{:g}".format(*SIMULATED_BAND_HZ)  # name of the band in `Run.band_rms_m_s2`
MIN_SECONDS_FOR_FLOOR = 0.3  # shortest record with a noise floor


def measure(run: Run) -> dict[str, float | None]:
    """Compute cage over shaft speed, noise floor of the envelope spectrum, and RMS in 500-1500 Hz of a complete run.

    The envelope is computed as for a recording; its noise floor is None for runs under `MIN_SECONDS_FOR_FLOOR`.
    """
    floor = None
    if run.seconds >= MIN_SECONDS_FOR_FLOOR:
        processed = process(recording_from_run(run), band_hz=SIMULATED_BAND_HZ)
        floor = noise_floor(processed.envelope, processed.fs_hz)
    ratio = smooth_mean(run.cage_rad_s) / (2 * math.pi * run.scene.shaft_hz)
    return {"cage_ratio": ratio, "noise_floor": floor, "band_rms_m_s2": run.band_rms_m_s2[BAND_NAME]}


def smooth_mean(values: FloatArray) -> float:
    """Mean of `values`, shape [n], weighted by a Hann window.

    With the window, the error due to roller passages falls with their number k as 1/k^3 instead of 1/k.
    """
    return float(np.average(values, weights=hann(values.size)))


def noise_floor(envelope: FloatArray, fs_hz: float) -> float:
    """Median amplitude of an envelope's spectrum between 60 and 90 Hz, divided by the envelope's mean.

    At the speed of the scene `paper`, this range is below BPFO and BPFI. A Hann window limits the leakage of strong
    lines; the spectrum is scaled so that white noise has the same level as without a window. Compare records of equal
    length only: broadband noise falls with the root of length.
    """
    window, mean = hann(envelope.size), float(envelope.mean())
    lines = np.abs(np.asarray(scipy.fft.rfft((envelope - mean) * window)))
    frequency = np.arange(lines.size) * fs_hz / envelope.size
    inside = (frequency >= FLOOR_HZ[0]) & (frequency <= FLOOR_HZ[1])
    as_plain = 2 / math.sqrt(envelope.size * float((window**2).sum()))
    return float(np.median(lines[inside])) * as_plain / mean
