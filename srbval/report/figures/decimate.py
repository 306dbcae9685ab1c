"""Fewer points for the same picture: extremes kept for lines, means for images."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray

IntArray = NDArray[np.intp]


def extreme_indices(values: FloatArray, bins: int) -> IntArray:
    """Indices of the least and greatest value of each of `bins` equal stretches, ascending.

    A line through them covers the same pixels as one through all samples. Fewer than 2 `bins` samples
    are all kept.
    """
    n = len(values)
    if n <= 2 * bins:
        return np.arange(n)
    edges = np.linspace(0, n, bins + 1).astype(int)
    kept = {0, n - 1}
    for start, stop in pairwise(edges):
        kept |= {start + int(values[start:stop].argmin()), start + int(values[start:stop].argmax())}
    return np.array(sorted(kept))


def block_means(values: FloatArray, columns: int) -> FloatArray:
    """Means over `columns` equal stretches of the last axis; values unchanged when there are no more."""
    n = values.shape[-1]
    if n <= columns:
        return values
    edges = np.linspace(0, n, columns + 1).astype(int)
    widths = np.diff(edges)
    return np.add.reduceat(values, edges[:-1], axis=-1) / widths
