import numpy as np
import pytest

from srbval.errors import DataError
from srbval.signal import ShaftAngle, amplitude_spectrum

FS_HZ, SECONDS, SLOW_HZ, FAST_HZ, ORDER = 4000.0, 10.0, 10.0, 14.0, 8.18
TIME_S = np.arange(round(FS_HZ * SECONDS)) / FS_HZ
MEAN_HZ = (SLOW_HZ + FAST_HZ) / 2
# A tone between bins reads at least 2 / pi of its amplitude.
LEAST_OF_A_TONE = 0.63
# A line spread over hundreds of bins keeps less of its amplitude than this in any of them.
SMEARED = 0.2
# What `resample` states for lines below a fifth of the sampling rate.
SPLINE = 1e-3


def turns_at(time_s):
    return SLOW_HZ * time_s + (FAST_HZ - SLOW_HZ) * time_s**2 / (2 * SECONDS)


def tachometer(rate_hz, noise_hz=0.0):
    time_s = np.arange(round(rate_hz * SECONDS)) / rate_hz
    speed = SLOW_HZ + (FAST_HZ - SLOW_HZ) * time_s / SECONDS
    return speed + noise_hz * np.random.default_rng(1).standard_normal(time_s.size)


CHIRP = np.cos(2 * np.pi * ORDER * turns_at(TIME_S))


@pytest.mark.parametrize(("rate_hz", "noise_hz"), [(100.0, 0.0), (4000.0, 0.0), (640.0, 0.05)])
def test_a_line_that_follows_the_shaft_becomes_one_line_at_the_mean_speed(rate_hz, noise_hz):
    smeared = amplitude_spectrum(CHIRP, FS_HZ)
    assert smeared.amplitude.max() < SMEARED, "without tracking the line is spread over hundreds of bins"
    course = ShaftAngle.from_speed(tachometer(rate_hz, noise_hz), rate_hz)
    even = amplitude_spectrum(course.resample(CHIRP, FS_HZ, 0.0, MEAN_HZ), FS_HZ)
    assert even.amplitude.max() > LEAST_OF_A_TONE
    assert even.frequency_hz[np.argmax(even.amplitude)] == pytest.approx(ORDER * MEAN_HZ, abs=even.resolution_hz)


def test_a_part_of_the_record_keeps_its_place_on_the_shaft():
    """The ends a filter spoils are dropped first: what is left begins later and still turns at the given mean."""
    course = ShaftAngle.from_speed(tachometer(4000.0), 4000.0)
    skip = 8000
    even = course.resample(CHIRP[skip:-skip], FS_HZ, skip / FS_HZ, MEAN_HZ)
    phase = 2 * np.pi * ORDER * (turns_at(TIME_S[skip]) + np.arange(even.size) * MEAN_HZ / FS_HZ)
    np.testing.assert_allclose(even, np.cos(phase), atol=SPLINE)


@pytest.mark.parametrize("speed", [np.zeros(100), np.linspace(-1, 10, 1000), np.full(100, 0.5)])
def test_a_shaft_that_stops_or_hardly_turns_is_refused(speed):
    with pytest.raises(DataError, match="order tracking"):
        ShaftAngle.from_speed(speed, 100.0)
