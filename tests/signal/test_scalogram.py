import numpy as np
import pytest

from srbval.errors import ConfigurationError
from srbval.signal import scalogram
from srbval.signal.scalogram import BANDWIDTH

FS_HZ = 20_480.0
SAMPLES = 10_240
# A tone in its own row, once pywt's differencing is divided out: limited by the wavelet's finite support.
TONE = 1e-5
# pywt's nearest-point sampling of the wavelet, as a share of the row's peak (half a sample aside).
IMPULSE_BELOW_015, IMPULSE_ABOVE = 0.025, 0.065


@pytest.mark.parametrize("tone_hz", [60.0, 250.0, 1000.0, 3000.0, 6000.0])
def test_a_tone_reads_its_amplitude_at_its_frequency(tone_hz):
    tone = 3.0 * np.cos(2 * np.pi * tone_hz * np.arange(SAMPLES) / FS_HZ)
    result = scalogram(tone, FS_HZ, range_hz=(tone_hz, 1.1 * tone_hz), rows=2, columns=50)
    np.testing.assert_allclose(result.amplitude[0, 15:35], 3.0, rtol=TONE)


def test_an_impulse_draws_the_wavelet_in_every_row():
    impulse = np.zeros(SAMPLES)
    impulse[SAMPLES // 2] = 1.0
    result = scalogram(impulse, FS_HZ, range_hz=(50.0, 7000.0), rows=30, columns=SAMPLES)
    for frequency_hz, row in zip(result.frequency_hz, result.amplitude, strict=True):
        error = min(relative_error(row, frequency_hz, shift) for shift in (-0.5, 0.0, 0.5))
        assert error < (IMPULSE_BELOW_015 if frequency_hz < 0.15 * FS_HZ else IMPULSE_ABOVE)


def relative_error(row, frequency_hz, shift):
    periods = (np.arange(SAMPLES) - SAMPLES / 2 + shift) / FS_HZ * frequency_hz
    peak = 2 * frequency_hz / FS_HZ / np.sqrt(np.pi * BANDWIDTH)
    return np.abs(row / peak - np.exp(-(periods**2) / BANDWIDTH)).max()


def test_columns_are_means_and_times_are_their_middles():
    samples = np.random.default_rng(1).standard_normal(SAMPLES)
    fine = scalogram(samples, FS_HZ, range_hz=(500.0, 2000.0), rows=3, columns=SAMPLES)
    coarse = scalogram(samples, FS_HZ, range_hz=(500.0, 2000.0), rows=3, columns=64)
    np.testing.assert_allclose(coarse.amplitude, fine.amplitude.reshape(3, 64, -1).mean(axis=2))
    np.testing.assert_allclose(coarse.time_s, fine.time_s.reshape(64, -1).mean(axis=1))


def test_rows_are_log_spaced_and_edges_shrink_with_frequency():
    result = scalogram(np.random.default_rng(2).standard_normal(SAMPLES), FS_HZ, range_hz=(100.0, 1600.0), rows=5)
    np.testing.assert_allclose(result.frequency_hz, [100.0, 200.0, 400.0, 800.0, 1600.0])
    np.testing.assert_allclose(result.edge_s * result.frequency_hz, np.sqrt(BANDWIDTH))


@pytest.mark.parametrize("range_hz", [(1.0, 1000.0), (100.0, 9000.0), (500.0, 500.0)])
def test_range_beyond_the_record_names_what_it_allows(range_hz):
    with pytest.raises(ConfigurationError, match=r"allows 4\.9 to 7168 Hz"):
        scalogram(np.zeros(SAMPLES), FS_HZ, range_hz=range_hz)
