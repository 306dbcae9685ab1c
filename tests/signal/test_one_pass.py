import numpy as np
import pytest
import scipy.fft

from srbval.errors import ConfigurationError, DataError
from srbval.signal import (
    BandFilter,
    analytic_signal,
    bandpass,
    butterworth_gain,
    envelope,
    envelope_spectrum_one_pass,
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
# The same bins by another transform.
ROUNDING = 1e-12
# A line's amplitude over 10 s that are no whole number of samples at the lower rate.
LINE = 1e-3
# Mean of the squared envelope over a length that is no whole number of modulation periods.
MEAN_SQUARE = 0.01
# Two bins of a record of 10 s.
BIN_HZ = 0.2


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


def test_what_the_usual_chain_gets_wrong_falls_as_one_over_the_distance_from_the_cut(truth):
    """So it is the Hilbert kernel's, not the filter's, which has died out long before."""
    band_hz, samples, expected = truth
    wrong = np.abs(squared_envelope(bandpass(samples, FS_HZ, band_hz)) - expected) / np.sqrt(expected)
    near, far = (np.median(wrong[round(at * FS_HZ) : round(2 * at * FS_HZ)]) for at in (0.1, 1.0))
    assert 5 < near / far < 20


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


def test_brick_wall_is_the_envelope_of_the_band_s_own_bins():
    samples = noise(20_480)
    lines = scipy.fft.rfft(samples)
    frequency = scipy.fft.rfftfreq(samples.size, 1 / FS_HZ)
    lines[(frequency < BAND_HZ[0]) | (frequency > BAND_HZ[1])] = 0
    analytic = analytic_signal(samples, FS_HZ, BAND_HZ, band_filter=BandFilter.BRICK_WALL)
    np.testing.assert_allclose(np.abs(analytic), envelope(scipy.fft.irfft(lines)), atol=ROUNDING)


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


def test_padding_to_a_fast_length_leaves_size_and_duration():
    count = 205_824
    square, rate = squared_envelope_one_pass(modulated(count), FS_HZ, BAND_HZ)
    inside = square[round(rate / 10) : -round(rate / 10)]
    assert inside.mean() == pytest.approx(9 * (1 + 0.2**2 / 2), rel=MEAN_SQUARE)
    assert square.size / rate == pytest.approx(count / FS_HZ, abs=1 / rate)


@pytest.mark.parametrize("transform", [squared_envelope_one_pass, analytic_signal])
def test_no_transform_has_an_awkward_length(transform, monkeypatch):
    """One sample less than a fast length costs many times more; 20,483 is a prime."""
    lengths = []
    for name in ("rfft", "ifft"):
        real = getattr(scipy.fft, name)

        def spied(values, n=None, *, real=real, **options):
            lengths.append(n or len(values))
            return real(values, n=n, **options)

        monkeypatch.setattr(scipy.fft, name, spied)
    transform(noise(20_483), FS_HZ, BAND_HZ)
    assert len(lengths) == 2
    assert all(length == scipy.fft.next_fast_len(length) for length in lengths)


def test_rate_holds_the_square_without_aliases():
    """A beat as wide as the band keeps its frequency; at half the rate it would fold."""
    time_s = np.arange(204_800) / FS_HZ
    samples = np.cos(2 * np.pi * 1450 * time_s) + np.cos(2 * np.pi * 2750 * time_s)
    spectrum = envelope_spectrum_one_pass(samples, FS_HZ, BAND_HZ)
    assert spectrum.frequency_hz[np.argmax(spectrum.amplitude)] == pytest.approx(1300, abs=BIN_HZ)


def test_ends_are_dropped_and_short_records_refused():
    with pytest.raises(DataError, match="longer"):
        envelope_spectrum_one_pass(noise(1500), FS_HZ, BAND_HZ)
    with pytest.raises(ConfigurationError, match="Nyquist"):
        squared_envelope_one_pass(noise(5000), FS_HZ, (5000.0, 12_000.0))
