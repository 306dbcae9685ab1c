import dataclasses
import functools

import numpy as np
import pytest

from srbval.errors import ConfigurationError
from srbval.signal import morlet_scalogram
from srbval.signal.scalogram import BANDWIDTH
from srbval.studies.reading_accuracy.scalogram_check import TRANSFORMS, check_scalogram, pywt_scalogram

FS_HZ = 20_480.0
SAMPLES = 10_240
# A tone in its own row, once pywt's differencing is divided out: limited by the wavelet's finite support.
TONE = 1e-5
# pywt's nearest-point sampling of the wavelet, as a share of the row's peak (half a sample aside).
IMPULSE_BELOW_015, IMPULSE_ABOVE = 0.025, 0.065
FEW = {"rows": 8, "places": (0.4137,)}
# The closed form is exact but for the instants that its columns are averaged over.
CLOSED_FORM_ERROR = 1e-3
# pywt's own settings: its lowest rows miss an impulse by more than a seventh of their peak, tones by half a per cent.
PYWT_IMPULSE_ERROR, PYWT_TONE_ERROR = 0.14, 0.005


@pytest.mark.parametrize("tone_hz", [60.0, 250.0, 1000.0, 3000.0, 6000.0])
def test_a_tone_reads_its_amplitude_at_its_frequency(tone_hz):
    tone = 3.0 * np.cos(2 * np.pi * tone_hz * np.arange(SAMPLES) / FS_HZ)
    result = pywt_scalogram(tone, FS_HZ, range_hz=(tone_hz, 1.1 * tone_hz), rows=2, columns=50)
    np.testing.assert_allclose(result.amplitude[0, 15:35], 3.0, rtol=TONE)


def test_an_impulse_draws_the_wavelet_in_every_row():
    impulse = np.zeros(SAMPLES)
    impulse[SAMPLES // 2] = 1.0
    result = pywt_scalogram(impulse, FS_HZ, range_hz=(50.0, 7000.0), rows=30, columns=SAMPLES)
    for frequency_hz, row in zip(result.frequency_hz, result.amplitude, strict=True):
        error = min(relative_error(row, frequency_hz, shift) for shift in (-0.5, 0.0, 0.5))
        assert error < (IMPULSE_BELOW_015 if frequency_hz < 0.15 * FS_HZ else IMPULSE_ABOVE)


def relative_error(row, frequency_hz, shift):
    periods = (np.arange(SAMPLES) - SAMPLES / 2 + shift) / FS_HZ * frequency_hz
    peak = 2 * frequency_hz / FS_HZ / np.sqrt(np.pi * BANDWIDTH)
    return np.abs(row / peak - np.exp(-(periods**2) / BANDWIDTH)).max()


def test_columns_are_means_and_times_are_their_middles():
    samples = np.random.default_rng(1).standard_normal(SAMPLES)
    fine = pywt_scalogram(samples, FS_HZ, range_hz=(500.0, 2000.0), rows=3, columns=SAMPLES)
    coarse = pywt_scalogram(samples, FS_HZ, range_hz=(500.0, 2000.0), rows=3, columns=64)
    np.testing.assert_allclose(coarse.amplitude, fine.amplitude.reshape(3, 64, -1).mean(axis=2))
    np.testing.assert_allclose(coarse.time_s, fine.time_s.reshape(64, -1).mean(axis=1))


def test_rows_are_log_spaced_and_edges_shrink_with_frequency():
    result = pywt_scalogram(np.random.default_rng(2).standard_normal(SAMPLES), FS_HZ, range_hz=(100.0, 1600.0), rows=5)
    np.testing.assert_allclose(result.frequency_hz, [100.0, 200.0, 400.0, 800.0, 1600.0])
    np.testing.assert_allclose(result.edge_s * result.frequency_hz, np.sqrt(BANDWIDTH))


@pytest.mark.parametrize("range_hz", [(1.0, 1000.0), (100.0, 9000.0), (500.0, 500.0)])
def test_range_beyond_the_record_names_what_it_allows(range_hz):
    with pytest.raises(ConfigurationError, match=r"allows 4\.9 to 7168 Hz"):
        pywt_scalogram(np.zeros(SAMPLES), FS_HZ, range_hz=range_hz)


def test_the_closed_form_passes_at_every_row_of_the_figure():
    check = check_scalogram("closed-form Morlet")
    assert check.passed
    assert check.impulse_error < CLOSED_FORM_ERROR
    assert check.tone_error < CLOSED_FORM_ERROR


def test_pywt_as_it_comes_does_not():
    """The mistake of drawing impulses with an integer-indexed wavelet: the lowest rows are wrong by their own size."""
    check = check_scalogram("pywt.cwt as it comes", **FEW)
    assert not check.passed
    assert check.impulse_error > PYWT_IMPULSE_ERROR
    assert check.tone_error > PYWT_TONE_ERROR


@pytest.mark.parametrize("kind", ["late", "low", "stepped"])
def test_a_planted_error_is_caught(kind, monkeypatch):
    monkeypatch.setitem(TRANSFORMS, kind, functools.partial(planted, kind=kind))
    assert not check_scalogram(kind).passed


def planted(samples, fs_hz, *, kind, **options):
    picture = morlet_scalogram(samples, fs_hz, **options)
    image = {
        "late": lambda a: np.roll(a, 1, axis=1),
        "low": lambda a: 0.99 * a,
        "stepped": lambda a: np.repeat(a[:, ::2], 2, axis=1)[:, : a.shape[1]],
    }[kind](picture.amplitude)
    return dataclasses.replace(picture, amplitude=image)
