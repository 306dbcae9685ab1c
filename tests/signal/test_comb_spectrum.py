"""Combs over their fundamental, and the chance that a meaningless one is as strong."""

import math

import numpy as np
import pytest

from srbval.arrays import FloatArray
from srbval.signal import Periodogram
from srbval.signal.comb_spectrum import CombSpectrum
from srbval.signal.false_alarm import neg_log_rank

FS_HZ, SECONDS, LINE_HZ, SHAFT_HZ, LIMIT_HZ = 2000.0, 6.0, 61.7, 17.3, 600.0
RELATIVE = 0.01


def combs(samples: FloatArray) -> CombSpectrum:
    record = Periodogram.of(3 + samples, FS_HZ, limit_hz=LIMIT_HZ, shaft_hz=SHAFT_HZ)
    return CombSpectrum.of([record], 1.1 * SHAFT_HZ, 5)


def noise(seed: int) -> FloatArray:
    return np.random.default_rng(seed).standard_normal(round(FS_HZ * SECONDS))


def lines(*amplitudes: float) -> FloatArray:
    time_s = np.arange(round(FS_HZ * SECONDS)) / FS_HZ
    return np.asarray(sum(a * np.cos(2 * np.pi * h * LINE_HZ * time_s + h) for h, a in enumerate(amplitudes, 1)))


def away(found: CombSpectrum) -> np.ndarray:
    return np.abs(found.frequency_hz / LINE_HZ - 1) > 2 * RELATIVE


def test_a_comb_is_found_where_it_is_and_ranks_high() -> None:
    found = combs(noise(1) + lines(0.2, 0.2, 0.2, 0.2, 0.2))
    evidence, at_hz = found.highest(LINE_HZ * 1.004, RELATIVE)
    assert at_hz == pytest.approx(LINE_HZ, rel=1e-3)
    assert neg_log_rank(evidence, found.placebos(away(found), LINE_HZ, RELATIVE)) > -math.log(1e-4)


def test_on_noise_the_chance_holds() -> None:
    """Windows of pure noise: chances below a tenth come up about that often."""
    chances = []
    for seed in range(12):
        found = combs(noise(seed))
        chances += [
            math.exp(-neg_log_rank(found.highest(f, RELATIVE)[0], found.placebos(away(found), f, RELATIVE)))
            for f in np.geomspace(25, 110, 25)
        ]
    assert 0.05 < np.mean(np.array(chances) < 0.1) < 0.17


def test_out_of_reach_there_is_nothing() -> None:
    found = combs(noise(1))
    assert math.isnan(found.highest(LIMIT_HZ / 4, RELATIVE)[0])
    assert found.placebos(away(found), LIMIT_HZ, RELATIVE).size == 0
    few = away(found) & (np.abs(found.frequency_hz / 50 - 1) < 2 * RELATIVE)
    assert found.placebos(few, LINE_HZ, RELATIVE).size == 0, "too few to be a sample"
    assert math.isnan(neg_log_rank(math.nan, np.ones(100)))
    assert math.isnan(neg_log_rank(3.0, np.ones(3)))
    for ties in (False, True):  # placebos that share their strongest line have no tail
        assert neg_log_rank(30.0, np.repeat([1.0, 6.0], [60, 40]), ties=ties) == pytest.approx(math.log(101))
    infinite = np.repeat([1.0, math.inf], [60, 40])
    assert neg_log_rank(30.0, infinite, ties=True) == pytest.approx(math.log(101 / 41))
