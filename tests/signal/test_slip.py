"""Mean frequency of a line that may slip, and its interval."""

import numpy as np
import pytest

from srbval.signal import Phasors, slip

FS_HZ, SECONDS, LINE_HZ = 1000.0, 30.0, 90.0
ONE = np.array([1.0])
# 150 intervals of 95 %: four binomial standard errors below, and not all of them.
COVERED = (0.88, 0.995)


def wandering(rng, walk_rad2_s, noise=0.05):
    time_s = np.arange(round(SECONDS * FS_HZ)) / FS_HZ
    phase = np.cumsum(rng.standard_normal(time_s.size)) * np.sqrt(walk_rad2_s / FS_HZ)
    return np.cos(2 * np.pi * LINE_HZ * time_s + phase) + noise * rng.standard_normal(time_s.size)


def followed(samples, line_hz=LINE_HZ, noise=0.05, **options):
    phasors = Phasors.of(samples, FS_HZ, np.array([line_hz]))
    return slip.track_slip(phasors, ONE, ONE * noise**2 * samples.size, line_hz=line_hz, **options)


def test_weak_line_or_few_blocks_cannot_be_told():
    samples = wandering(np.random.default_rng(4), 0.1)
    assert followed(samples, noise=60.0) is None
    assert followed(samples, period_s=10.0) == (0.0, np.inf)


@pytest.mark.parametrize("blocks", [4, 6, pytest.param(12, marks=pytest.mark.long_form)])
def test_a_short_record_s_few_blocks_still_tell_slip(blocks):
    """Noise alone would cover hardly any of these. Four blocks hardly bound slip: all intervals hold the frequency."""
    records = (wandering(np.random.default_rng((6, index)), 0.1) for index in range(150))
    shift, half = np.abs([followed(one, period_s=SECONDS / (blocks + 0.5)) for one in records]).T
    assert COVERED[0] < np.mean(shift <= half) < COVERED[1] or (blocks == 4 and np.all(shift <= half))
    assert half.max() < LINE_HZ / 100


def test_noise_that_is_higher_at_the_line_than_beside_it_is_no_wander(monkeypatch):
    """Skirts and sidebands lift it. Against the noise told, phases would scatter more than noise explains."""
    records = [wandering(np.random.default_rng((5, index)), 0.0, noise=0.3) for index in range(10)]

    def mean_ci(noise):
        return np.sqrt(np.mean([followed(samples, noise=noise)[1] ** 2 for samples in records]))

    known, told_too_little = mean_ci(0.3), mean_ci(0.16)
    assert told_too_little < 1.5 * known
    monkeypatch.setattr(slip, "MOST_INFORMATION", np.inf)
    assert mean_ci(0.16) > 2 * mean_ci(0.3)
