"""Kurtogram: how impulsive each band of a record is, over centre and width of the band."""

import math
from dataclasses import dataclass

import numpy as np
import scipy.fft

from srbval.arrays import ComplexArray, FloatArray
from srbval.errors import ConfigurationError
from srbval.signal.conditioning import END_S
from srbval.signal.spectrum import kurtosis

# The highest edge, as a share of the Nyquist frequency: a band must lie below it.
_TOP = 0.99
# Independent samples of an envelope below which its kurtosis means nothing.
LEAST_SAMPLES = 64


@dataclass(frozen=True, kw_only=True, eq=False)
class Kurtogram:
    """`kurtosis` [k] of the complex envelope in each band, `band_hz` [k, 2], widest bands first.

    Zero for Gaussian noise of any spectrum, -1 for a steady tone, large for rare impulses; `level` [k] is the
    base-2 logarithm of the Nyquist frequency over the band's width. `scatter` [k] is one standard deviation of what
    Gaussian noise would show: sqrt(8 / 3 / N) of N independent samples in a band cut sharply.
    """

    band_hz: FloatArray
    kurtosis: FloatArray
    level: FloatArray
    scatter: FloatArray

    @property
    def best_hz(self) -> tuple[float, float]:
        """The most impulsive band."""
        low, high = self.band_hz[int(np.argmax(self.kurtosis))]
        return float(low), float(high)

    @property
    def size(self) -> int:
        """Number of bands."""
        return int(self.kurtosis.size)


def kurtogram(samples: FloatArray, fs_hz: float, *, least_width_hz: float) -> Kurtogram:
    """Kurtogram of `samples` [n] on the tree of halves and thirds of the fast kurtogram.

    Bands of Nyquist / 2, 3, 4, 6, 8, 12, ... side by side, no narrower than `least_width_hz`, the lowest of each width
    left out (it begins at zero) (Antoni 2007, Mech. Syst. Signal Process. 21, 108). Bands are cut sharply in the
    frequency domain, not by a tree of short filters, and 50 ms are dropped at each end. Raises `ConfigurationError`
    where no band is that wide or the record is too short to estimate a kurtosis.
    """
    nyquist = fs_hz / 2
    parts = [p for k in range(1, 16) for p in (2**k, 3 * 2 ** (k - 1)) if nyquist / p >= least_width_hz]
    if not parts:
        raise ConfigurationError(
            f"kurtogram: no band of {least_width_hz:g} Hz fits twice below {nyquist:g} Hz; ask for narrower ones."
        )
    length = scipy.fft.next_fast_len(samples.size, real=True)
    lines = scipy.fft.rfft(samples - samples.mean(), n=length)
    bands, found, level = [], [], []
    for part in parts:
        width = nyquist / part
        for number in range(1, part):
            band = (number * width, min((number + 1) * width, _TOP * nyquist))
            bands.append(band)
            found.append(_excess(lines, fs_hz / length, band, samples.size / fs_hz))
            level.append(np.log2(nyquist / width))
    excess, independent = np.array(found).T
    return Kurtogram(
        band_hz=np.array(bands), kurtosis=np.nan_to_num(excess, nan=-1.0), level=np.array(level),
        scatter=np.sqrt(8 / 3 / independent),
    )  # fmt: skip


def _excess(lines: ComplexArray, bin_hz: float, band_hz: tuple[float, float], seconds: float) -> tuple[float, int]:
    """Kurtosis of the complex envelope of one band less 2, the Gaussian's, and its number of independent samples."""
    inside = lines[math.ceil(band_hz[0] / bin_hz) : math.floor(band_hz[1] / bin_hz)]
    # Twice as many samples as are independent, so that the square is sampled without aliases.
    reduced = scipy.fft.next_fast_len(2 * inside.size)
    rate = reduced * bin_hz
    end, count = math.ceil(END_S * rate), math.floor(seconds * rate)
    envelope = scipy.fft.ifft(inside, n=reduced)[end : count - end]
    if envelope.size < 2 * LEAST_SAMPLES:
        raise ConfigurationError(
            f"kurtogram: {seconds:.3g} s hold too few samples of a band of {band_hz[1] - band_hz[0]:.4g} Hz; use a "
            "longer record or wider bands."
        )
    return kurtosis(envelope) - 2, envelope.size // 2
