"""Added noise: its ratio, its spectrum."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import welch

from srbval.campaign.noise import WHITE, NoiseSpectrum, add_noise, noise_spectrum
from srbval.errors import ConfigurationError
from srbval.models.run_file import write_run
from srbval.models.simulate import simulate
from srbval.scene import paper_scene

ROUNDING_DB = 1e-6  # the ratio is set on the noise that was drawn, so it holds to rounding
SCATTER = 0.3  # of the density about its shape: 199 averages scatter by 7 %, these are four standard deviations
LEAKAGE = 1e-6  # of the density beyond the spectrum's last frequency, through the window's side lobes


@pytest.mark.parametrize("snr_db", [20.0, 0.0, -10.0])
def test_noise_keeps_its_ratio_and_its_spectrum(snr_db: float) -> None:
    fs_hz, random = 10_000.0, np.random.default_rng(3)
    frequency_hz = np.linspace(0, 2500, 200)
    spectrum = NoiseSpectrum(name="test", frequency_hz=frequency_hz, density=1 / (100 + frequency_hz) ** 2)
    samples = np.sin(2 * np.pi * 50 * np.arange(100_000) / fs_hz)
    noise = add_noise(samples, fs_hz, snr_db=snr_db, spectrum=spectrum, random=random) - samples
    assert 10 * np.log10(np.var(samples) / np.var(noise)) == pytest.approx(snr_db, abs=ROUNDING_DB)
    found_hz, density = welch(noise, fs_hz, nperseg=1000)
    inside, outside = (found_hz > 50) & (found_hz < 2000), found_hz > 2700
    ratio = density[inside] * (100 + found_hz[inside]) ** 2
    assert np.all(np.abs(ratio / np.median(ratio) - 1) < SCATTER)
    assert density[outside].max() < LEAKAGE * density[inside].max()


def test_a_spectrum_without_power_at_this_rate_is_refused() -> None:
    spectrum = NoiseSpectrum(name="high", frequency_hz=np.array([0.0, 90.0, 100.0]), density=np.array([0.0, 0.0, 1.0]))
    with pytest.raises(ConfigurationError, match="nothing is left of it at 100 Hz"):
        add_noise(np.ones(64), 100.0, snr_db=0.0, spectrum=spectrum, random=np.random.default_rng(0))


def test_noise_of_a_recording(tmp_path: Path) -> None:
    """Its name says whose spectrum it is and that it was simulated."""
    file = tmp_path / "run.h5"
    write_run(simulate(paper_scene(model="kinematic", duration_s=0.1, settle_s=0.0)), file)
    spectrum = noise_spectrum(str(file))
    assert "simulated" in spectrum.name
    assert spectrum.density is not None
    assert noise_spectrum(WHITE).density is None
