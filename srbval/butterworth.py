"""Gain of the Butterworth band-pass through which simulated and measured signals pass, in closed form.

Bilinear transform with corrected band edges (Oppenheim & Schafer, Discrete-Time Signal Processing, ch. 7).
"""

import math

import numpy as np

from srbval.arrays import FloatArray

FILTER_ORDER = 4  # of the prototype, not stated by Giraudo et al. 2025; a two-way pass doubles the slope


def butterworth_gain(frequency_hz: FloatArray, fs_hz: float, band_hz: tuple[float, float]) -> FloatArray:
    """Gain at `frequency_hz` [n] of the two-way digital Butterworth band-pass, 1/2 at both edges of `band_hz`."""
    warped = np.tan(np.pi * frequency_hz / fs_hz)
    low, high = warped_edges(band_hz, fs_hz)
    with np.errstate(divide="ignore"):
        prototype = (warped - low * high / warped) / (high - low)
    # To the power 2 FILTER_ORDER = 8 by squaring: numpy's own power takes as long as a transform.
    gain: FloatArray = 1 / (1 + np.square(np.square(np.square(prototype))))
    return gain


def warped_edges(band_hz: tuple[float, float], fs_hz: float) -> tuple[float, float]:
    """Edges of the band after the bilinear transform, tan(pi f / fs); they must be below half of `fs_hz`."""
    return math.tan(math.pi * band_hz[0] / fs_hz), math.tan(math.pi * band_hz[1] / fs_hz)
