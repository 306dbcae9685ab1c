"""Amplitudes and phases of a spectrum apart: phases alone, which impacts keep, or amplitudes alone, which noise keeps.

Cepstrum prewhitening brings what repeats exactly, such as gear meshes and tones, down to the noise; random phases make
noise of what there is.
"""

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
