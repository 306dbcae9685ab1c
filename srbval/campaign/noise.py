"""Noise at a stated ratio: white, or with the spectrum of a recording."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from srbval.errors import ConfigurationError

FloatArray = NDArray[np.float64]

WHITE = "white"
BLOCK = 2048  # samples of the blocks whose spectra are averaged: lines of the recording are smeared, its shape stays


@dataclass(frozen=True, kw_only=True, eq=False)
class Colour:
    """Spectral density of a noise over frequency; `name` says whose. Without a density it is white."""

    name: str
    frequency_hz: FloatArray | None = None
    density: FloatArray | None = None


def colour_of(noise: str) -> Colour:
    """``white``, or the colour of the recording of that path.

    A recording's is its averaged spectrum (Welch), all it holds: its machine's lines too, smeared. Above its Nyquist
    frequency there is none. Raises what reading a recording raises.
    """
    if noise == WHITE:
        return Colour(name=WHITE)
    from scipy.signal import welch

    from srbval.recordings.registry import load_registered

    recording = load_registered(noise)
    name = recording.channel or (recording.axes or tuple(recording.channels))[-1]
    samples = recording.channels[name]
    frequency, density = welch(samples - samples.mean(), recording.fs_hz, nperseg=min(BLOCK, samples.size))
    return Colour(
        name=f"{recording.name}, channel {name} ({recording.origin.value})", frequency_hz=frequency, density=density
    )


def add_noise(
    samples: FloatArray, fs_hz: float, *, snr_db: float, colour: Colour, random: np.random.Generator
) -> FloatArray:
    """`samples`, shape [n], with Gaussian noise of `colour`; `snr_db` is the ratio of the variances [dB].

    Raises `ConfigurationError` where the colour leaves nothing at this rate.
    """
    noise = random.standard_normal(samples.size)
    if colour.frequency_hz is not None and colour.density is not None:
        lines = np.fft.rfft(noise)
        at = np.arange(lines.size) * fs_hz / samples.size
        shape = np.interp(at, colour.frequency_hz, np.sqrt(colour.density), right=0.0)
        shape[0] = 0.0
        noise = np.fft.irfft(lines * shape, samples.size)
    power = float(np.var(noise))
    if power == 0:
        raise ConfigurationError(f"noise of {colour.name}: nothing is left of it at {fs_hz:g} Hz; take white noise.")
    scale = np.sqrt(np.var(samples) / power) * 10 ** (-snr_db / 20)
    return np.asarray(samples + scale * noise)
