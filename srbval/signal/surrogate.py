"""A signal of the same spectrum and no other memory of the one it came from."""

import numpy as np
import scipy.fft

from srbval.arrays import FloatArray


def phase_randomised(samples: FloatArray, seed: int) -> FloatArray:
    """A signal, [n], with the amplitude of every line of `samples`, [n], and phases drawn by `seed`.

    The surrogate of Theiler, Eubank, Longtin, Galdrikian & Farmer (1992, Physica D 58, 77; quoted from memory, not
    checked). What many lines make is normal by the central limit theorem, whatever impacts there were; a tone stays
    one. Mean and power are kept.
    """
    lines = scipy.fft.rfft(samples)
    turns = np.exp(2j * np.pi * np.random.default_rng(seed).random(lines.size))
    turns[0] = 1.0
    if samples.size % 2 == 0:
        turns[-1] = 1.0  # as the mean, a line without a phase
    return np.asarray(scipy.fft.irfft(lines * turns, n=samples.size))
