"""A phase-randomised signal: the spectrum is kept, impacts are not, and a seed says all."""

from __future__ import annotations

import numpy as np
import pytest

from srbval.signal.prewhitening import phase_randomised

ROUNDING = 1e-9


@pytest.mark.parametrize("size", [4096, 4097])
def test_the_spectrum_is_kept(size: int) -> None:
    samples = np.random.default_rng(1).standard_normal(size) + 0.3
    found = phase_randomised(samples, 2)
    np.testing.assert_allclose(np.abs(np.fft.rfft(found)), np.abs(np.fft.rfft(samples)), rtol=ROUNDING)
    assert found.mean() == pytest.approx(samples.mean(), rel=ROUNDING)
    assert np.abs(np.corrcoef(found, samples)[0, 1]) < 0.1


def test_impacts_become_normal() -> None:
    """Kurtosis 3 within four standard deviations of the estimate, 4 sqrt(24 / n)."""
    rng = np.random.default_rng(3)
    size = 40_000
    impacts = rng.standard_normal(size) * (rng.random(size) < 0.02)
    before, after = (np.mean(x**4) / np.mean(x**2) ** 2 for x in (impacts, phase_randomised(impacts, 4)))
    assert before > 50
    assert after == pytest.approx(3.0, abs=4 * np.sqrt(24 / size))


def test_a_seed_says_all() -> None:
    samples = np.random.default_rng(5).standard_normal(1000)
    assert np.array_equal(phase_randomised(samples, 6), phase_randomised(samples, 6))
    assert not np.allclose(phase_randomised(samples, 6), phase_randomised(samples, 7))
