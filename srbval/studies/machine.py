"""The machine that a benchmark ran on, and a fixed piece of arithmetic timed on it: makes times comparable."""

import math
import os
import platform
import time
from collections.abc import Callable
from importlib import metadata
from typing import Any

import numpy as np

from srbval import __version__
from srbval.arrays import FloatArray
from srbval.models.jit import kernel
from srbval.processes.machine import load_average, processor_name, usable_cores

LENGTH = 512  # doubles: 4 kB, in every first-level cache
SWEEPS = 195_313  # about 1e8 multiply-adds
UNIT = 1e9  # multiply-adds that the calibration's time refers to
FACTOR, SUMMAND = 0.999, 0.5
REPEATS = 20
PACKAGES = ("numpy", "scipy", "numba", "llvmlite")


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


def expected_sum(sweeps: int) -> float:
    """What `multiply_adds` returns from an array of `LENGTH` zeros: a geometric series."""
    return LENGTH * SUMMAND * -math.expm1(sweeps * math.log(FACTOR)) / (1 - FACTOR)


def calibrate(repeats: int = REPEATS) -> dict[str, Any]:
    """Best and median time of 1e9 multiply-adds on one core [s], and whether their sums were `right`.

    The kernel is timed `repeats` times after a first call. It does not test memory or branches.
    """
    multiply_adds(np.zeros(LENGTH), FACTOR, SUMMAND, 1)
    times, right = [], True
    for _ in range(repeats):
        x = np.zeros(LENGTH)
        started = time.perf_counter()
        total = multiply_adds(x, FACTOR, SUMMAND, SWEEPS)
        times.append((time.perf_counter() - started) * UNIT / (SWEEPS * LENGTH))
        right = right and math.isclose(total, expected_sum(SWEEPS), rel_tol=1e-9)
    best = min(times)
    return {"seconds": best, "median_s": float(np.median(times)), "gflop_s": 2 * UNIT / best / 1e9, "right": right}


def machine_before() -> Callable[[], dict[str, Any]]:
    """Calibrate the machine; what is returned calibrates it once more after the work and describes it.

    Loads of the last minute are None where the system does not tell.
    """
    load, before = load_average(), calibrate()

    def described() -> dict[str, Any]:
        after_s = calibrate()["seconds"]
        versions = {"srbval": __version__, "python": platform.python_version()}
        return {
            "processor": processor_name(), "architecture": platform.machine(), "system": platform.platform(terse=True),
            "cores": os.cpu_count() or 1, "usable_cores": usable_cores(),
            "versions": versions | {name: metadata.version(name) for name in PACKAGES},
            "load_before": load, "load_after": load_average(), "calibration": before, "calibration_after_s": after_s,
        }  # fmt: skip

    return described
