"""Spectra: amplitudes, power density, and records whose amplitudes or phases alone are kept."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.fft
import scipy.signal

from srbval.arrays import ComplexArray, FloatArray
from srbval.errors import DataError

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Spectrum:
    """Amplitude over frequency: `frequency_hz` and `amplitude`, both [m], from zero upwards.

    `resolution_hz` is one over the record's duration; the bins may stand closer than that.
    """

    frequency_hz: FloatArray
    amplitude: FloatArray
    resolution_hz: float

    def height_at(self, line_hz: float) -> float:
        """Height of a line: the larger of the two bins it lies between."""
        return float(self.amplitude[np.argsort(np.abs(self.frequency_hz - line_hz))[:2]].max())

    def to_frame(self) -> pandas.DataFrame:
        """A pandas table of `frequency_hz` and `amplitude`."""
        import pandas

        return pandas.DataFrame({"frequency_hz": self.frequency_hz, "amplitude": self.amplitude})

    def __repr__(self) -> str:
        count, last = self.frequency_hz.size, self.frequency_hz[-1] if self.frequency_hz.size else 0.0
        return f"<Spectrum to {last:g} Hz, {count} bins, resolution {self.resolution_hz:.3g} Hz>"


def amplitude_spectrum(samples: FloatArray, fs_hz: float) -> Spectrum:
    """Spectrum of `samples` [n] about its mean; a sine of amplitude a on a bin reads a.

    No window, so that the resolution is the record's own; padded to a fast length. For a carrier A modulated with
    depth m the line reads A m in the spectrum of the envelope and 2 A^2 m in that of the squared envelope.
    """
    length = scipy.fft.next_fast_len(samples.size, real=True)
    lines = np.abs(scipy.fft.rfft(samples - samples.mean(), n=length)) * (2 / samples.size)
    return Spectrum(
        frequency_hz=np.arange(lines.size, dtype=np.float64) * (fs_hz / length),
        amplitude=lines,
        resolution_hz=fs_hz / samples.size,
    )


def power_density(samples: FloatArray, fs_hz: float, segment_s: float) -> tuple[FloatArray, FloatArray]:
    """Frequencies [Hz] and power density of `samples` [n] per Hz, by Welch's method.

    Hann segments of `segment_s`, or of the whole record where it is shorter, half overlapping, freed of their means.
    """
    return scipy.signal.welch(samples, fs_hz, nperseg=min(round(segment_s * fs_hz), samples.size))


def kurtosis(samples: FloatArray | ComplexArray) -> float:
    """Mean fourth power of the modulus over the square of the second, of `samples` [n] about zero; nan for zeros.

    3 for Gaussian noise, 2 for complex Gaussian noise, 3/2 for a sine, 1 for a complex tone.
    """
    power = np.square(samples.real) + np.square(samples.imag)
    mean = float(np.mean(power))
    return float(np.mean(power * power)) / mean**2 if mean else math.nan


def prewhitened(samples: FloatArray) -> FloatArray:
    """`samples` [n] with every spectral line brought to the same height and its phase kept, of variance one, [m].

    The real cepstrum is set to zero but for its first value, that is X / |X| (Borghesani, Pennacchi, Randall, Sawalhi &
    Ricci 2013, Mech. Syst. Signal Process. 36, 370; authors and page quoted from memory, not checked). A tone or a
    modulated gear mesh is some narrow lines among all: of equal height they carry next to nothing. Impacts that stray a
    little are spread over every line of a band, whose phases keep them; resonances and loud bands lose their weight.
    Impacts that never stray are tones too and are lost as well. The mean is removed; m is the largest length not above
    n that transforms fast. Raises `DataError` where the record is constant.
    """
    size = scipy.fft.prev_fast_len(samples.size, real=True)
    lines = scipy.fft.rfft(samples[:size] - samples[:size].mean())
    height = np.abs(lines)
    if not height.any():
        raise DataError("the record is constant and cannot be whitened; check the channel.")
    lines = np.divide(lines, height, out=np.zeros_like(lines), where=height > 0)
    lines[0] = 0.0
    white = scipy.fft.irfft(lines, n=size)
    return np.asarray(white / white.std())


def phase_randomised(samples: FloatArray, seed: int) -> FloatArray:
    """A signal, [n], with the amplitude of every line of `samples`, [n], and phases drawn by `seed`.

    The surrogate of Theiler, Eubank, Longtin, Galdrikian & Farmer (1992, Physica D 58, 77; quoted from memory, not
    checked). What many lines make is normal by the central limit theorem, whatever impacts there were; a tone stays
    one. Mean and power are kept.
    """
    lines = scipy.fft.rfft(samples)
    turned = np.abs(lines) * np.exp(2j * np.pi * np.random.default_rng(seed).random(lines.size))
    turned[0] = lines[0]
    if samples.size % 2 == 0:
        turned[-1] = lines[-1]  # as the mean, a line without a phase
    return np.asarray(scipy.fft.irfft(turned, n=samples.size))
