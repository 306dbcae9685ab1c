"""Synthetic records: combs whose frequency is known, and backgrounds without a fault of the bearing."""

import math
from collections.abc import Callable

import numpy as np
import scipy.signal

from srbval.arrays import FloatArray

Rng = np.random.Generator
SHAFT_HZ, LINE_HZ = 71 / 6, 96.79  # 710 rpm and BPFO of the 22240: no harmonic coincides with one of the shaft's
COMB_RATE_HZ, MEAN = 2000.0, 3.0  # a squared envelope is positive
AMPLITUDES = (1.0, 1 / 2, 1 / 3, 1 / 4, 1 / 5)  # harmonics of a short burst
COLOUR_POLE = 0.9  # of first-order noise: its power falls by a factor of 300 over the band

RATE_HZ, SECONDS, MACHINE_HZ = 12_000.0, 5.0, 29.95  # of the backgrounds; MACHINE_HZ is the shaft's speed
TIME_S = np.arange(round(RATE_HZ * SECONDS)) / RATE_HZ


def comb(rng: Rng, seconds: float, snr_db: float, jitter: float) -> FloatArray:
    """Squared envelope with a line at `LINE_HZ` and its harmonics in white noise, shape [seconds COMB_RATE_HZ].

    The periods scatter independently with the relative standard deviation `jitter`, so that the phase is a random walk.
    `snr_db` is the first harmonic's power over the mean noise power of a bin.
    """
    time_s = np.arange(round(seconds * COMB_RATE_HZ)) / COMB_RATE_HZ
    impacts = round(seconds * LINE_HZ * (1 + 10 * jitter)) + 20
    at_s = np.cumsum(1 + jitter * rng.standard_normal(impacts)) / LINE_HZ
    at_s = np.concatenate(([0.0], at_s)) - (1 + rng.random()) / LINE_HZ
    phase = 2 * math.pi * np.interp(time_s, at_s, np.arange(impacts + 1))
    signal = sum(a * np.cos(h * phase + rng.uniform(0, 2 * math.pi)) for h, a in enumerate(AMPLITUDES, 1))
    sigma = math.sqrt(time_s.size / 4 / 10 ** (snr_db / 10))
    return np.asarray(MEAN + signal + sigma * rng.standard_normal(time_s.size))


def plain_noise(rng: Rng, seconds: float, *, coloured: bool) -> FloatArray:
    """Squared envelope of Gaussian noise, white or of first order, shape [seconds COMB_RATE_HZ]."""
    noise = rng.standard_normal(round(seconds * COMB_RATE_HZ))
    return np.asarray(MEAN + (scipy.signal.lfilter([1.0], [1.0, -COLOUR_POLE], noise) if coloured else noise))


def white(rng: Rng) -> FloatArray:
    """White noise."""
    return rng.standard_normal(TIME_S.size)


def pink(rng: Rng) -> FloatArray:
    """Noise whose power falls as 1 / f."""
    lines = np.fft.rfft(white(rng))
    return np.fft.irfft(lines / np.sqrt(np.maximum(np.arange(lines.size), 1)), TIME_S.size)


def knocks(rng: Rng) -> FloatArray:
    """Knocks at random times on a resonance at 3 kHz, forty per second, in white noise."""
    at = rng.integers(0, TIME_S.size, rng.poisson(40 * SECONDS))
    return white(rng) + _ringing(at, rng.standard_normal(at.size) * rng.exponential(90, at.size), 3000)


def tones(rng: Rng) -> FloatArray:
    """Twenty tones at random frequencies in white noise."""
    return np.asarray(white(rng) + sum(rng.exponential(1.5) * _tone(rng, rng.uniform(100, 5900)) for _ in range(20)))


def gears(rng: Rng) -> FloatArray:
    """Two gear pairs with four mesh harmonics each, and sidebands of their own shafts and of the bearing's."""
    found = white(rng)
    for _ in range(2):
        shaft_hz, teeth = MACHINE_HZ * rng.uniform(0.2, 0.9), rng.integers(17, 60)
        for harmonic in range(1, 5):
            sides = 1 + rng.uniform(0.2, 0.8) * _tone(rng, shaft_hz) + rng.uniform(0, 0.5) * _tone(rng, MACHINE_HZ)
            found = found + rng.exponential(1.5) * sides * _tone(rng, harmonic * teeth * shaft_hz)
    return found


def shafts(rng: Rng) -> FloatArray:
    """Noise modulated by the bearing's shaft, and tones modulated by another shaft."""
    other = _modulation(rng, MACHINE_HZ * rng.uniform(0.2, 3), 0.3)
    carriers = sum(rng.exponential(1) * other * _tone(rng, hz) for hz in (700, 2100, 4300))
    return np.asarray(white(rng) * _modulation(rng, MACHINE_HZ, 0.5) + carriers)


def foreign(rng: Rng) -> FloatArray:
    """Impacts of another bearing, their spacing jittered by one per cent, on a resonance in white noise."""
    hz = rng.uniform(2, 9) * MACHINE_HZ * rng.uniform(0.3, 1.7)
    at_s = np.cumsum(1 + 0.01 * rng.standard_normal(round(1.2 * SECONDS * hz))) / hz
    at = (at_s[at_s < SECONDS] * RATE_HZ).astype(int)
    heights = rng.uniform(3, 20) * (1 + 0.2 * rng.standard_normal(at.size))
    return white(rng) + _ringing(at, heights, rng.uniform(1500, 5000))


def bursts(rng: Rng) -> FloatArray:
    """Noise whose power rises and falls at a rate from 5 to 150 Hz, over white noise."""
    rise = np.exp(rng.uniform(0.3, 2) * _tone(rng, rng.uniform(5, 150)))
    return np.asarray(white(rng) * rise / rise.mean() + 0.5 * white(rng))


def mains(rng: Rng) -> FloatArray:
    """Harmonics of 50 Hz, over noise that a belt modulates at multiples of its own rate."""
    belt = white(rng) * _modulation(rng, rng.uniform(4, 14), 0.5)
    return np.asarray(belt + sum(rng.exponential(1) * _tone(rng, 50 * h) for h in range(1, 30)))


BACKGROUNDS: dict[str, Callable[[Rng], FloatArray]] = {
    one.__name__: one for one in (white, pink, knocks, tones, gears, shafts, foreign, bursts, mains)
}


def _tone(rng: Rng, hz: float) -> FloatArray:
    return np.asarray(np.cos(2 * np.pi * (hz * TIME_S + rng.random())))


def _modulation(rng: Rng, hz: float, depth: float) -> FloatArray:
    """One plus five harmonics of `hz`, of a random depth up to `depth` that falls with the harmonic."""
    return np.asarray(1 + sum(rng.uniform(0, depth) / h * _tone(rng, h * hz) for h in range(1, 6)))


def _ringing(at: np.ndarray, heights: FloatArray, hz: float) -> FloatArray:
    """Impacts of these heights at these samples, on a resonance at `hz`."""
    train = np.zeros(TIME_S.size)
    np.add.at(train, at, heights)
    return np.asarray(scipy.signal.lfilter(*scipy.signal.iirpeak(hz / (RATE_HZ / 2), 8), train))
