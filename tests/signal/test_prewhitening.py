"""Prewhitening takes away what repeats exactly and keeps impacts that stray; random phases take away impacts too."""

from __future__ import annotations

import numpy as np
import pytest

from srbval.arrays import FloatArray
from srbval.errors import DataError
from srbval.signal import (
    Periodogram,
    drop_ends,
    end_s,
    kurtosis,
    peak_snr,
    phase_randomised,
    prewhitened,
    squared_envelope_one_pass,
)

FS_HZ, SECONDS, LINE_HZ, SHAFT_HZ = 12000.0, 4.0, 107.3, 29.9
BAND_HZ = (200.0, 5600.0)
ROUNDING = 1e-9


def line_to_noise(samples: FloatArray) -> float:
    square, rate = squared_envelope_one_pass(samples, FS_HZ, BAND_HZ)
    record = Periodogram.of(drop_ends(square, rate, end_s(BAND_HZ)), rate, limit_hz=600.0, shaft_hz=SHAFT_HZ)
    return peak_snr(record, LINE_HZ, 1.0) or 0.0


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


def test_a_modulated_gear_mesh_is_gone_and_impacts_stay() -> None:
    rng = np.random.default_rng(1)
    mesh, struck = gear_mesh(rng), impacts(rng)
    assert line_to_noise(mesh) > 1000 > 20 > line_to_noise(prewhitened(mesh))
    assert line_to_noise(prewhitened(struck)) > 50


def test_every_line_has_the_same_height_and_keeps_its_phase() -> None:
    samples = impacts(np.random.default_rng(3))
    white = np.fft.rfft(prewhitened(samples))[1:-1]
    before = np.fft.rfft(samples[: prewhitened(samples).size])[1:-1]
    assert np.allclose(np.abs(white), np.abs(white[0]))
    assert np.allclose(np.angle(white / before), 0, atol=1e-6)
    assert np.allclose(prewhitened(-7 * samples), -prewhitened(samples))


def test_a_constant_record_is_refused() -> None:
    with pytest.raises(DataError, match="constant"):
        prewhitened(np.full(1000, 3.0))


@pytest.mark.parametrize("size", [4096, 4097])
def test_random_phases_keep_the_spectrum(size: int) -> None:
    samples = np.random.default_rng(1).standard_normal(size) + 0.3
    found = phase_randomised(samples, 2)
    np.testing.assert_allclose(np.abs(np.fft.rfft(found)), np.abs(np.fft.rfft(samples)), rtol=ROUNDING)
    assert found.mean() == pytest.approx(samples.mean(), rel=ROUNDING)
    assert np.abs(np.corrcoef(found, samples)[0, 1]) < 0.1


def test_random_phases_make_noise_of_impacts() -> None:
    """Kurtosis 3 within four standard deviations of the estimate, 4 sqrt(24 / n)."""
    rng = np.random.default_rng(3)
    size = 40_000
    impacts = rng.standard_normal(size) * (rng.random(size) < 0.02)
    before, after = (kurtosis(x) for x in (impacts, phase_randomised(impacts, 4)))
    assert before > 50
    assert after == pytest.approx(3.0, abs=4 * np.sqrt(24 / size))
