import numpy as np
import pytest

from srbval.errors import DataError
from srbval.signal import Periodogram

FS_HZ = 20_000.0
SHAFT_HZ = 14.3
# The median of 64 exponential bins scatters by 1/sqrt(64)/ln 2, 18 %; four of these.
NOISE_SCATTER = 0.72
# Linear interpolation between eighths of a bin, at the top of a line.
INTERPOLATION = 0.02
# Ripple of the decimation filter.
DEPTH = 0.01


def record_of(samples, limit_hz=900.0, shaft_ci_hz=0.0):
    return Periodogram.of(samples, FS_HZ, limit_hz=limit_hz, shaft_hz=SHAFT_HZ, shaft_ci_hz=shaft_ci_hz)


def test_reduced_record_keeps_a_tone_and_its_place():
    time_s = np.arange(40_000) / FS_HZ
    record = record_of(5.0 + 2.0 * np.cos(2 * np.pi * 321.4 * time_s))
    assert record.fs_hz < FS_HZ / 4
    assert record.depth_at(321.4) == pytest.approx(2.0 / 5.0, rel=DEPTH)
    at = np.array([321.4])
    assert record.power_at(at) == pytest.approx(record.exact_power_at(at), rel=INTERPOLATION)


def test_noise_mean_is_that_of_the_bins_and_ignores_lines_among_them():
    rng = np.random.default_rng(4)
    samples = rng.standard_normal(40_000)
    time_s = np.arange(samples.size) / FS_HZ
    clean = record_of(samples).noise_near(200.0, 2.0).mean_power
    lines = samples + sum(0.1 * np.cos(2 * np.pi * f * time_s) for f in (195.3, 206.1, 209.0))
    reduced = record_of(samples)
    # White noise of unit variance at the full rate keeps its density, so its variance falls with the rate.
    expected = reduced.samples.size * reduced.fs_hz / FS_HZ
    assert clean == pytest.approx(expected, rel=NOISE_SCATTER)
    # Three lines of a hundred times the noise would raise the plain mean of 64 bins about fivefold.
    assert record_of(lines).noise_near(200.0, 2.0).mean_power < 2 * clean


def test_shaft_harmonics_are_masked_and_wider_with_an_uncertain_speed():
    samples = np.random.default_rng(5).standard_normal(40_000)
    at = np.array([8 * SHAFT_HZ, 8 * SHAFT_HZ + 1.2, 8 * SHAFT_HZ + 5.0])
    assert record_of(samples).masked(at).tolist() == [True, False, False]
    assert record_of(samples, shaft_ci_hz=0.1).masked(at).tolist() == [True, True, False]


def test_too_short_a_record_to_know_its_noise_is_refused():
    record = record_of(np.random.default_rng(7).standard_normal(400), limit_hz=100.0)
    with pytest.raises(DataError, match="longer record"):
        record.noise_near(50.0, 60.0)
