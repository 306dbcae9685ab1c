"""A fixed piece of arithmetic, timed with every benchmark: makes times of different machines comparable."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from srbval.models.jit import kernel

FloatArray = NDArray[np.float64]

LENGTH = 512  # doubles: 4 kB, in every first-level cache
SWEEPS = 195_313  # about 1e8 multiply-adds
UNIT = 1e9  # multiply-adds that the calibration's time refers to
FACTOR, SUMMAND = 0.999, 0.5
REPEATS = 20


@kernel
def multiply_adds(x: FloatArray, factor: float, summand: float, sweeps: int) -> float:
    """Replace every element of `x` by ``factor * x + summand``, `sweeps` times; returns the sum."""
    for _ in range(sweeps):
        for i in range(x.shape[0]):
            x[i] = factor * x[i] + summand
    total = 0.0
    for i in range(x.shape[0]):
        total += x[i]
    return total


@dataclass(frozen=True, kw_only=True)
class SpeedCalibration:
    """Best and median time of 1e9 multiply-adds on one core [s], and whether their sum was correct."""

    seconds: float
    median_s: float
    gflop_s: float
    right: bool


def expected_sum(sweeps: int) -> float:
    """What `multiply_adds` returns from an array of `LENGTH` zeros: a geometric series."""
    return LENGTH * SUMMAND * -math.expm1(sweeps * math.log(FACTOR)) / (1 - FACTOR)


def calibrate(repeats: int = REPEATS) -> SpeedCalibration:
    """Time the kernel `repeats` times after a first call. It does not test memory or branches."""
    multiply_adds(np.zeros(LENGTH), FACTOR, SUMMAND, 1)
    times, right = [], True
    for _ in range(repeats):
        x = np.zeros(LENGTH)
        started = time.perf_counter()
        total = multiply_adds(x, FACTOR, SUMMAND, SWEEPS)
        times.append((time.perf_counter() - started) * UNIT / (SWEEPS * LENGTH))
        right = right and math.isclose(total, expected_sum(SWEEPS), rel_tol=1e-9)
    return SpeedCalibration(
        seconds=min(times), median_s=float(np.median(times)), gflop_s=2 * UNIT / min(times) / 1e9, right=right
    )
