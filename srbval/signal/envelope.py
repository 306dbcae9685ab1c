"""Envelope of a vibration signal: mix of two sensor axes, scaling, band-pass, Hilbert transform, cut of the ends."""

import math

import numpy as np
import scipy.fft

from srbval.arrays import ComplexArray, FloatArray
from srbval.butterworth import FILTER_ORDER, butterworth_gain, warped_edges
from srbval.errors import ConfigurationError, DataError

# The record's ends spoil the envelope for this time and this many periods of the bandwidth: the slowest pole decays
# at pi x bandwidth x sin(pi / 8), to 1e-6 within 11.5 of them.
MIN_END_S, END_PERIODS = 0.05, 12.0
_CONSTANT = 1e-12  # a standard deviation below this share of the signal's largest value is rounding, not vibration
_LEAST_GAIN = 1e-5  # below this value the closed-form gain is set to zero
FILTER, FILTER_IN_WORDS = "butterworth", f"Butterworth of order {FILTER_ORDER}, forward and backward (closed form)"


def rotate_axes(first: FloatArray, second: FloatArray, angle_rad: float) -> FloatArray:
    """Combine signals [n] of two perpendicular radial axes to the signal at `angle_rad` from the first axis."""
    if first.shape != second.shape:
        raise DataError(f"signals of two sensor axes must be equally long, not {first.size} and {second.size} samples.")
    return math.cos(angle_rad) * first + math.sin(angle_rad) * second


def normalise(samples: FloatArray) -> FloatArray:
    """Subtract the mean and divide by the standard deviation, [n]; `DataError` if constant, empty or not finite."""
    if samples.size == 0 or not np.all(np.isfinite(samples)):
        raise DataError("the signal is empty or contains values that are not finite; check the recording.")
    centred = samples - samples.mean()
    spread = float(centred.std())
    if spread <= _CONSTANT * float(np.abs(samples).max()) or spread == 0.0:
        raise DataError("the signal is constant: there is no vibration to analyse; check channel and file.")
    return centred / spread


def check_band(band_hz: tuple[float, float], fs_hz: float) -> None:
    """Raise `ConfigurationError` for a band that is empty or reaches zero or the Nyquist frequency."""
    low, high = band_hz
    if not (math.isfinite(low) and math.isfinite(high) and 0 < low < high):
        raise ConfigurationError(
            f"band {low:g} to {high:g} Hz: the lower edge must be above 0 and below the upper; give --band LO HI."
        )
    if high >= fs_hz / 2:
        raise ConfigurationError(
            f"band {low:g} to {high:g} Hz: the upper edge must be below the Nyquist frequency of "
            f"{fs_hz / 2:g} Hz (sampling rate {fs_hz:g} Hz); lower it with --band LO HI."
        )


def end_s(band_hz: tuple[float, float]) -> float:
    """Time [s] to drop at each end of a record filtered to the band `band_hz`, because the filter distorts the ends."""
    return max(MIN_END_S, END_PERIODS / (band_hz[1] - band_hz[0]))


def drop_ends(samples: FloatArray, fs_hz: float, seconds: float) -> FloatArray:
    """Remove `seconds` [s] at each end of the record, [n - 2 fs seconds]; `DataError` if nothing is left."""
    end = math.ceil(seconds * fs_hz)
    if samples.size <= 2 * end:
        raise DataError(
            f"the record lasts {samples.size / fs_hz:.3g} s; the filter distorts {2 * seconds:g} s at its ends, so "
            "that nothing is left. Use a longer recording."
        )
    return samples[end : samples.size - end]


def analytic_signal(samples: FloatArray, fs_hz: float, band_hz: tuple[float, float]) -> ComplexArray:
    """Band-passed `samples` [n] with their Hilbert transform as imaginary part, [n]; the modulus is the envelope.

    The record is treated as periodic, so its ends are wrong: drop them (`end_s`). `ConfigurationError` for a bad band.
    """
    lines, first, length = _band_lines(samples, fs_hz, band_hz)
    whole = np.zeros(length, dtype=np.complex128)
    whole[first : first + lines.size] = lines
    analytic: ComplexArray = scipy.fft.ifft(whole, overwrite_x=True)[: samples.size]
    return analytic


def squared_envelope_one_pass(
    samples: FloatArray, fs_hz: float, band_hz: tuple[float, float]
) -> tuple[FloatArray, float]:
    """Squared envelope of `samples` [n] in `band_hz`, in their unit squared, and its lower sampling rate [Hz].

    Only the bins of the band are transformed back, at a rate just above twice their width. The ends are not dropped.
    """
    lines, _, length = _band_lines(samples, fs_hz, band_hz)
    reduced = scipy.fft.next_fast_len(2 * lines.size)
    whole = np.zeros(reduced, dtype=np.complex128)
    np.multiply(lines, reduced / length, out=whole[: lines.size])
    analytic = scipy.fft.ifft(whole, overwrite_x=True)[: math.floor(samples.size * reduced / length)]
    return analytic.real**2 + analytic.imag**2, fs_hz * reduced / length


def _band_lines(samples: FloatArray, fs_hz: float, band_hz: tuple[float, float]) -> tuple[ComplexArray, int, int]:
    """Band-passed spectrum of the analytic signal, its first bin (gain above `_LEAST_GAIN`), and the padded length."""
    check_band(band_hz, fs_hz)
    length = scipy.fft.next_fast_len(samples.size, real=True)
    lines = scipy.fft.rfft(samples, n=length)
    first_edge, last_edge = warped_edges(band_hz, fs_hz)
    half = (1 / _LEAST_GAIN - 1) ** (1 / (2 * FILTER_ORDER)) * (last_edge - first_edge) / 2
    root = math.sqrt(half**2 + first_edge * last_edge)
    low, high = (math.atan(root + side * half) * fs_hz / math.pi for side in (-1, 1))
    first, last = math.ceil(low * length / fs_hz), min(math.floor(high * length / fs_hz), lines.size - 1)
    inside = 2 * lines[first : last + 1]
    inside *= butterworth_gain(np.arange(first, last + 1) * (fs_hz / length), fs_hz, band_hz)
    return inside, first, length
