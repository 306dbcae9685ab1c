"""Whitened and phase-randomised records, kurtogram, and the scalogram against the exact sum of samples times wavelet.

Prewhitening takes away what repeats exactly and keeps impacts that stray; random phases take away impacts too.
"""

import numpy as np
import pytest
import scipy.signal

from srbval import signal
from srbval.arrays import FloatArray
from srbval.errors import ConfigurationError, DataError
from srbval.signal.envelope import MIN_END_S
from srbval.signal.spectrum import BANDWIDTH, LEAST_SAMPLES

FS_HZ, SECONDS, LINE_HZ, SHAFT_HZ = 12000.0, 4.0, 107.3, 29.9
BAND_HZ = (200.0, 5600.0)


def line_to_noise(samples: FloatArray) -> float:
    square, rate = signal.squared_envelope_one_pass(samples, FS_HZ, BAND_HZ)
    inside = signal.drop_ends(square, rate, signal.end_s(BAND_HZ))
    record = signal.Periodogram.of(inside, rate, limit_hz=600.0, shaft_hz=SHAFT_HZ)
    return signal.peak_snr(record, LINE_HZ, 1.0) or 0.0


def gear_mesh(rng: np.random.Generator) -> FloatArray:
    """A mesh of three harmonics, modulated in amplitude at the line's very frequency, in noise."""
    time_s = np.arange(round(SECONDS * FS_HZ)) / FS_HZ
    modulation = 1 + 0.5 * np.cos(2 * np.pi * LINE_HZ * time_s)
    mesh = sum(2 * modulation * np.cos(2 * np.pi * h * 813.0 * time_s + h) for h in (1, 2, 3))
    return np.asarray(mesh + rng.standard_normal(time_s.size))


def impacts(rng: np.random.Generator, jitter: float = 0.01) -> FloatArray:
    """Decaying bursts at the line's frequency, their periods straying by `jitter`, in noise."""
    at_s = np.cumsum((1 + jitter * rng.standard_normal(round(SECONDS * LINE_HZ * 1.1))) / LINE_HZ)
    struck = np.zeros(round(SECONDS * FS_HZ))
    struck[(at_s[at_s < SECONDS] * FS_HZ).astype(int)] = 12.0
    time_s = np.arange(240) / FS_HZ
    burst = np.exp(-800 * time_s) * np.sin(2 * np.pi * 3000 * time_s)
    return np.asarray(np.convolve(struck, burst)[: struck.size] + rng.standard_normal(struck.size))


def test_a_modulated_gear_mesh_is_gone_and_impacts_stay():
    rng = np.random.default_rng(1)
    mesh, struck = gear_mesh(rng), impacts(rng)
    assert line_to_noise(mesh) > 1000 > 20 > line_to_noise(signal.prewhitened(mesh))
    assert line_to_noise(signal.prewhitened(struck)) > 50


KURTOGRAM_HZ, COUNT, LEAST_HZ = 20_480.0, 40_960, 460.0
# 20 records of 44 overlapping bands: the spread is known to some 5 %, the mean to 0.05; three to four of these.
SPREAD, MEAN = 0.15, 0.2


def noise(seed=0):
    return np.random.default_rng(seed).standard_normal(COUNT)


def test_gaussian_noise_shows_nothing_beyond_its_scatter():
    pictures = [signal.kurtogram(noise(seed), KURTOGRAM_HZ, least_width_hz=LEAST_HZ) for seed in range(20)]
    # Of N independent samples in a band cut sharply the kurtosis scatters by sqrt(8 / 3 / N); N = width x duration.
    independent = np.diff(pictures[0].band_hz)[:, 0] * (COUNT / KURTOGRAM_HZ - 2 * MIN_END_S)
    ratios = np.array([one.kurtosis for one in pictures]) * np.sqrt(3 / 8 * independent)
    assert ratios.std() == pytest.approx(1.0, abs=SPREAD)
    assert ratios.mean() == pytest.approx(0.0, abs=MEAN)


