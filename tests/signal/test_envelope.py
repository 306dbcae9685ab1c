"""From axes to the envelope of a band: rotation, normalisation, band-pass, ends; the one pass beside the chain."""

import math

import numpy as np
import pytest
import scipy.fft
import scipy.signal

from srbval.errors import ConfigurationError, DataError
from srbval.signal import (
    amplitude_spectrum,
    analytic_signal,
    butterworth_gain,
    normalise,
    rotate_axes,
    squared_envelope_one_pass,
)
from srbval.signal.envelope import ORDER, check_band

FS_HZ, COUNT = 20_480.0, 61_440
BANDS_HZ = [(1400.0, 2800.0), (500.0, 1500.0), (2000.0, 4000.0)]
ROUNDING, TONE_ROUNDING = 1e-12, 1e-9  # tones on bins
# Second-order sections against the closed form; the absolute part where the gain is nil.
FILTER_RTOL, FILTER_ATOL = 1e-6, 1e-12
INTERIOR = 1e-4
# Farther than this from the ends nothing of them is left in the one pass.
END = round(0.05 * FS_HZ)
INSIDE = slice(END, -END)


def bandpass(samples, fs_hz, band_hz):
    """The paper's filter: a Butterworth band-pass forward and backward."""
    sections = scipy.signal.butter(ORDER, band_hz, btype="bandpass", fs=fs_hz, output="sos")
    return scipy.signal.sosfiltfilt(sections, samples)


def squared_envelope(samples, fade=0):
    """The paper's envelope, squared; with `fade` that many samples at each end are first brought smoothly to zero."""
    rise = np.sin(np.pi / 2 * (np.arange(fade) + 0.5) / max(fade, 1)) ** 2
    faded = samples * np.concatenate((rise, np.ones(samples.size - 2 * fade), rise[::-1]))
    return np.abs(scipy.signal.hilbert(faded, N=scipy.fft.next_fast_len(samples.size))[: samples.size]) ** 2


def test_the_angle_counts_from_the_first_axis_to_the_second():
    motion = np.sin(np.arange(50.0))
    np.testing.assert_allclose(rotate_axes(motion, motion, math.pi / 4), math.sqrt(2) * motion, atol=ROUNDING)
    np.testing.assert_allclose(rotate_axes(motion, -motion, math.pi / 4), 0.0, atol=ROUNDING)
    np.testing.assert_allclose(rotate_axes(motion, 2 * motion, math.pi / 2), 2 * motion, atol=ROUNDING)
    with pytest.raises(DataError, match="3 and 4"):
        rotate_axes(np.zeros(3), np.zeros(4), 0.0)


@pytest.mark.parametrize("samples", [np.full(100, 9.81), np.zeros(100), np.empty(0), np.array([1.0, np.nan])])
def test_signal_without_vibration_is_refused(samples):
    with pytest.raises(DataError):
        normalise(samples)


