"""Synthetic records for the Monte-Carlo bench of reading: combs with slip in noise, and noise only; reading them."""

import math

import numpy as np

from srbval.arrays import FloatArray
from srbval.signal import LineReading, Periodogram, frequency_error_hz, read_comb

FS_HZ = 2000.0
SHAFT_HZ = 71 / 6  # 710 rpm
LINE_HZ = 96.79  # the 22240's BPFO at that speed: none of five harmonics coincides with one of the shaft's
LIMIT_HZ = 520.0
# The window about the kinematic line, how far off its middle the true line lies, and the shortest block of a course.
HALF_SHARE, OFF_SHARE = 0.01, 0.001
BLOCK_S = 2 / SHAFT_HZ
MEAN = 3.0  # a squared envelope is positive
# Amplitudes of the harmonics: all equal, and decreasing as those of a short burst do.
PROFILES = {"equal": (1.0,) * 5, "falling": (1.0, 1 / 2, 1 / 3, 1 / 4, 1 / 5)}
COLOUR_POLE = 0.9  # first-order noise: power falls by a factor 300 over the band, by a third over five lines' reach


def comb_record(
    rng: np.random.Generator, seconds: float, *, snr_db: float, jitter: float, amplitudes: tuple[float, ...]
) -> FloatArray:
    """A line and its harmonics in white noise, [FS_HZ seconds].

    Periods scatter independently by `jitter` (relative, one standard deviation), so that the phase is a random walk.
    The first harmonic's power over the mean noise power of a bin is `snr_db`.
    """
    time_s = np.arange(round(seconds * FS_HZ)) / FS_HZ
    impacts = round(seconds * LINE_HZ * (1 + 10 * jitter)) + 20
    at_s = np.cumsum(1 + jitter * rng.standard_normal(impacts)) / LINE_HZ
    at_s = np.concatenate(([0.0], at_s)) - (1 + rng.random()) / LINE_HZ
    phase = 2 * math.pi * np.interp(time_s, at_s, np.arange(impacts + 1))
    signal = sum(a * np.cos(h * phase + rng.uniform(0, 2 * math.pi)) for h, a in enumerate(amplitudes, 1))
    sigma = math.sqrt(time_s.size / 4 / 10 ** (snr_db / 10))
    record: FloatArray = MEAN + signal + sigma * rng.standard_normal(time_s.size)
    return record


def noise_record(rng: np.random.Generator, seconds: float, *, coloured: bool) -> FloatArray:
    """Gaussian noise, white or of first order, [FS_HZ seconds]."""
    noise = rng.standard_normal(round(seconds * FS_HZ))
    if coloured:
        import scipy.signal

        noise = scipy.signal.lfilter([1.0], [1.0, -COLOUR_POLE], noise)
    record: FloatArray = MEAN + noise
    return record


def cramer_rao_hz(seconds: float, snr_db: float, amplitudes: tuple[float, ...]) -> float:
    """Cramer-Rao bound of the standard error of the line's frequency [Hz], noise being the only cause."""
    information = 10 ** (snr_db / 10) * sum((h * a) ** 2 for h, a in enumerate(amplitudes, 1))
    return frequency_error_hz(information, seconds)


def periodogram_of(record: FloatArray) -> Periodogram:
    """The periodogram that every reading starts from."""
    return Periodogram.of(record, FS_HZ, limit_hz=LIMIT_HZ, shaft_hz=SHAFT_HZ)


def read_record(record: FloatArray, harmonics: int = 5) -> LineReading | None:
    """Read the line, in a search window that is not centred on it."""
    middle = LINE_HZ * (1 + OFF_SHARE)
    return read_comb(
        periodogram_of(record), middle, HALF_SHARE * LINE_HZ, harmonics=harmonics, shortest_block_s=BLOCK_S
    )
