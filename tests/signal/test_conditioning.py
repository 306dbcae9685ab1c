"""From axes to a filtered signal: rotation, normalisation, band-pass, ends."""

import math

import numpy as np
import pytest
import scipy.fft
import scipy.signal

from srbval.errors import ConfigurationError, DataError
from srbval.signal import bandpass, butterworth_gain, check_band, drop_ends, normalise, rotate_axes

FS_HZ, COUNT = 20_480.0, 61_440
ROUNDING = 1e-12
# Second-order sections against the closed form; the absolute part where the gain is nil.
FILTER_RTOL, FILTER_ATOL = 1e-6, 1e-12


def test_the_angle_counts_from_the_first_axis_to_the_second():
    motion = np.sin(np.arange(50.0))
    np.testing.assert_allclose(rotate_axes(motion, motion, math.pi / 4), math.sqrt(2) * motion, atol=ROUNDING)
    np.testing.assert_allclose(rotate_axes(motion, -motion, math.pi / 4), 0.0, atol=ROUNDING)
    np.testing.assert_allclose(rotate_axes(motion, 2 * motion, math.pi / 2), 2 * motion, atol=ROUNDING)
    with pytest.raises(DataError, match="3 and 4"):
        rotate_axes(np.zeros(3), np.zeros(4), 0.0)


def test_normalised_signal_has_mean_zero_and_spread_one():
    result = normalise(5.0 + 3.0 * np.random.default_rng(1).standard_normal(1000))
    assert abs(result.mean()) < ROUNDING
    assert result.std() == pytest.approx(1.0, abs=ROUNDING)


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


def test_band_above_nyquist_names_value_limit_and_remedy():
    with pytest.raises(ConfigurationError, match=r"6000 Hz.*Nyquist frequency of 5000 Hz.*--band"):
        check_band((1000.0, 6000.0), 10_000.0)


@pytest.mark.parametrize("band", [(0.0, 100.0), (200.0, 100.0), (-5.0, 10.0), (float("nan"), 10.0)])
def test_impossible_band_is_refused(band):
    with pytest.raises(ConfigurationError, match="--band"):
        check_band(band, FS_HZ)


def test_too_short_a_record_is_refused():
    with pytest.raises(DataError, match="too few"):
        bandpass(np.zeros(20), FS_HZ, (800.0, 1600.0))
    with pytest.raises(DataError, match="longer recording"):
        drop_ends(np.zeros(900), 10_000.0, seconds=0.05)
