import numpy as np
import pytest
import scipy.signal

from srbval.errors import ConfigurationError, DataError
from srbval.signal import bandpass, check_band, drop_ends

FS_HZ = 10_000.0
BAND_HZ = (800.0, 1600.0)
# The two-way filter equals its closed form to rounding away from the ends; the ends are the tolerance.
INTERIOR = 1e-6
# Whole periods of the tone: only rounding is left.
EDGE_GAIN = 1e-9


def interior(samples):
    return samples[4000:-4000]


@pytest.mark.parametrize("tone_hz", [600.0, 800.0, 1100.0, 1600.0, 2500.0])
def test_gain_is_the_squared_butterworth_magnitude_and_phase_is_zero(tone_hz):
    time_s = np.arange(20_000) / FS_HZ
    tone = np.cos(2 * np.pi * tone_hz * time_s)
    sections = scipy.signal.butter(4, BAND_HZ, btype="bandpass", fs=FS_HZ, output="sos")
    _, response = scipy.signal.sosfreqz(sections, worN=[tone_hz], fs=FS_HZ)
    expected = np.abs(response[0]) ** 2 * tone
    np.testing.assert_allclose(interior(bandpass(tone, FS_HZ, BAND_HZ)), interior(expected), atol=INTERIOR)


@pytest.mark.parametrize("edge_hz", BAND_HZ)
def test_gain_at_the_edges_is_one_half(edge_hz):
    tone = np.cos(2 * np.pi * edge_hz * np.arange(20_000) / FS_HZ)
    passed = interior(bandpass(tone, FS_HZ, BAND_HZ))
    assert np.sqrt(2) * passed.std() == pytest.approx(0.5, abs=EDGE_GAIN)


def test_band_above_nyquist_names_value_limit_and_remedy():
    with pytest.raises(ConfigurationError, match=r"6000 Hz.*Nyquist frequency of 5000 Hz.*--band"):
        check_band((1000.0, 6000.0), FS_HZ)


@pytest.mark.parametrize("band", [(0.0, 100.0), (200.0, 100.0), (-5.0, 10.0), (float("nan"), 10.0)])
def test_impossible_band_is_refused(band):
    with pytest.raises(ConfigurationError, match="--band"):
        check_band(band, FS_HZ)


def test_record_too_short_to_filter_is_refused():
    with pytest.raises(DataError, match="too few"):
        bandpass(np.zeros(20), FS_HZ, BAND_HZ)


def test_both_ends_are_dropped_by_the_declared_time():
    kept = drop_ends(np.arange(2000.0), FS_HZ, seconds=0.05)
    assert (kept[0], kept[-1], kept.size) == (500.0, 1499.0, 1000)


def test_record_shorter_than_its_ends_is_refused():
    with pytest.raises(DataError, match="longer recording"):
        drop_ends(np.zeros(900), FS_HZ, seconds=0.05)
