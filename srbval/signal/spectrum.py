"""Spectra, kurtogram and scalogram; prewhitening of records."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.fft  # scipy.signal takes half a second: scipy loads it at its first use

from srbval.arrays import ComplexArray, FloatArray
from srbval.bridges import NotebookObject, require_xarray
from srbval.errors import ConfigurationError, DataError
from srbval.signal.envelope import MIN_END_S, analytic_signal, drop_ends, end_s

if TYPE_CHECKING:
    import pandas
    import xarray

LEAST_SAMPLES = 64  # least number of independent samples of an envelope for its kurtosis
BANDWIDTH = 1.5  # B of the Morlet wavelet exp(-x^2 / B) exp(2 i pi x), x in periods of its row: some 18 %
REACH = 5  # half length of the wavelet in periods, at 6e-8 of its peak
LARGEST_SHARE = 0.1  # highest row, as a share of the sampling rate: above it the wavelet has too few samples
SCALOGRAM_ROWS, SCALOGRAM_COLUMNS = 120, 800
SCALOGRAM_HZ = (40.0, 1000.0)  # as in Figure 14


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Spectrum(NotebookObject):
    """Amplitude at each frequency; `resolution_hz` is one over the record's duration, the frequencies may be closer."""

    frequency_hz: FloatArray
    amplitude: FloatArray
    resolution_hz: float

    def height_at(self, line_hz: float) -> float:
        """Height of a line: the larger of the two bins nearest to it."""
        return float(self.amplitude[np.argsort(np.abs(self.frequency_hz - line_hz))[:2]].max())

    def to_frame(self) -> pandas.DataFrame:
        """Pandas table of `frequency_hz` and `amplitude`."""
        import pandas

        return pandas.DataFrame({"frequency_hz": self.frequency_hz, "amplitude": self.amplitude})

    def to_xarray(self) -> xarray.DataArray:
        """Amplitude as an array of xarray over ``frequency_hz``."""
        coordinate = ("frequency_hz", self.frequency_hz, {"units": "Hz"})
        about = {"resolution_hz": self.resolution_hz}
        data: xarray.DataArray = require_xarray().DataArray(self.amplitude, [coordinate], attrs=about, name="amplitude")
        return data

    def __repr__(self) -> str:
        count, last = self.frequency_hz.size, self.frequency_hz[-1] if self.frequency_hz.size else 0.0
        return f"<Spectrum to {last:g} Hz, {count} bins, resolution {self.resolution_hz:.3g} Hz>"


def amplitude_spectrum(samples: FloatArray, fs_hz: float) -> Spectrum:
    """Spectrum of `samples` [n] minus their mean, without a window; a sine of amplitude a on a bin has the height a."""
    length = scipy.fft.next_fast_len(samples.size, real=True)
    lines = np.abs(scipy.fft.rfft(samples - samples.mean(), n=length)) * (2 / samples.size)
    return Spectrum(
        frequency_hz=np.arange(lines.size, dtype=np.float64) * (fs_hz / length),
        amplitude=lines,
        resolution_hz=fs_hz / samples.size,
    )


def envelope_spectrum(samples: FloatArray, fs_hz: float, band_hz: tuple[float, float]) -> Spectrum:
    """Amplitude spectrum of the envelope of `samples` [n] in `band_hz` [Hz], without the ends; for figures."""
    modulus = np.abs(analytic_signal(np.asarray(samples, dtype=np.float64), fs_hz, band_hz))
    return amplitude_spectrum(drop_ends(modulus, fs_hz, end_s(band_hz)), fs_hz)


def power_density(samples: FloatArray, fs_hz: float, segment_s: float) -> tuple[FloatArray, FloatArray]:
    """Compute frequencies [Hz] and power density [1/Hz] of `samples` [n] by Welch's method, in segments of `segment_s`.

    Segments overlap by half, without their means and with Hann's window.
    """
    hz, power = scipy.signal.welch(samples, fs_hz, nperseg=min(round(segment_s * fs_hz), samples.size))
    return np.asarray(hz), np.asarray(power)


def kurtosis(samples: FloatArray | ComplexArray) -> float:
    """Mean fourth power of the modulus of `samples` [n] over the square of the mean second power; nan for zeros.

    The kurtosis is 3 for Gaussian noise, 2 for complex Gaussian noise, 3/2 for a sine, 1 for a complex tone.
    """
    power = np.square(samples.real) + np.square(samples.imag)
    mean = float(np.mean(power))
    return float(np.mean(power * power)) / mean**2 if mean else math.nan


