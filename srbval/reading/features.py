"""Scalar features of one analysed channel: RMS, peak, crest factor, kurtosis, and the velocity that rates severity."""

import math
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.reading.analyse import Analysis
from srbval.recordings.units import ACCELERATION, DISPLACEMENT, VELOCITY
from srbval.signal import kurtosis

# Power of 2 pi f that makes a velocity of a unit, and the factor from there to m/s.
VELOCITIES = {ACCELERATION: (-1, 1.0), VELOCITY: (0, 1e-3), DISPLACEMENT: (1, 1e-6)}
HIGHEST_HZ = 1000.0
SLOW_RPM, SLOW_HZ, FAST_HZ = 600.0, 2.0, 10.0  # ISO 20816-3: from 2 Hz for machines slower than 600 rpm, else 10 Hz
LEAST_PERIODS = 10  # of the lowest frequency in the record, for its amplitude to mean something


def features_of(analysis: Analysis) -> dict[str, Any]:
    """Features of the channel analysed, without its mean; no RMS of velocity for the reason `velocity_missing`."""
    recording, done = analysis.recording, analysis.processed
    signal = done.scale * (done.whole - done.whole.mean())
    rms, peak = float(np.std(signal)), float(np.abs(signal).max())
    band_hz = (SLOW_HZ if 60 * analysis.speed.value_hz < SLOW_RPM else FAST_HZ, HIGHEST_HZ)
    missing = ""
    if recording.unit not in VELOCITIES:
        missing = f"the unit is {recording.unit}: state what the samples are (--unit, --scale, --sensitivity)"
    elif recording.fs_hz <= 2 * HIGHEST_HZ:
        missing = f"sampled at {recording.fs_hz:g} Hz the record does not hold the band to {HIGHEST_HZ:g} Hz"
    elif signal.size < LEAST_PERIODS * recording.fs_hz / band_hz[0]:
        missing = f"the record lasts {recording.seconds:.3g} s, less than {LEAST_PERIODS} periods of {band_hz[0]:g} Hz"
    return {
        "unit": recording.unit,
        "rms": rms,
        "peak": peak,
        "crest": peak / rms,
        "kurtosis": kurtosis(signal),
        "band_rms": done.scale * math.sqrt(float(np.mean(done.squared)) / 2),
        "velocity_rms_mm_s": None if missing else 1e3 * velocity_rms(signal, recording.fs_hz, band_hz, recording.unit),
        "velocity_band_hz": band_hz,
        "velocity_missing": missing,
    }


def velocity_rms(samples: FloatArray, fs_hz: float, band_hz: tuple[float, float], unit: str = ACCELERATION) -> float:
    """RMS of the velocity in a band [m/s] of samples, [n], in a `unit` of `VELOCITIES`.

    It is that of A(f) (2 pi f)^p under a Hann window; p is -1 for an acceleration.
    """
    window, (exponent, factor) = np.hanning(samples.size), VELOCITIES[unit]
    spectrum = np.fft.rfft(window * (samples - samples.mean()))
    frequency = np.fft.rfftfreq(samples.size, 1 / fs_hz)
    within = (frequency >= band_hz[0]) & (frequency <= band_hz[1])
    power = 2 * np.abs(spectrum[within] * (2 * math.pi * frequency[within]) ** exponent) ** 2
    return factor * math.sqrt(float(power.sum()) / samples.size / float((window**2).sum()))
