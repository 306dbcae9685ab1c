import numpy as np
import pytest
import scipy.fft

from srbval.errors import ConfigurationError, DataError
from srbval.signal import bandpass, squared_envelope
from srbval.signal.one_pass import envelope_spectrum_one_pass, squared_envelope_one_pass

FS_HZ, BAND_HZ = 20_480.0, (1400.0, 2800.0)
INTERIOR = 1e-4


def noise(count=204_800):
    return np.random.default_rng(1).standard_normal(count)


def at_full_rate(square, count):
    return scipy.fft.irfft(scipy.fft.rfft(square) * (count / square.size), n=count)


def test_interior_equals_the_papers_chain():
    samples = noise()
    square, _ = squared_envelope_one_pass(samples, FS_HZ, BAND_HZ)
    reference = squared_envelope(bandpass(samples, FS_HZ, BAND_HZ))
    inside = slice(20_480, -20_480)
    error = (at_full_rate(square, samples.size) - reference)[inside]
    assert np.abs(error).max() < INTERIOR * reference[inside].max()
    # The mistake of keeping the band's bins alone, without the filter's slopes, is not within that.
    sharp, _ = squared_envelope_one_pass(samples, FS_HZ, BAND_HZ, brick_wall=True)
    assert np.abs(at_full_rate(sharp, samples.size) - reference)[inside].max() > 100 * INTERIOR * reference.max()


def modulated(count):
    time_s = np.arange(count) / FS_HZ
    return 3 * (1 + 0.2 * np.cos(2 * np.pi * 50 * time_s)) * np.cos(2 * np.pi * 2000 * time_s)


def test_line_of_a_modulated_carrier():
    spectrum = envelope_spectrum_one_pass(modulated(204_800), FS_HZ, BAND_HZ, end_s=0.0)
    near = np.abs(spectrum.frequency_hz - 50) < 0.5
    assert spectrum.amplitude[near].max() == pytest.approx(2 * 3**2 * 0.2, rel=0.02)


def test_padding_to_a_fast_length_leaves_size_and_duration():
    count = 205_824
    square, rate = squared_envelope_one_pass(modulated(count), FS_HZ, BAND_HZ)
    inside = square[round(rate / 10) : -round(rate / 10)]
    assert inside.mean() == pytest.approx(9 * (1 + 0.2**2 / 2), rel=0.01)
    assert square.size / rate == pytest.approx(count / FS_HZ, abs=1 / rate)


def test_rate_holds_the_square_without_aliases():
    """A beat as wide as the band keeps its frequency; at half the rate it would fold."""
    time_s = np.arange(204_800) / FS_HZ
    samples = np.cos(2 * np.pi * 1450 * time_s) + np.cos(2 * np.pi * 2750 * time_s)
    spectrum = envelope_spectrum_one_pass(samples, FS_HZ, BAND_HZ)
    assert spectrum.frequency_hz[np.argmax(spectrum.amplitude)] == pytest.approx(1300, abs=0.2)


def test_ends_are_dropped_and_short_records_refused():
    with pytest.raises(DataError, match="longer"):
        envelope_spectrum_one_pass(noise(1500), FS_HZ, BAND_HZ)
    with pytest.raises(ConfigurationError, match="Nyquist"):
        squared_envelope_one_pass(noise(5000), FS_HZ, (5000.0, 12_000.0))