def prewhitened(samples: FloatArray) -> FloatArray:
    """Scale all spectral lines of `samples` [n] to the same height and keep their phases; the result has variance one.

    Cepstrum prewhitening, ``X / |X|`` (Borghesani, Pennacchi, Randall, Sawalhi & Ricci 2013, Mech. Syst. Signal
    Process. 36, 370; authors and page quoted from memory, not checked), leaves next to no power to tones, gear meshes
    and impacts without jitter. The record is cut to a length with a fast transform. `DataError` for a constant record.
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


@dataclass(frozen=True, kw_only=True, eq=False)
class Kurtogram:
    """Excess kurtosis [k] of the complex envelope in each band, `band_hz` [k, 2], widest bands first.

    Excess kurtosis is zero for Gaussian noise of any spectrum, -1 for a steady tone, large for rare impulses.
    """

    band_hz: FloatArray
    kurtosis: FloatArray

    @property
    def best_hz(self) -> tuple[float, float]:
        """Most impulsive band [Hz]; `DataError` if the kurtogram of the record contains no band."""
        if self.kurtosis.size == 0:
            raise DataError(
                "the kurtogram has no band: each must contain harmonics of the fault lines, be wider if the record is "
                "shorter, and end below half the sampling rate. Use a longer record or a higher sampling rate."
            )
        low, high = self.band_hz[int(np.argmax(self.kurtosis))]
        return float(low), float(high)


def kurtogram(samples: FloatArray, fs_hz: float, *, least_width_hz: float, highest_hz: float = math.inf) -> Kurtogram:
    """Kurtogram of `samples` [n] on the tree of halves and thirds of the fast kurtogram.

    Bands as wide as the Nyquist frequency over 2, 3, 4, 6, 8, 12, ... lie side by side (Antoni 2007, Mech. Syst. Signal
    Process. 21, 108), cut sharply in the frequency domain. Bands are omitted if they begin at zero, are narrower than
    `least_width_hz` or above `highest_hz`, or have fewer than `LEAST_SAMPLES` independent samples.
    """
    nyquist, seconds = fs_hz / 2, samples.size / fs_hz
    length = scipy.fft.next_fast_len(samples.size, real=True)
    lines = scipy.fft.rfft(samples - samples.mean(), n=length)
    narrowest = max(least_width_hz, LEAST_SAMPLES / max(seconds - 2 * MIN_END_S, 1 / fs_hz))
    parts = [p for k in range(1, 16) for p in (2**k, 3 * 2 ** (k - 1)) if nyquist / p >= narrowest]
    edges = [(nyquist * n / part, nyquist * min((n + 1) / part, 0.99)) for part in parts for n in range(1, part)]
    bands = [(low, high) for low, high in edges if high - low >= narrowest and high <= highest_hz]
    excess, bin_hz = np.empty(len(bands)), fs_hz / length
    for n, (low, high) in enumerate(bands):
        inside = lines[math.ceil(low / bin_hz) : math.floor(high / bin_hz)]
        # Twice as many samples as are independent, so that the square is sampled without aliases.
        reduced = scipy.fft.next_fast_len(2 * inside.size)
        end, count = math.ceil(MIN_END_S * reduced * bin_hz), math.floor(seconds * reduced * bin_hz)
        excess[n] = kurtosis(scipy.fft.ifft(inside, n=reduced)[end : count - end]) - 2  # 2: of Gaussian noise
    return Kurtogram(band_hz=np.array(bands).reshape(-1, 2), kurtosis=np.nan_to_num(excess, nan=-1.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Scalogram:
    """Scalogram: `amplitude` [rows, columns] in the unit of the signal, with a row per frequency, a column per time.

    A sine of amplitude a gives a in its row. `time_s` [columns] are the columns' middles; values of a row that are
    within `edge_s` [rows] of an end of the record are affected by the end.
    """

    time_s: FloatArray
    frequency_hz: FloatArray
    amplitude: FloatArray
    edge_s: FloatArray


def morlet_scalogram(
    samples: FloatArray,
    fs_hz: float,
    *,
    range_hz: tuple[float, float],
    rows: int = SCALOGRAM_ROWS,
    columns: int = SCALOGRAM_COLUMNS,
) -> Scalogram:
    """Complex-Morlet scalogram of `samples` [n], with at most `rows` and `columns`; Giraudo et al. 2025, Figure 14.

    Frequencies f of the rows are chosen so that the samples of each wavelet lie symmetrically about its middle. The
    amplitudes from ``pywt.cwt`` are then too low by the factor sin(x)/x, x = pi f / fs; this is corrected. Raises
    `ConfigurationError` if the record is too short or too coarsely sampled for `range_hz`.
    """
    import pywt

    low, high = range_hz
    lowest, highest = 2 * math.sqrt(BANDWIDTH) / (samples.size / fs_hz), LARGEST_SHARE * fs_hz
    if not lowest <= low < high <= highest:
        raise ConfigurationError(
            f"scalogram from {low:g} to {high:g} Hz: a record of {samples.size / fs_hz:.3g} s at {fs_hz:g} Hz allows "
            f"{lowest:.3g} to {highest:g} Hz; narrow the range or use a longer record."
        )
    # A wavelet of an odd number of sampling intervals has its middle between two samples of its integral.
    intervals = 2 * np.rint(REACH * fs_hz / np.geomspace(low, high, rows) - 0.5) + 1
    scales = np.unique(intervals)[::-1] / (2 * REACH)
    wavelet = pywt.ContinuousWavelet(f"cmor{BANDWIDTH}-1.0")
    wavelet.lower_bound, wavelet.upper_bound = -REACH, REACH
    lines, _ = pywt.cwt(samples, scales, wavelet, method="fft", precision=18)  # 12 makes steps in the low rows
    amplitude = np.abs(lines) * (2 / (np.sqrt(scales) * np.sinc(1 / scales)))[:, None]
    first = np.arange(0, samples.size, math.ceil(samples.size / columns))
    count = np.diff(np.append(first, samples.size))
    return Scalogram(
        time_s=(first + (count - 1) / 2) / fs_hz,
        frequency_hz=fs_hz / scales,
        amplitude=np.add.reduceat(amplitude, first, axis=1) / count,
        edge_s=math.sqrt(BANDWIDTH) * scales / fs_hz,
    )
