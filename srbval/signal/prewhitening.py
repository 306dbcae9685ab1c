"""Cepstrum prewhitening: what repeats exactly, such as gear meshes and tones, is brought down to the noise."""

import numpy as np
import scipy.fft

from srbval.arrays import FloatArray
from srbval.errors import DataError


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
