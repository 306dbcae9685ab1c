"""Measures by which runs are compared: cage speed, noise floor of the envelope, vibration in the band."""

import math
from dataclasses import dataclass

import numpy as np
import scipy.fft

from srbval.arrays import FloatArray
from srbval.models.run import Run
from srbval.models.sensor import hann
from srbval.reading.pipeline import SIMULATED_BAND_HZ, process
from srbval.recordings import recording_from_run

FLOOR_HZ = (60.0, 90.0)  # below BPFO and BPFI, above nothing but multiples of the shaft speed
BAND_NAME = "{:g}-{:g}".format(*SIMULATED_BAND_HZ)  # name of the band among those of a run
MIN_SECONDS_FOR_FLOOR = 0.3  # shortest record of which the pipeline finds a noise floor


@dataclass(frozen=True, kw_only=True)
class RunMeasures:
    """A run in a few numbers.

    `cage_ratio`: mean cage over shaft speed, see `smooth_mean`; `noise_floor`: see the function, None for a record that
    is too short; `band_rms_m_s2`: along the sensor's axis, see `Run.band_rms_m_s2`.
    """

    cage_ratio: float
    noise_floor: float | None
    band_rms_m_s2: float


def measure(run: Run) -> RunMeasures:
    """Measure a run that lasted to its end; the noise floor through the pipeline of every recording."""
    floor = None
    if run.seconds >= MIN_SECONDS_FOR_FLOOR:
        processed = process(recording_from_run(run), band_hz=SIMULATED_BAND_HZ)
        floor = noise_floor(processed.envelope, processed.fs_hz)
    ratio = smooth_mean(run.cage_rad_s) / (2 * math.pi * run.scene.shaft_hz)
    return RunMeasures(cage_ratio=ratio, noise_floor=floor, band_rms_m_s2=run.band_rms_m_s2[BAND_NAME])


def smooth_mean(values: FloatArray) -> float:
    """Mean of `values` [n] under a Hann window.

    The cage's ripple at roller passing leaves 1/n in a plain mean of n periods, 1/n^3 in this one.
    """
    return float(np.average(values, weights=hann(values.size)))


def noise_floor(envelope: FloatArray, fs_hz: float) -> float:
    """Median height of an envelope's spectrum between 60 and 90 Hz over the envelope's mean.

    A Hann window keeps the leakage of strong lines beside the range below the floor of a clean run; heights are scaled
    so that white noise has the same as in a plain amplitude spectrum. Broadband noise falls with the square root of the
    record's length: compare equal durations only.
    """
    window, mean = hann(envelope.size), float(envelope.mean())
    lines = np.abs(np.asarray(scipy.fft.rfft((envelope - mean) * window)))
    frequency = np.arange(lines.size) * fs_hz / envelope.size
    inside = (frequency >= FLOOR_HZ[0]) & (frequency <= FLOOR_HZ[1])
    as_plain = 2 / math.sqrt(envelope.size * float((window**2).sum()))
    return float(np.median(lines[inside])) * as_plain / mean
