"""Synthetic records: combs (lines with harmonics) of known frequency, and backgrounds without a bearing fault."""

import math

import numpy as np
import scipy.signal

from srbval.arrays import FloatArray
from srbval.signal import Periodogram, frequency_error_hz

Rng = np.random.Generator
SHAFT_HZ, LINE_HZ = 71 / 6, 96.79  # 710 rpm and BPFO of the 22240: no harmonic coincides with one of the shaft's
COMB_RATE_HZ, MEAN = 2000.0, 3.0  # a squared envelope is positive
AMPLITUDES = (1.0, 1 / 2, 1 / 3, 1 / 4, 1 / 5)  # harmonics of a short burst

RATE_HZ, SECONDS, MACHINE_HZ = 12_000.0, 5.0, 29.95  # of the backgrounds; MACHINE_HZ is the shaft's speed
TIME_S = np.arange(round(RATE_HZ * SECONDS)) / RATE_HZ


def comb(rng: Rng, seconds: float, snr_db: float, jitter: float) -> Periodogram:
    """Periodogram of a squared envelope with a line at `LINE_HZ` and its harmonics in white noise.

    The periods scatter independently with the relative standard deviation `jitter`, so that the phase is a random walk.
    `snr_db` is the power of the first harmonic over the mean noise power of a bin.
    """
    time_s = np.arange(round(seconds * COMB_RATE_HZ)) / COMB_RATE_HZ
    impacts = round(seconds * LINE_HZ * (1 + 10 * jitter)) + 20
    at_s = np.cumsum(1 + jitter * rng.standard_normal(impacts)) / LINE_HZ
    at_s = np.concatenate(([0.0], at_s)) - (1 + rng.random()) / LINE_HZ
    phase = 2 * math.pi * np.interp(time_s, at_s, np.arange(impacts + 1))
    signal = sum(a * np.cos(h * phase + rng.uniform(0, 2 * math.pi)) for h, a in enumerate(AMPLITUDES, 1))
    sigma = math.sqrt(time_s.size / 4 / 10 ** (snr_db / 10))
    samples = MEAN + signal + sigma * rng.standard_normal(time_s.size)
    return Periodogram.of(samples, COMB_RATE_HZ, limit_hz=520.0, shaft_hz=SHAFT_HZ)


def bound_hz(seconds: float, snr_db: float) -> float:
    """Least standard error [Hz] of the comb's frequency due to noise alone: the Cramer-Rao bound."""
    information = 10 ** (snr_db / 10) * sum((h * a) ** 2 for h, a in enumerate(AMPLITUDES, 1))
    return frequency_error_hz(information, seconds)


def white(rng: Rng) -> FloatArray:
    """White noise of unit standard deviation, as long as a record."""
    return rng.standard_normal(TIME_S.size)


def modulated(rng: Rng) -> FloatArray:
    """White noise modulated at five multiples each of a belt's rate and of the speed of the bearing's shaft."""
    rates_hz = (rng.uniform(4, 14), MACHINE_HZ)
    combs = (1 + sum(rng.uniform(0, 0.5) / h * _tone(rng, h * hz) for h in range(1, 6)) for hz in rates_hz)
    return np.asarray(white(rng) * math.prod(combs))


def foreign(rng: Rng) -> FloatArray:
    """Impacts of another bearing, exciting a resonance, in white noise; their spacing jitters by one per cent."""
    hz = rng.uniform(2, 9) * MACHINE_HZ * rng.uniform(0.3, 1.7)
    at_s = np.cumsum(1 + 0.01 * rng.standard_normal(round(1.2 * SECONDS * hz))) / hz
    at, train = (at_s[at_s < SECONDS] * RATE_HZ).astype(int), np.zeros(TIME_S.size)
    np.add.at(train, at, rng.uniform(3, 20) * (1 + 0.2 * rng.standard_normal(at.size)))
    resonance = scipy.signal.iirpeak(rng.uniform(1500, 5000) / (RATE_HZ / 2), 8)
    return np.asarray(white(rng) + scipy.signal.lfilter(*resonance, train))


def bursts(rng: Rng) -> FloatArray:
    """White noise, plus noise whose power rises and falls at a rate between 5 and 150 Hz."""
    rise = np.exp(rng.uniform(0.3, 2) * _tone(rng, rng.uniform(5, 150)))
    return np.asarray(white(rng) * rise / rise.mean() + 0.5 * white(rng))


BACKGROUNDS = {one.__name__: one for one in (white, modulated, foreign, bursts)}


def _tone(rng: Rng, hz: float) -> FloatArray:
    return np.asarray(np.cos(2 * np.pi * (hz * TIME_S + rng.random())))