@pytest.mark.parametrize("ring_hz", [2100.0, 4600.0, 8300.0])
def test_the_most_impulsive_band_is_that_of_the_ringing(ring_hz):
    samples = noise()
    ring_s = np.arange(120) / KURTOGRAM_HZ
    ring = 4 * np.exp(-ring_s * 1200) * np.sin(2 * np.pi * ring_hz * ring_s)
    for first in range(500, COUNT - 200, 700):
        samples[first : first + ring.size] += ring
    low, high = signal.kurtogram(samples, KURTOGRAM_HZ, least_width_hz=LEAST_HZ).best_hz
    assert low < ring_hz < high
    assert high - low < 2600


def test_bands_that_do_not_fit_the_record_are_left_out():
    """Too narrow, the topmost one cut off below Nyquist too; too short for the least samples; beyond another record."""
    picture = signal.kurtogram(noise(), KURTOGRAM_HZ, least_width_hz=LEAST_HZ)
    assert np.diff(picture.band_hz).min() >= LEAST_HZ
    short = signal.kurtogram(noise()[:6144], KURTOGRAM_HZ, least_width_hz=1.0)
    assert short.kurtosis.size > 0
    assert np.diff(short.band_hz).min() * (6144 / KURTOGRAM_HZ - 2 * MIN_END_S) > LEAST_SAMPLES - 1
    within = signal.kurtogram(noise(), KURTOGRAM_HZ, least_width_hz=LEAST_HZ, highest_hz=6000.0)
    assert 0 < within.kurtosis.size < picture.kurtosis.size
    assert within.band_hz.max() <= 6000.0
    for samples, width_hz in ((noise(), 6000.0), (noise()[:512], LEAST_HZ), (noise()[:2100], 1.0)):
        none = signal.kurtogram(samples, KURTOGRAM_HZ, least_width_hz=width_hz)
        assert none.kurtosis.size == none.band_hz.size == 0
        with pytest.raises(DataError, match="longer record"):
            _ = none.best_hz


PICTURE_HZ, SAMPLES, RANGE_HZ = 20_480.0, 4097, (40.0, 1000.0)
# Of a row's highest value, at six and at two samples a column; the picture's 64 colours are 1.6 % apart.
WORST_ROW, MEDIAN_ROW = 0.01, 0.002


def direct_sum(samples, frequency_hz, columns):
    """Modulus of sum x_k w(t - t_k), one row of it, averaged over columns."""
    periods = np.arange(-SAMPLES, SAMPLES + 1) / PICTURE_HZ * frequency_hz
    wavelet = np.exp(-(periods**2) / BANDWIDTH + 2j * np.pi * periods)
    row = np.abs(scipy.signal.fftconvolve(samples, wavelet, mode="full")[SAMPLES : 2 * SAMPLES])
    first = np.arange(0, SAMPLES, -(-SAMPLES // columns))
    means = np.add.reduceat(row, first) / np.diff(np.append(first, SAMPLES))
    return means * 2 * frequency_hz / PICTURE_HZ / np.sqrt(np.pi * BANDWIDTH)


def impulses(*places):
    samples = np.zeros(SAMPLES)
    samples[list(places)] = 1.0
    return samples


@pytest.mark.parametrize("columns", [800, 2048])
@pytest.mark.parametrize(
    "samples",
    [impulses(1695), impulses(300, 1500, 1502, 3900), np.random.default_rng(1).standard_normal(SAMPLES)],
    ids=["odd", "train", "noise"],
)
def test_every_row_is_that_of_the_direct_sum(samples, columns):
    picture = signal.morlet_scalogram(samples, PICTURE_HZ, range_hz=RANGE_HZ, rows=40, columns=columns)
    errors = []
    for frequency_hz, row in zip(picture.frequency_hz, picture.amplitude, strict=True):
        expected = direct_sum(samples, frequency_hz, columns)
        errors.append(np.abs(row - expected).max() / expected.max())
    assert max(errors) < WORST_ROW
    assert np.median(errors) < MEDIAN_ROW


@pytest.mark.parametrize("range_hz", [(0.1, 100.0), (100.0, 9000.0)])
def test_a_range_beyond_the_record_is_refused(range_hz):
    with pytest.raises(ConfigurationError, match="allows"):
        signal.morlet_scalogram(np.zeros(SAMPLES), PICTURE_HZ, range_hz=range_hz)
