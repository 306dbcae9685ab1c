import numpy as np
import pytest

from srbval.errors import ConfigurationError
from srbval.signal import kurtogram

FS_HZ, COUNT, LEAST_HZ = 20_480.0, 40_960, 460.0
# 20 records of 44 overlapping bands: the spread is known to some 5 %, the mean to 0.05; three to four of these.
SPREAD, MEAN = 0.15, 0.2
# The tone is one line of the transform: only rounding is left.
TONE = 1e-9


def noise(seed=0):
    return np.random.default_rng(seed).standard_normal(COUNT)


def test_gaussian_noise_shows_nothing_beyond_its_stated_scatter():
    ratios = np.array([(k := kurtogram(noise(s), FS_HZ, least_width_hz=LEAST_HZ)).kurtosis / k.scatter
                       for s in range(20)])  # fmt: skip
    assert ratios.std() == pytest.approx(1.0, abs=SPREAD)
    assert ratios.mean() == pytest.approx(0.0, abs=MEAN)


@pytest.mark.parametrize("ring_hz", [2100.0, 4600.0, 8300.0])
def test_the_most_impulsive_band_is_that_of_the_ringing(ring_hz):
    samples = noise()
    ring_s = np.arange(120) / FS_HZ
    ring = 4 * np.exp(-ring_s * 1200) * np.sin(2 * np.pi * ring_hz * ring_s)
    for first in range(500, COUNT - 200, 700):
        samples[first : first + ring.size] += ring
    low, high = kurtogram(samples, FS_HZ, least_width_hz=LEAST_HZ).best_hz
    assert low < ring_hz < high
    assert high - low < 2600


def test_a_steady_tone_is_minus_one():
    tone = np.cos(2 * np.pi * 3000 * np.arange(COUNT) / FS_HZ)
    picture = kurtogram(tone, FS_HZ, least_width_hz=LEAST_HZ)
    holding = (picture.band_hz[:, 0] < 2900) & (picture.band_hz[:, 1] > 3100)
    np.testing.assert_allclose(picture.kurtosis[holding], -1.0, atol=TONE)


def test_no_band_or_too_short_a_record_is_refused():
    with pytest.raises(ConfigurationError, match="fits twice"):
        kurtogram(noise(), FS_HZ, least_width_hz=6000.0)
    with pytest.raises(ConfigurationError, match="longer record"):
        kurtogram(noise()[:4096], FS_HZ, least_width_hz=LEAST_HZ)
