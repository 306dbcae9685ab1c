"""The scalogram against the exact direct sum of samples times wavelet, at the resolution of a figure."""

import numpy as np
import pytest
import scipy.signal

from srbval.errors import ConfigurationError
from srbval.signal import morlet_scalogram
from srbval.signal.scalogram import BANDWIDTH

FS_HZ, SAMPLES, RANGE_HZ = 20_480.0, 4097, (40.0, 1000.0)
# Of a row's highest value, at six and at two samples a column; the picture's 64 colours are 1.6 % apart.
WORST_ROW, MEDIAN_ROW = 0.01, 0.002
# What the ends of 0.2 s take from a tone of 40 Hz, four periods away.
TONE = 2e-4


def direct_sum(samples, frequency_hz, columns):
    """Modulus of sum x_k w(t - t_k), one row of it, averaged over columns."""
    periods = np.arange(-SAMPLES, SAMPLES + 1) / FS_HZ * frequency_hz
    wavelet = np.exp(-(periods**2) / BANDWIDTH + 2j * np.pi * periods)
    row = np.abs(scipy.signal.fftconvolve(samples, wavelet, mode="full")[SAMPLES : 2 * SAMPLES])
    first = np.arange(0, SAMPLES, -(-SAMPLES // columns))
    means = np.add.reduceat(row, first) / np.diff(np.append(first, SAMPLES))
    return means * 2 * frequency_hz / FS_HZ / np.sqrt(np.pi * BANDWIDTH)


def impulses(*places):
    samples = np.zeros(SAMPLES)
    samples[list(places)] = 1.0
    return samples


@pytest.mark.parametrize("columns", [800, 2048])
@pytest.mark.parametrize(
    "samples",
    [
        impulses(1695),
        impulses(2568),
        impulses(300, 1500, 1502, 3900),
        np.random.default_rng(1).standard_normal(SAMPLES),
    ],
    ids=["odd", "even", "train", "noise"],
)
def test_every_row_is_that_of_the_direct_sum(samples, columns):
    picture = morlet_scalogram(samples, FS_HZ, range_hz=RANGE_HZ, rows=40, columns=columns)
    errors = []
    for frequency_hz, row in zip(picture.frequency_hz, picture.amplitude, strict=True):
        expected = direct_sum(samples, frequency_hz, columns)
        errors.append(np.abs(row - expected).max() / expected.max())
    assert max(errors) < WORST_ROW
    assert np.median(errors) < MEDIAN_ROW


def test_a_unit_tone_reads_one_in_its_row_at_every_scale():
    rows = morlet_scalogram(np.zeros(SAMPLES), FS_HZ, range_hz=(40.0, 2048.0), rows=12).frequency_hz
    for row, tone_hz in enumerate(rows):
        tone = np.cos(2 * np.pi * tone_hz * np.arange(SAMPLES) / FS_HZ + 0.3)
        amplitude = morlet_scalogram(tone, FS_HZ, range_hz=(40.0, 2048.0), rows=12).amplitude[row]
        np.testing.assert_allclose(amplitude[320:360], 1.0, atol=TONE)


def test_rows_are_near_those_asked_for_and_times_the_middles_of_the_columns():
    picture = morlet_scalogram(impulses(2000), FS_HZ, range_hz=RANGE_HZ)
    np.testing.assert_allclose(picture.frequency_hz, np.geomspace(*RANGE_HZ, 120), rtol=0.005)
    centre_s = np.average(picture.time_s, weights=picture.amplitude[-1])
    assert centre_s == pytest.approx(2000 / FS_HZ, abs=0.05 / FS_HZ)


@pytest.mark.parametrize("range_hz", [(0.1, 100.0), (100.0, 9000.0)])
def test_a_range_beyond_the_record_is_refused(range_hz):
    with pytest.raises(ConfigurationError, match="allows"):
        morlet_scalogram(np.zeros(SAMPLES), FS_HZ, range_hz=range_hz)
