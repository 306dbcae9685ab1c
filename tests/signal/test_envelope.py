"""From axes to a band's envelope, order tracking; power that repeats with a passage, and the record of lines."""

import math

import numpy as np
import pytest
import scipy.fft
import scipy.interpolate
import scipy.signal

from srbval import signal
from srbval.errors import ConfigurationError, DataError
from srbval.path.locked import locked_mean
from srbval.signal.envelope import FILTER_ORDER, check_band

FS_HZ = 20_480.0
BANDS_HZ = [(1400.0, 2800.0), (500.0, 1500.0), (2000.0, 4000.0)]
ROUNDING = 1e-12
INTERIOR = 1e-4
# Farther than this from the ends nothing of them is left in the one pass.
END = round(0.05 * FS_HZ)
INSIDE = slice(END, -END)


def bandpass(samples, fs_hz, band_hz):
    """The paper's filter: a Butterworth band-pass forward and backward."""
    sections = scipy.signal.butter(FILTER_ORDER, band_hz, btype="bandpass", fs=fs_hz, output="sos")
    return scipy.signal.sosfiltfilt(sections, samples)


def test_the_angle_counts_from_the_first_axis_to_the_second():
    motion = np.sin(np.arange(50.0))
    np.testing.assert_allclose(signal.rotate_axes(motion, motion, math.pi / 4), math.sqrt(2) * motion, atol=ROUNDING)
    np.testing.assert_allclose(signal.rotate_axes(motion, -motion, math.pi / 4), 0.0, atol=ROUNDING)
    np.testing.assert_allclose(signal.rotate_axes(motion, 2 * motion, math.pi / 2), 2 * motion, atol=ROUNDING)
    with pytest.raises(DataError, match="3 and 4"):
        signal.rotate_axes(np.zeros(3), np.zeros(4), 0.0)


@pytest.mark.parametrize("samples", [np.full(100, 9.81), np.zeros(100), np.empty(0), np.array([1.0, np.nan])])
def test_signal_without_vibration_is_refused(samples):
    with pytest.raises(DataError):
        signal.normalise(samples)


@pytest.mark.parametrize("band", [(0.0, 100.0), (200.0, 100.0), (-5.0, 10.0), (float("nan"), 10.0)])
def test_impossible_band_is_refused(band):
    with pytest.raises(ConfigurationError, match="--band"):
        check_band(band, FS_HZ)
    with pytest.raises(ConfigurationError, match=r"6000 Hz.*Nyquist frequency of 5000 Hz.*--band"):
        check_band((1000.0, 6000.0), 10_000.0)


def test_a_tone_on_a_bin_has_its_amplitude_there():
    spectrum = signal.amplitude_spectrum(5.0 + 3.0 * np.cos(2 * np.pi * 60 * np.arange(16_384) / 8192 + 0.3), 8192)
    assert spectrum.amplitude[120] == pytest.approx(3.0, abs=ROUNDING)
    assert spectrum.amplitude[0] == pytest.approx(0.0, abs=ROUNDING)
    assert spectrum.frequency_hz[120] == 60.0


def error(found, expected):
    return np.abs(found - expected)[INSIDE].max() / expected[INSIDE].max()


@pytest.mark.parametrize("band_hz", BANDS_HZ)
def test_interior_equals_the_papers_chain(band_hz):
    """Its ends faded where they are dropped anyway; without that it is the chain which is wrong, by up to 2e-3."""
    samples = np.random.default_rng(1).standard_normal(204_800)
    square, _ = signal.squared_envelope_one_pass(samples, FS_HZ, band_hz)
    filtered = bandpass(samples, FS_HZ, band_hz)
    fade = np.sin(np.pi / 2 * (np.arange(END) + 0.5) / END) ** 2
    faded = filtered * np.concatenate((fade, np.ones(samples.size - 2 * END), fade[::-1]))
    reference = np.abs(scipy.signal.hilbert(faded)) ** 2
    at_full_rate = scipy.fft.irfft(scipy.fft.rfft(square) * (samples.size / square.size), n=samples.size)
    assert error(at_full_rate, reference) < INTERIOR / 10
    analytic = signal.analytic_signal(samples, FS_HZ, band_hz)
    assert error(np.abs(analytic), np.sqrt(reference)) < INTERIOR / 2
    # The filter itself is the two-way one to rounding (but for the slopes left out below 1e-5).
    np.testing.assert_allclose(analytic.real[INSIDE], filtered[INSIDE], atol=INTERIOR / 2)


TRACKED_HZ, SECONDS, SLOW_HZ, FAST_HZ, LINE_ORDER = 4000.0, 10.0, 10.0, 14.0, 8.18
TIME_S = np.arange(round(TRACKED_HZ * SECONDS)) / TRACKED_HZ
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


CHIRP = np.cos(2 * np.pi * LINE_ORDER * turns_at(TIME_S))


