"""From the recorded axes to one signal: rotation, normalisation, band-pass filter, ends that a filter spoils."""

import math

import numpy as np
import scipy.signal

from srbval.arrays import FloatArray
from srbval.errors import ConfigurationError, DataError

# Order of the Butterworth prototype; the two-way pass doubles the slope. The paper does not state its own.
ORDER = 4
# A two-way filter has to extrapolate the record beyond its ends. On noise the extrapolation spoils the envelope by
# tens of per cent over the first milliseconds. The error has decayed before this time, and before this many periods
# of the bandwidth: the slowest pole decays at pi x bandwidth x sin(pi / 8), to 1e-6 within 11.5 of them.
END_S, END_PERIODS = 0.05, 12.0
# A standard deviation this small relative to the signal's largest value is rounding, not vibration.
_CONSTANT = 1e-12


def rotate_axes(first: FloatArray, second: FloatArray, angle_rad: float) -> FloatArray:
    """Project two perpendicular radial axes, each [n], onto a sensor at `angle_rad` from the first.

    The angle counts from the first axis towards the second, so +45 degrees weights both with +1/sqrt(2)
    (Giraudo et al. 2025, Sensors 25, 2419, sect. 5).
    """
    if first.shape != second.shape:
        raise DataError(f"the two axes differ in length: {first.size} and {second.size} samples.")
    return math.cos(angle_rad) * first + math.sin(angle_rad) * second


def normalise(samples: FloatArray) -> FloatArray:
    """Subtract the mean and divide by the standard deviation; the result is dimensionless, [n].

    Raises `DataError` for a constant, empty or non-finite signal, which has no standard deviation to divide by.
    """
    if samples.size == 0 or not np.all(np.isfinite(samples)):
        raise DataError("the signal is empty or holds values that are not finite; check the recording.")
    centred = samples - samples.mean()
    spread = float(centred.std())
    if spread <= _CONSTANT * float(np.abs(samples).max()) or spread == 0.0:
        raise DataError("the signal is constant: there is no vibration to analyse; check channel and file.")
    return centred / spread


def check_band(band_hz: tuple[float, float], fs_hz: float) -> None:
    """Refuse a band that is empty, reaches zero or reaches the Nyquist frequency (`ConfigurationError`)."""
    low, high = band_hz
    if not (math.isfinite(low) and math.isfinite(high) and 0 < low < high):
        raise ConfigurationError(
            f"band {low:g} to {high:g} Hz: the lower edge must be above 0 and below the upper; give --band LO HI."
        )
    if high >= fs_hz / 2:
        raise ConfigurationError(
            f"band {low:g} to {high:g} Hz: the upper edge must lie below the Nyquist frequency of "
            f"{fs_hz / 2:g} Hz (sampling rate {fs_hz:g} Hz); lower it with --band LO HI."
        )


def bandpass(samples: FloatArray, fs_hz: float, band_hz: tuple[float, float]) -> FloatArray:
    """Butterworth band-pass without phase shift (forward and backward, second-order sections), [n].

    The gain is the squared Butterworth magnitude, 1/2 at both edges of `band_hz`. The ends are unreliable: see
    `drop_ends`. Raises `ConfigurationError` for an impossible band, `DataError` for a record that is too short.
    """
    check_band(band_hz, fs_hz)
    sections = scipy.signal.butter(ORDER, band_hz, btype="bandpass", fs=fs_hz, output="sos")
    padding = 3 * (2 * len(sections) + 1)
    if samples.size <= padding:
        raise DataError(f"{samples.size} samples are too few to filter; at least {padding + 1} are needed.")
    return scipy.signal.sosfiltfilt(sections, samples)


def end_s(band_hz: tuple[float, float]) -> float:
    """Time dropped at each end of a record that was filtered to `band_hz` [s]."""
    return max(END_S, END_PERIODS / (band_hz[1] - band_hz[0]))


def drop_ends(samples: FloatArray, fs_hz: float, seconds: float = END_S) -> FloatArray:
    """The record without `seconds` [s] at each end, [n - 2 fs seconds]; `DataError` if nothing is left."""
    end = math.ceil(seconds * fs_hz)
    if samples.size <= 2 * end:
        raise DataError(
            f"the record lasts {samples.size / fs_hz:.3g} s; {2 * seconds:g} s are lost to the filter's ends "
            "and nothing is left. Use a longer recording."
        )
    return samples[end : samples.size - end]
