import numpy as np
import pytest
import scipy.fft

from srbval.errors import ConfigurationError
from srbval.signal import (
    BandFilter,
    analytic_signal,
    bandpass,
    butterworth_gain,
    squared_envelope,
    squared_envelope_one_pass,
)

FS_HZ, BAND_HZ = 20_480.0, (1400.0, 2800.0)
BANDS_HZ = [(1400.0, 2800.0), (500.0, 1500.0), (2000.0, 4000.0)]
INTERIOR = 1e-4
# Farther than this from the ends nothing of them is left in the one pass.
END = round(0.05 * FS_HZ)
INSIDE = slice(END, -END)
# The square at the lower rate has the full rate's spectrum, to rounding.
NO_ALIAS = 1e-9
# The modulus at the lower rate is wrong by per cents.
MODULUS_ALIAS = (0.01, 0.2)
# A line's amplitude over 10 s that are no whole number of samples at the lower rate.
LINE = 1e-3


def noise(count=204_800, seed=1):
    return np.random.default_rng(seed).standard_normal(count)


def at_full_rate(square, count):
    return scipy.fft.irfft(scipy.fft.rfft(square) * (count / square.size), n=count)


def error(found, expected):
    return np.abs(found - expected)[INSIDE].max() / expected[INSIDE].max()


@pytest.fixture(scope="module", params=BANDS_HZ, ids=str)
def truth(request):
    """A record cut from the middle of a longer one, and the squared envelope that the longer one has there."""
    count, band_hz = 204_800, request.param
    long = noise(3 * count)
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
    # The mistake of keeping the band's bins alone, without the filter's slopes, is not within that.
    sharp, _ = squared_envelope_one_pass(samples, FS_HZ, band_hz, band_filter=BandFilter.BRICK_WALL)
    assert error(at_full_rate(sharp, samples.size), reference) > 100 * INTERIOR


def test_a_modulus_taken_at_the_lower_rate_is_wrong_by_per_cents():
    """It is not band-limited: its square is to be had at the lower rate, the modulus itself only at the full one."""
    samples = noise()
    square, _ = squared_envelope_one_pass(samples, FS_HZ, BAND_HZ, band_filter=BandFilter.BRICK_WALL)
    full = np.abs(analytic_signal(samples, FS_HZ, BAND_HZ, band_filter=BandFilter.BRICK_WALL))
    spectra = {
        "square": (scipy.fft.rfft(square) / square.size, scipy.fft.rfft(full**2) / full.size),
        "modulus": (scipy.fft.rfft(np.sqrt(square)) / square.size, scipy.fft.rfft(full) / full.size),
    }
    bins = slice(10, square.size // 2 - 10)
    errors = {k: np.sqrt(np.mean(np.abs((a - b[: a.size])[bins]) ** 2) / np.mean(np.abs(b[bins]) ** 2))
              for k, (a, b) in spectra.items()}  # fmt: skip
    assert errors["square"] < NO_ALIAS
    assert MODULUS_ALIAS[0] < errors["modulus"] < MODULUS_ALIAS[1]


def modulated(count):
    time_s = np.arange(count) / FS_HZ
    return 3 * (1 + 0.2 * np.cos(2 * np.pi * 50 * time_s)) * np.cos(2 * np.pi * 2000 * time_s)


def test_line_of_a_modulated_carrier_is_twice_its_square_times_the_depth():
    samples = modulated(204_800 + 2 * END)
    square, rate = squared_envelope_one_pass(samples, FS_HZ, BAND_HZ)
    assert line_at_50_hz(square[round(0.05 * rate) :][: round(10 * rate)], rate) == pytest.approx(
        2 * 3**2 * 0.2, rel=LINE
    )
    modulus = np.abs(analytic_signal(samples, FS_HZ, BAND_HZ))[INSIDE]
    assert line_at_50_hz(modulus, FS_HZ) == pytest.approx(3 * 0.2, rel=LINE)


def line_at_50_hz(samples, fs_hz):
    turning = np.exp(-2j * np.pi * 50 * np.arange(samples.size) / fs_hz)
    return 2 * abs(turning @ (samples - samples.mean())) / samples.size


def test_a_band_beyond_nyquist_is_refused():
    with pytest.raises(ConfigurationError, match="Nyquist"):
        squared_envelope_one_pass(noise(5000), FS_HZ, (5000.0, 12_000.0))
