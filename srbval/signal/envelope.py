"""Hilbert envelope of a band-passed signal."""

from __future__ import annotations

import numpy as np
import scipy.fft
import scipy.signal
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def squared_envelope(samples: FloatArray) -> FloatArray:
    """Squared modulus of the analytic signal, [n], in the unit of `samples` squared.

    Its spectrum ends at the width of the signal's band, so it aliases nothing; lines are read from it
    (Randall & Antoni 2011, Mech. Syst. Signal Process. 25, 485). Not for signals that were not band-passed.
    """
    length = scipy.fft.next_fast_len(samples.size)
    analytic = scipy.signal.hilbert(samples, N=length)[: samples.size]
    return analytic.real**2 + analytic.imag**2


def envelope(samples: FloatArray) -> FloatArray:
    """Modulus of the analytic signal, [n], in the unit of `samples`: the paper's envelope."""
    return np.sqrt(squared_envelope(samples))
