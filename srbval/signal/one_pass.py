"""From a record to its envelope spectrum in one pass: only the band's own bins are ever transformed back."""

from __future__ import annotations

import math

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from srbval.errors import DataError
from srbval.signal.bandpass import END_S, ORDER, check_band
from srbval.signal.spectrum import Spectrum, amplitude_spectrum

FloatArray = NDArray[np.float64]

# Where the closed-form magnitude has fallen to this the rest is left out.
_LEAST_GAIN = 1e-5


def squared_envelope_one_pass(
    samples: FloatArray, fs_hz: float, band_hz: tuple[float, float], *, brick_wall: bool = False
) -> tuple[FloatArray, float]:
    """Squared envelope of `samples` [n] in `band_hz`, in their unit squared, and its own, lower sampling rate [Hz].

    One real transform; the band's bins, times the squared magnitude that the two-way Butterworth filter has (none for
    `brick_wall`, sharp at both edges); one transform back at a rate just above the width of what is left, so that the
    square is free of aliases. The record is taken as periodic: the ends, `END_S` each, are not dropped here. Equals
    `bandpass` and `squared_envelope` away from the ends. Raises `ConfigurationError` for an impossible band.
    """
    check_band(band_hz, fs_hz)
    length = scipy.fft.next_fast_len(samples.size, real=True)
    lines = scipy.fft.rfft(samples, n=length)
    low, high = _reach(band_hz, fs_hz, brick_wall)
    first, last = math.ceil(low * length / fs_hz), min(math.floor(high * length / fs_hz), lines.size - 1)
    kept = lines[first : last + 1]
    if not brick_wall:
        kept = kept * butterworth_gain(np.arange(first, last + 1) * (fs_hz / length), fs_hz, band_hz)
    reduced = scipy.fft.next_fast_len(2 * kept.size)
    analytic = scipy.fft.ifft(kept, n=reduced) * (2 * reduced / length)
    rate = fs_hz * reduced / length
    held = analytic[: math.floor(samples.size * reduced / length)]
    return held.real**2 + held.imag**2, rate


def envelope_spectrum_one_pass(
    samples: FloatArray, fs_hz: float, band_hz: tuple[float, float], *, brick_wall: bool = False, end_s: float = END_S
) -> Spectrum:
    """Amplitude spectrum of the squared envelope, ends of `end_s` dropped, in the unit of `samples` squared.

    Ends where the envelope's band does; nothing above it is lost. `DataError` for a record no longer than its ends.
    """
    square, rate = squared_envelope_one_pass(samples, fs_hz, band_hz, brick_wall=brick_wall)
    end = math.ceil(end_s * rate)
    if square.size <= 2 * end + 1:
        raise DataError(f"{samples.size / fs_hz:.3g} s are lost to the filter's ends; use a longer recording.")
    return amplitude_spectrum(square[end : square.size - end], rate)


def butterworth_gain(
    frequency_hz: FloatArray, fs_hz: float, band_hz: tuple[float, float], order: int = ORDER
) -> FloatArray:
    """Gain of the two-way digital Butterworth band-pass (bilinear transform), 1/2 at both edges, in closed form."""
    warped = np.tan(np.pi * frequency_hz / fs_hz)
    low, high = (math.tan(math.pi * edge / fs_hz) for edge in band_hz)
    with np.errstate(divide="ignore"):
        place = (warped**2 - low * high) / (warped * (high - low))
    gain: FloatArray = 1 / (1 + place ** (2 * order))
    return gain


def _reach(band_hz: tuple[float, float], fs_hz: float, brick_wall: bool) -> tuple[float, float]:
    """Where the gain has fallen to `_LEAST_GAIN` [Hz]."""
    if brick_wall:
        return band_hz
    far = (1 / _LEAST_GAIN - 1) ** (1 / (2 * ORDER))
    low, high = (math.tan(math.pi * edge / fs_hz) for edge in band_hz)
    half = far * (high - low) / 2
    root = math.sqrt(half**2 + low * high)
    return math.atan(root - half) * fs_hz / math.pi, math.atan(root + half) * fs_hz / math.pi
