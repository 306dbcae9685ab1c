"""From the recorded axes to one signal of zero mean and unit standard deviation."""

import math

import numpy as np

from srbval.arrays import FloatArray
from srbval.errors import DataError

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
