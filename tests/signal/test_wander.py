import numpy as np
import pytest

from srbval.signal.wander import wander_sigma_hz

FS_HZ, SECONDS, LINE_HZ = 1000.0, 30.0, 90.0
# One record's estimate of a variance from 32 blocks, averaged over 20 records.
MEAN_OF_RECORDS = 0.25


def wandering(rng, walk_rad2_s, noise=0.05):
    time_s = np.arange(round(SECONDS * FS_HZ)) / FS_HZ
    phase = np.cumsum(rng.standard_normal(time_s.size)) * np.sqrt(walk_rad2_s / FS_HZ)
    return np.cos(2 * np.pi * LINE_HZ * time_s + phase) + noise * rng.standard_normal(time_s.size)


@pytest.mark.parametrize("walk_rad2_s", [0.01, 0.1])
def test_standard_error_is_that_of_a_slope_through_a_random_walk(walk_rad2_s):
    rng = np.random.default_rng(1)
    snr = np.array([1e4])
    stated = [wander_sigma_hz(wandering(rng, walk_rad2_s), FS_HZ, LINE_HZ, snr) for _ in range(20)]
    expected = np.sqrt(1.2 * walk_rad2_s / SECONDS) / (2 * np.pi)
    assert np.sqrt(np.mean(np.square(stated))) == pytest.approx(expected, rel=MEAN_OF_RECORDS)


def test_an_error_of_the_line_frequency_is_not_wander():
    samples = wandering(np.random.default_rng(2), 0.01)
    at_line, beside = (wander_sigma_hz(samples, FS_HZ, f, np.array([1e4])) for f in (LINE_HZ, LINE_HZ + 0.01))
    assert beside == pytest.approx(at_line, rel=0.1)


def test_steady_line_wanders_far_less_than_a_slipping_one():
    rng = np.random.default_rng(3)
    steady, slipping = (wander_sigma_hz(wandering(rng, q), FS_HZ, LINE_HZ, np.array([1e4])) for q in (0.0, 0.1))
    assert steady < 0.05 * slipping


def test_weak_line_or_few_blocks_cannot_be_told():
    samples = wandering(np.random.default_rng(4), 0.1)
    assert wander_sigma_hz(samples, FS_HZ, LINE_HZ, np.array([15.0])) == 0.0
    assert wander_sigma_hz(samples, FS_HZ, LINE_HZ, np.array([1e4]), shortest_block_s=10.0) == 0.0
