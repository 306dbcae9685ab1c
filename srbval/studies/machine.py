"""The machine that a benchmark ran on, and a fixed piece of arithmetic timed on it: makes times comparable."""

import math
import os
import platform
import sys
import time
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from srbval import __version__
from srbval.arrays import FloatArray
from srbval.models.jit import kernel
from srbval.processes.machine import usable_cores

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


def this_machine() -> dict[str, Any]:
    """Processor and usable cores, as stored results name them."""
    return {"processor": processor_name(), "usable_cores": usable_cores()}


def load_average() -> float | None:
    """Processes that wanted a core, mean of the last minute."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def processor_name(listing: Path = Path("/proc/cpuinfo")) -> str:
    """The processor's name as the system gives it; its architecture where it gives none."""
    if listing.is_file():
        for line in listing.read_text(encoding="utf-8", errors="replace").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name" and value.strip():
                return value.strip()
    return platform.processor() or platform.machine()


def peak_bytes() -> int | None:
    """Peak resident memory of this process so far; None where the system does not tell.

    On Linux the high-water mark of its own memory: `ru_maxrss` of a new process begins with its parent's.
    """
    status = Path("/proc/self/status")
    if status.is_file():
        marks = [line.split() for line in status.read_text(encoding="utf-8").splitlines() if line.startswith("VmHWM:")]
        if marks:
            return int(marks[0][1]) * 1024
    try:
        import resource
    except ImportError:  # Windows has no such count
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024
