import numpy as np
import pytest

from srbval.errors import ConfigurationError
from srbval.signal import column_width, morlet_scalogram
from srbval.signal.scalogram import BANDWIDTH

FS_HZ, SAMPLES, ROWS = 20_480.0, 16_384, 16
RANGE_HZ = (60.0, 0.35 * FS_HZ)
# Against the direct sum: the wavelet's spectrum is cut where it has fallen to exp(-18) of its top.
EXACT = 1e-6
# Columns wider than a row's moments need be: a mean of some moments against that of all samples.
FIGURE = 0.003
TONE = 1e-6
# Centre of an impulse's image, in columns.
CENTRE = 1e-3
# What of one end shows at the other, as a share of the largest value.
WRAPPED = 1e-6


def direct_sum(samples, frequency_hz):
    """Modulus of sum x_k w(t - t_k), one row of it: for impulses the sum over them alone."""
    struck = np.flatnonzero(samples)
    periods = (np.arange(samples.size)[:, None] - struck) / FS_HZ * frequency_hz
    wavelets = np.exp(-(periods**2) / BANDWIDTH + 2j * np.pi * periods)
    return np.abs(wavelets @ samples[struck]) * 2 * frequency_hz / FS_HZ / np.sqrt(np.pi * BANDWIDTH)


def column_means(row, columns):
    width = column_width(row.size, columns)
    return row[: row.size // width * width].reshape(-1, width).mean(axis=1)


def train(seed):
    """Impulses of any size at any places, some of them neighbours."""
    rng = np.random.default_rng(seed)
    samples = np.zeros(SAMPLES)
    samples[rng.integers(SAMPLES // 5, 4 * SAMPLES // 5, 15)] = rng.standard_normal(15)
    return samples


def single(at):
    samples = np.zeros(SAMPLES)
    samples[at] = 1.0
    return samples


@pytest.mark.parametrize("tone_hz", np.geomspace(60.0, 7000.0, 12))
def test_a_unit_tone_reads_one_at_every_scale(tone_hz):
    tone = np.cos(2 * np.pi * tone_hz * np.arange(SAMPLES) / FS_HZ + 0.3)
    picture = morlet_scalogram(tone, FS_HZ, range_hz=(tone_hz, 1.02 * tone_hz), rows=2, columns=400).amplitude
    middle = picture.shape[1] // 2
    np.testing.assert_allclose(picture[0, middle - 40 : middle + 40], 1.0, atol=TONE)


@pytest.mark.parametrize(("columns", "tolerance"), [(SAMPLES, EXACT), (2048, EXACT), (800, FIGURE), (100, FIGURE)])
@pytest.mark.parametrize("samples", [single(7777), single(8192), train(1)], ids=["odd", "middle", "train"])
def test_impulses_anywhere_are_drawn_as_the_direct_sum_at_every_scale(samples, columns, tolerance):
    picture = morlet_scalogram(samples, FS_HZ, range_hz=RANGE_HZ, rows=ROWS, columns=columns)
    for frequency_hz, row in zip(picture.frequency_hz, picture.amplitude, strict=True):
        expected = column_means(direct_sum(samples, frequency_hz), columns)
        assert np.abs(row[: expected.size] - expected).max() < tolerance * expected.max(), frequency_hz


@pytest.mark.parametrize("columns", [SAMPLES, 800, 100])
def test_times_are_the_middles_of_the_columns(columns):
    picture = morlet_scalogram(single(7777), FS_HZ, range_hz=(100.0, 110.0), rows=2, columns=columns)
    width = column_width(SAMPLES, columns)
    centre_s = np.average(picture.time_s, weights=picture.amplitude[0])
    assert centre_s == pytest.approx(7777 / FS_HZ, abs=CENTRE * width / FS_HZ)
    np.testing.assert_allclose(np.diff(picture.time_s), width / FS_HZ)


def test_one_end_does_not_show_at_the_other():
    picture = morlet_scalogram(single(SAMPLES - 1), FS_HZ, range_hz=(60.0, 1000.0), rows=5).amplitude
    assert picture[:, 0].max() < WRAPPED * picture.max()


def test_range_beyond_the_record_is_refused():
    with pytest.raises(ConfigurationError, match="allows"):
        morlet_scalogram(np.zeros(SAMPLES), FS_HZ, range_hz=(0.1, 100.0))