@pytest.mark.parametrize("band_hz", [(1400.0, 2800.0), (100.0, 300.0), (6000.0, 9500.0)])
def test_two_way_filter_is_the_closed_form_squared_magnitude(band_hz):
    sections = scipy.signal.butter(4, band_hz, btype="bandpass", fs=FS_HZ, output="sos")
    frequency = np.linspace(1.0, FS_HZ / 2 - 1, 4000)
    _, response = scipy.signal.sosfreqz(sections, worN=frequency, fs=FS_HZ)
    np.testing.assert_allclose(
        butterworth_gain(frequency, FS_HZ, band_hz), np.abs(response) ** 2, rtol=FILTER_RTOL, atol=FILTER_ATOL
    )
    np.testing.assert_allclose(butterworth_gain(np.array(band_hz), FS_HZ, band_hz), 0.5, atol=ROUNDING)
    samples = np.random.default_rng(1).standard_normal(COUNT)
    lines = scipy.fft.rfft(samples)
    lines[1:] *= butterworth_gain(scipy.fft.rfftfreq(COUNT, 1 / FS_HZ)[1:], FS_HZ, band_hz)
    lines[0] = 0
    inside = slice(COUNT // 3, 2 * COUNT // 3)
    closed = scipy.fft.irfft(lines, n=COUNT)
    np.testing.assert_allclose(bandpass(samples, FS_HZ, band_hz)[inside], closed[inside], atol=ROUNDING)


@pytest.mark.parametrize("band", [(0.0, 100.0), (200.0, 100.0), (-5.0, 10.0), (float("nan"), 10.0)])
def test_impossible_band_is_refused(band):
    with pytest.raises(ConfigurationError, match="--band"):
        check_band(band, FS_HZ)
    with pytest.raises(ConfigurationError, match=r"6000 Hz.*Nyquist frequency of 5000 Hz.*--band"):
        check_band((1000.0, 6000.0), 10_000.0)


@pytest.mark.parametrize(("amplitude", "depth"), [(1.0, 0.5), (3.0, 0.2)])
def test_lines_of_a_modulated_carrier_s_envelope(amplitude, depth):
    """Amplitude times depth; of the square a line at twice the modulation as well."""
    time_s, bins = np.arange(16_384) / 8192, (120, 240)  # 60 and 120 Hz, all tones on bins
    samples = amplitude * (1 + depth * np.cos(2 * np.pi * 60 * time_s + 0.3)) * np.cos(2 * np.pi * 1500 * time_s)
    modulus = np.abs(scipy.signal.hilbert(samples))
    plain, square = (amplitude_spectrum(one, 8192).amplitude for one in (modulus, modulus**2))
    assert plain[bins[0]] == pytest.approx(amplitude * depth, abs=TONE_ROUNDING)
    expected = 2 * amplitude**2 * depth, amplitude**2 * depth**2 / 2
    assert square[list(bins)] == pytest.approx(expected, abs=TONE_ROUNDING)


def at_full_rate(square, count):
    return scipy.fft.irfft(scipy.fft.rfft(square) * (count / square.size), n=count)


def error(found, expected):
    return np.abs(found - expected)[INSIDE].max() / expected[INSIDE].max()


@pytest.fixture(scope="module", params=BANDS_HZ, ids=str)
def truth(request):
    """A record cut from the middle of a longer one, and the squared envelope that the longer one has there."""
    count, band_hz = 204_800, request.param
    long = np.random.default_rng(1).standard_normal(3 * count)
    gain = butterworth_gain(scipy.fft.rfftfreq(long.size, 1 / FS_HZ), FS_HZ, band_hz)
    whole = squared_envelope(scipy.fft.irfft(scipy.fft.rfft(long) * gain, n=long.size))
    return band_hz, long[count : 2 * count], whole[count : 2 * count]


def test_interior_is_that_of_a_longer_record_and_nearer_to_it_than_the_usual_chain(truth):
    """The usual chain cuts the filter's ringing off and then transforms: its Hilbert kernel carries the cut inwards."""
    band_hz, samples, expected = truth
    square, _ = squared_envelope_one_pass(samples, FS_HZ, band_hz)
    ours = error(at_full_rate(square, samples.size), expected)
    usual = error(squared_envelope(bandpass(samples, FS_HZ, band_hz)), expected)
    assert ours < INTERIOR / 10
    assert usual > 3 * ours


def test_interior_equals_the_papers_chain(truth):
    """Its ends faded where they are dropped anyway; without that it is the chain which is wrong, by up to 2e-3."""
    band_hz, samples, _ = truth
    square, _ = squared_envelope_one_pass(samples, FS_HZ, band_hz)
    filtered = bandpass(samples, FS_HZ, band_hz)
    reference = squared_envelope(filtered, fade=END)
    assert error(at_full_rate(square, samples.size), reference) < INTERIOR / 10
    analytic = analytic_signal(samples, FS_HZ, band_hz)
    assert error(np.abs(analytic), np.sqrt(reference)) < INTERIOR / 2
    # The filter itself is the two-way one to rounding (but for the slopes left out below 1e-5).
    np.testing.assert_allclose(analytic.real[INSIDE], filtered[INSIDE], atol=INTERIOR / 2)