@pytest.mark.parametrize(("rate_hz", "noise_hz"), [(100.0, 0.0), (4000.0, 0.0), (640.0, 0.05)])
def test_a_line_that_follows_the_shaft_becomes_one_line_at_the_mean_speed(rate_hz, noise_hz):
    smeared = signal.amplitude_spectrum(CHIRP, TRACKED_HZ)
    assert smeared.amplitude.max() < SMEARED, "without tracking the line is spread over hundreds of bins"
    course = signal.ShaftAngle.from_speed(tachometer(rate_hz, noise_hz), rate_hz)
    even = signal.amplitude_spectrum(course.resample(CHIRP, TRACKED_HZ, 0.0, MEAN_HZ), TRACKED_HZ)
    assert even.amplitude.max() > LEAST_OF_A_TONE
    assert even.frequency_hz[np.argmax(even.amplitude)] == pytest.approx(LINE_ORDER * MEAN_HZ, abs=even.resolution_hz)


def test_a_part_of_the_record_keeps_its_place_on_the_shaft():
    """The ends a filter spoils are dropped first: what is left begins later and still turns at the given mean."""
    course = signal.ShaftAngle.from_speed(tachometer(4000.0), 4000.0)
    skip = 8000
    even = course.resample(CHIRP[skip:-skip], TRACKED_HZ, skip / TRACKED_HZ, MEAN_HZ)
    phase = 2 * np.pi * LINE_ORDER * (turns_at(TIME_S[skip]) + np.arange(even.size) * MEAN_HZ / TRACKED_HZ)
    np.testing.assert_allclose(even, np.cos(phase), atol=SPLINE)


@pytest.mark.parametrize("speed", [np.zeros(100), np.linspace(-1, 10, 1000), np.full(100, 0.5)])
def test_a_shaft_that_stops_or_hardly_turns_is_refused(speed):
    with pytest.raises(DataError, match="order tracking"):
        signal.ShaftAngle.from_speed(speed, 100.0)


PASSAGES, PER_PASSAGE, BLOCKS = 200, 20, 10
PERIODS = (np.arange(PASSAGES * PER_PASSAGE) + 0.5) / PER_PASSAGE
RAISED = np.where(PERIODS % 1.0 < 0.3, 1.0, 0.0)
TRIALS = 200


def noise(random: np.random.Generator) -> np.ndarray:
    """Squares of a complex normal variable: those of a band's analytic signal, mean one."""
    return random.exponential(size=PERIODS.size)


def test_noise_alone_has_no_locked_power_and_is_rarely_shown():
    """The least of noisy means, taken in the same passages, would be below their mean in every trial."""
    random = np.random.default_rng(1)
    found = [locked_mean(noise(random), PERIODS, BLOCKS) for _ in range(TRIALS)]
    values = np.array([one.value for one in found])
    assert abs(values.mean()) < 2.5 * values.std() / np.sqrt(TRIALS)
    assert np.mean([one.value > one.ci95 for one in found]) < 0.05  # one side of 95 %


@pytest.mark.parametrize("strength", [0.5, 3.0])
def test_the_interval_holds_as_often_as_it_says(strength):
    random = np.random.default_rng(2)
    found = [locked_mean((strength * RAISED + 1.0) * noise(random), PERIODS, BLOCKS) for _ in range(TRIALS)]
    inside = [abs(one.value - 0.3 * strength) <= one.ci95 for one in found]
    assert np.mean(inside) > 0.9  # 95 % and more, by three deviations of as many trials
    assert np.mean([one.ci95 for one in found]) < 2.5 * signal.NORMAL_95 * np.std([one.value for one in found])


def test_too_few_passages_are_refused():
    with pytest.raises(DataError, match=r"9\.95 passages .* 16 are needed"):
        locked_mean(RAISED[:200], PERIODS[:200], BLOCKS)


LOCKED_HZ = 20_000.0
SHAFT_HZ = 14.3
# The median of 64 exponential bins scatters by 1/sqrt(64)/ln 2, 18 %; four of these.
NOISE_SCATTER = 0.72
# Linear interpolation between eighths of a bin, at the top of a line.
INTERPOLATION = 0.02
# Ripple of the decimation filter.
DEPTH = 0.01


def record_of(samples, limit_hz=900.0, shaft_ci_hz=0.0):
    return signal.Periodogram.of(samples, LOCKED_HZ, limit_hz=limit_hz, shaft_hz=SHAFT_HZ, shaft_ci_hz=shaft_ci_hz)


def test_reduced_record_keeps_a_tone_and_its_place():
    record = record_of(5.0 + 2.0 * np.cos(2 * np.pi * 321.4 * np.arange(40_000) / LOCKED_HZ))
    assert record.fs_hz < LOCKED_HZ / 4
    assert record.depth_at(321.4) == pytest.approx(2.0 / 5.0, rel=DEPTH)
    at = np.array([321.4])
    assert record.power_at(at) == pytest.approx(record.exact_power_at(at), rel=INTERPOLATION)


def test_noise_mean_is_that_of_the_bins_and_ignores_lines_among_them():
    samples = np.random.default_rng(4).standard_normal(40_000)
    time_s = np.arange(samples.size) / LOCKED_HZ
    clean = record_of(samples).noise_near(200.0, 2.0).mean_power
    lines = samples + sum(0.1 * np.cos(2 * np.pi * f * time_s) for f in (195.3, 206.1, 209.0))
    reduced = record_of(samples)
    # White noise of unit variance at the full rate keeps its density, so its variance falls with the rate.
    assert clean == pytest.approx(reduced.samples.size * reduced.fs_hz / LOCKED_HZ, rel=NOISE_SCATTER)
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
