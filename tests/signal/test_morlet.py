import numpy as np
import pytest

from srbval.errors import ConfigurationError
from srbval.signal.morlet import morlet_scalogram
from srbval.signal.scalogram import BANDWIDTH

FS_HZ, SAMPLES = 20_480.0, 81_920
TONE = 1e-6
# Columns are means of samples taken more sparsely than the record's.
IMPULSE = 0.02


@pytest.mark.parametrize("tone_hz", np.geomspace(40.0, 7000.0, 12))
def test_a_unit_tone_reads_one_at_every_scale(tone_hz):
    tone = np.cos(2 * np.pi * tone_hz * np.arange(SAMPLES) / FS_HZ + 0.3)
    result = morlet_scalogram(tone, FS_HZ, range_hz=(tone_hz, 1.02 * tone_hz), rows=2, columns=400)
    np.testing.assert_allclose(result.amplitude[0, 100:300], 1.0, atol=TONE)


def test_an_impulse_draws_the_wavelet_in_every_row():
    impulse = np.zeros(SAMPLES)
    at = SAMPLES // 2 + 8  # in the middle of a column
    impulse[at] = 1.0
    result = morlet_scalogram(impulse, FS_HZ, range_hz=(40.0, 1000.0), rows=30, columns=SAMPLES // 16)
    for frequency_hz, row in zip(result.frequency_hz, result.amplitude, strict=True):
        periods = (np.arange(SAMPLES) - at) / FS_HZ * frequency_hz
        wavelet = 2 * frequency_hz / FS_HZ / np.sqrt(np.pi * BANDWIDTH) * np.exp(-(periods**2) / BANDWIDTH)
        expected = wavelet.reshape(-1, 16).mean(axis=1)
        assert np.abs(row - expected).max() < IMPULSE * expected.max()


def test_one_end_does_not_show_at_the_other():
    samples = np.zeros(SAMPLES)
    samples[-1] = 1.0
    result = morlet_scalogram(samples, FS_HZ, range_hz=(40.0, 1000.0), rows=5)
    assert result.amplitude[:, 0].max() < 1e-6 * result.amplitude.max()


def test_range_beyond_the_record_is_refused():
    with pytest.raises(ConfigurationError, match="allows"):
        morlet_scalogram(np.zeros(SAMPLES), FS_HZ, range_hz=(0.1, 100.0))
