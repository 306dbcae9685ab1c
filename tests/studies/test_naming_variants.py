"""The improved envelope spectrum: noise modulated in one band shows its cyclic frequency there, white noise none."""

from __future__ import annotations

import numpy as np
import scipy.signal
import scipy.stats

from srbval.signal.periodogram import PADDING
from srbval.studies.naming_variants.cyclic_coherence import cyclic_coherence, exponential_ratio

FS_HZ, SECONDS, LIMIT_HZ, CYCLIC_HZ = 8000.0, 6.0, 600.0, 87.4
TIME_S = np.arange(round(FS_HZ * SECONDS)) / FS_HZ


def made(depth: float, seed: int = 1) -> np.ndarray:
    """White noise, of which the band from 2400 to 3200 Hz is modulated by three harmonics."""
    rng = np.random.default_rng(seed)
    white, carrier = rng.standard_normal((2, TIME_S.size))
    band = scipy.signal.sosfiltfilt(scipy.signal.butter(4, (2400, 3200), "bandpass", fs=FS_HZ, output="sos"), carrier)
    times = sum(np.cos(2 * np.pi * n * CYCLIC_HZ * TIME_S) for n in (1, 2, 3))
    return white + 3 * depth * times * band


def at(found, hz: float) -> int:
    return round(hz / found.step_hz)


def test_a_modulated_band_shows_its_cyclic_frequencies_there_and_nowhere_else() -> None:
    found = cyclic_coherence(made(1.0), FS_HZ, LIMIT_HZ)
    own, other = found.improved_envelope_spectrum(0.6, 0.8), found.improved_envelope_spectrum(0.05, 0.5)
    for harmonic in (1, 2, 3, 4):  # the fourth: 3 + 1 and 2 + 2
        line = at(found, harmonic * CYCLIC_HZ)
        noise = np.median(own[line + 5 * PADDING : line + 60 * PADDING])
        assert own[line] > 20 * noise
        assert other[line] < 3 * np.median(other)
        assert np.argmax(own[line - 3 * PADDING : line + 3 * PADDING]) - 3 * PADDING in range(-2, 3)


def test_coherence_of_white_noise_is_that_of_its_independent_blocks() -> None:
    """The mean of |coherence|^2 is one over the number of independent values that it averages."""
    found = cyclic_coherence(made(0.0), FS_HZ, LIMIT_HZ)
    spectrum = found.improved_envelope_spectrum()[2 * PADDING :: PADDING]
    assert spectrum.mean() < 5 / (SECONDS * LIMIT_HZ / 2)
    assert np.std(spectrum) / spectrum.mean() < 0.7  # averaged over several carriers: narrower than exponential


def test_ratios_of_noise_are_exponential() -> None:
    """In the middle: the gamma distribution is exact neither for carriers that overlap nor far out."""
    found = cyclic_coherence(made(0.0), FS_HZ, LIMIT_HZ)
    spectrum = found.improved_envelope_spectrum()
    masked = np.zeros(spectrum.size, dtype=bool)
    ratio = exponential_ratio(spectrum, masked)[20 * PADDING :: PADDING]
    for share in (0.25, 0.5, 0.75, 0.95):
        assert (
            np.mean(ratio > -np.log(1 - share)) == 1 - share or abs(np.mean(ratio < -np.log(1 - share)) - share) < 0.04
        )
