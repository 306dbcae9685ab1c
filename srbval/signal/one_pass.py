"""From a record to its envelope spectrum in one pass: only the band's own bins are ever transformed back."""

from __future__ import annotations

import enum
import math

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from srbval.errors import DataError
from srbval.signal.bandpass import ORDER, check_band, end_s
from srbval.signal.spectrum import Spectrum, amplitude_spectrum

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# Where the closed-form magnitude has fallen to this the rest is left out.
_LEAST_GAIN = 1e-5


class BandFilter(enum.StrEnum):
    """How a band is cut out; both without phase shift."""

    BUTTERWORTH = "butterworth"  # squared magnitude of the two-way filter, 1/2 at both edges
    BRICK_WALL = "brick-wall"  # 1 within, 0 without; rings as 1/t from either end of the record

    @property
    def in_words(self) -> str:
        """In words, for captions."""
        if self is BandFilter.BUTTERWORTH:
            return f"Butterworth of order {ORDER}, forward and backward (closed form)"
        return "brick wall"


def analytic_signal(
    samples: FloatArray,
    fs_hz: float,
    band_hz: tuple[float, float],
    *,
    band_filter: BandFilter = BandFilter.BUTTERWORTH,
) -> ComplexArray:
    """Band-passed `samples` [n] and, as imaginary part, their Hilbert transform, [n] at the full rate.

    The real part is `bandpass`, the modulus the envelope; a modulus is not band-limited, so it is not to be had at a
    lower rate. The record is taken as periodic: drop the ends (`end_s`). Filter and Hilbert transform are one kernel,
    which dies out with the filter; a Hilbert transform taken of an already filtered record sees the filter's ringing
    cut off at both ends, and its kernel carries that 1/t far inwards. Raises `ConfigurationError` for an impossible
    band.
    """
    kept, first, length = _band(samples, fs_hz, band_hz, band_filter)
    whole = np.zeros(length, dtype=np.complex128)
    whole[first : first + kept.size] = kept
    analytic: ComplexArray = scipy.fft.ifft(whole, overwrite_x=True)[: samples.size]
    return analytic


def squared_envelope_one_pass(
    samples: FloatArray,
    fs_hz: float,
    band_hz: tuple[float, float],
    *,
    band_filter: BandFilter = BandFilter.BUTTERWORTH,
) -> tuple[FloatArray, float]:
    """Squared envelope of `samples` [n] in `band_hz`, in their unit squared, and its own, lower sampling rate [Hz].

    One real transform; the band's bins times the filter's gain; one transform back at a rate just above twice the
    width of what is left, so that the square is free of aliases. As `analytic_signal` the ends are not dropped. Raises
    `ConfigurationError` for an impossible band.
    """
    kept, _, length = _band(samples, fs_hz, band_hz, band_filter)
    reduced = scipy.fft.next_fast_len(2 * kept.size)
    whole = np.zeros(reduced, dtype=np.complex128)
    np.multiply(kept, reduced / length, out=whole[: kept.size])
    held = scipy.fft.ifft(whole, overwrite_x=True)[: math.floor(samples.size * reduced / length)]
    return held.real**2 + held.imag**2, fs_hz * reduced / length


def envelope_spectrum_one_pass(
    samples: FloatArray,
    fs_hz: float,
    band_hz: tuple[float, float],
    *,
    band_filter: BandFilter = BandFilter.BUTTERWORTH,
) -> Spectrum:
    """Amplitude spectrum of the squared envelope, ends dropped, in the unit of `samples` squared.

    Ends where the envelope's band does; nothing above it is lost. `DataError` for a record no longer than its ends.
    """
    square, rate = squared_envelope_one_pass(samples, fs_hz, band_hz, band_filter=band_filter)
    end = math.ceil(end_s(band_hz) * rate)
    if square.size <= 2 * end + 1:
        raise DataError(f"{samples.size / fs_hz:.3g} s are lost to the filter's ends; use a longer recording.")
    return amplitude_spectrum(square[end : square.size - end], rate)


def butterworth_gain(frequency_hz: FloatArray, fs_hz: float, band_hz: tuple[float, float]) -> FloatArray:
    """Gain of the two-way digital Butterworth band-pass (bilinear transform), 1/2 at both edges, in closed form."""
    warped = np.tan(np.pi * frequency_hz / fs_hz)
    low, high = (math.tan(math.pi * edge / fs_hz) for edge in band_hz)
    with np.errstate(divide="ignore"):
        place = (warped - low * high / warped) / (high - low)
    gain: FloatArray = 1 / (1 + _raised(place * place, ORDER))
    return gain


def _raised(values: FloatArray, power: int) -> FloatArray:
    """`values` to a whole power, by squaring: numpy's own takes as long as a transform."""
    if power == 1:
        return values
    half = _raised(values * values, power // 2)
    return half * values if power % 2 else half


def _band(
    samples: FloatArray, fs_hz: float, band_hz: tuple[float, float], band_filter: BandFilter
) -> tuple[ComplexArray, int, int]:
    """The band's bins of the analytic signal, the number of the first, the padded length."""
    check_band(band_hz, fs_hz)
    length = scipy.fft.next_fast_len(samples.size, real=True)
    lines = scipy.fft.rfft(samples, n=length)
    low, high = _reach(band_hz, fs_hz, band_filter)
    first, last = math.ceil(low * length / fs_hz), min(math.floor(high * length / fs_hz), lines.size - 1)
    kept = 2 * lines[first : last + 1]
    if band_filter is BandFilter.BUTTERWORTH:
        kept *= butterworth_gain(np.arange(first, last + 1) * (fs_hz / length), fs_hz, band_hz)
    return kept, first, length


def _reach(band_hz: tuple[float, float], fs_hz: float, band_filter: BandFilter) -> tuple[float, float]:
    """Where the gain has fallen to `_LEAST_GAIN` [Hz]."""
    if band_filter is BandFilter.BRICK_WALL:
        return band_hz
    far = (1 / _LEAST_GAIN - 1) ** (1 / (2 * ORDER))
    low, high = (math.tan(math.pi * edge / fs_hz) for edge in band_hz)
    half = far * (high - low) / 2
    root = math.sqrt(half**2 + low * high)
    return math.atan(root - half) * fs_hz / math.pi, math.atan(root + half) * fs_hz / math.pi
