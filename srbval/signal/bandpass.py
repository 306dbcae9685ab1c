"""Zero-phase band-pass filter, and the samples that it spoils at both ends of a record."""

import math

import scipy.signal

from srbval.arrays import FloatArray
from srbval.errors import ConfigurationError, DataError

# Order of the Butterworth prototype; the two-way pass doubles the slope. The paper does not state its own.
ORDER = 4

# A two-way filter has to extrapolate the record beyond its ends. On noise the extrapolation spoils the envelope by
# tens of per cent over the first milliseconds. The error has decayed before this time, and before this many periods
# of the bandwidth: the slowest pole decays at pi x bandwidth x sin(pi / 8), to 1e-6 within 11.5 of them.
END_S, END_PERIODS = 0.05, 12.0


def end_s(band_hz: tuple[float, float]) -> float:
    """Time dropped at each end of a record that was filtered to `band_hz` [s]."""
    return max(END_S, END_PERIODS / (band_hz[1] - band_hz[0]))


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


def bandpass(samples: FloatArray, fs_hz: float, band_hz: tuple[float, float], *, order: int = ORDER) -> FloatArray:
    """Butterworth band-pass without phase shift (forward and backward, second-order sections), [n].

    The gain is the squared Butterworth magnitude, 1/2 at both edges of `band_hz`. The ends are unreliable: see
    `drop_ends`. Raises `ConfigurationError` for an impossible band, `DataError` for a record that is too short.
    """
    check_band(band_hz, fs_hz)
    sections = scipy.signal.butter(order, band_hz, btype="bandpass", fs=fs_hz, output="sos")
    padding = 3 * (2 * len(sections) + 1)
    if samples.size <= padding:
        raise DataError(f"{samples.size} samples are too few to filter; at least {padding + 1} are needed.")
    return scipy.signal.sosfiltfilt(sections, samples)


def drop_ends(samples: FloatArray, fs_hz: float, seconds: float = END_S) -> FloatArray:
    """The record without `seconds` [s] at each end, [n - 2 fs seconds]; `DataError` if nothing is left."""
    end = math.ceil(seconds * fs_hz)
    if samples.size <= 2 * end:
        raise DataError(
            f"the record lasts {samples.size / fs_hz:.3g} s; {2 * seconds:g} s are lost to the filter's ends "
            "and nothing is left. Use a longer recording."
        )
    return samples[end : samples.size - end]
