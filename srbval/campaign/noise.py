"""Added noise at a stated signal-to-noise ratio, white or with the spectrum of a recording."""

from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.errors import ConfigurationError
from srbval.recordings.registry import load_registered

WHITE = "white"
SEGMENT = 2048  # samples per Welch segment: smears the recording's lines, keeps the shape of its spectrum


@dataclass(frozen=True, kw_only=True, eq=False)
class NoiseSpectrum:
    """Power spectral density of a noise over frequency; `name` says where it is from. White without a density."""

    name: str
    frequency_hz: FloatArray | None = None
    density: FloatArray | None = None


def noise_spectrum(noise: str) -> NoiseSpectrum:
    """``white``, or the spectrum of the recording at that path.

    A recording's is its averaged spectrum (Welch) with all it contains: its machine's lines too, smeared. Above its
    Nyquist frequency it is zero. Raises what reading a recording raises.
    """
    if noise == WHITE:
        return NoiseSpectrum(name=WHITE)
    from srbval.signal import power_density

    recording = load_registered(noise)
    name = recording.channel or (recording.axes or tuple(recording.channels))[-1]
    samples = recording.channels[name]
    frequency, density = power_density(samples - samples.mean(), recording.fs_hz, SEGMENT / recording.fs_hz)
    return NoiseSpectrum(
        name=f"{recording.name}, channel {name} ({recording.origin.value})", frequency_hz=frequency, density=density
    )


def add_noise(
    samples: FloatArray, fs_hz: float, *, snr_db: float, spectrum: NoiseSpectrum, random: np.random.Generator
) -> FloatArray:
    """`samples`, shape [n], with Gaussian noise of `spectrum`; `snr_db` is the ratio of the variances [dB].

    Raises `ConfigurationError` where the spectrum is zero at all frequencies of this sampling rate.
    """
    noise = random.standard_normal(samples.size)
    if spectrum.frequency_hz is not None and spectrum.density is not None:
        lines = np.fft.rfft(noise)
        frequency_hz = np.arange(lines.size) * fs_hz / samples.size
        gain = np.interp(frequency_hz, spectrum.frequency_hz, np.sqrt(spectrum.density), right=0.0)
        gain[0] = 0.0
        noise = np.fft.irfft(lines * gain, samples.size)
    power = float(np.var(noise))
    if power == 0:
        raise ConfigurationError(f"noise of {spectrum.name}: nothing is left of it at {fs_hz:g} Hz; use white noise.")
    scale = np.sqrt(np.var(samples) / power) * 10 ** (-snr_db / 20)
    return np.asarray(samples + scale * noise)
