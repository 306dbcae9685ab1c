"""Times of the signal chain against the usual library calls, measured in one interleaved run."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from srbval.signal import bandpass, envelope_spectrum_one_pass, morlet_scalogram

FS_HZ, SECONDS = 20_480.0, 30.0
BAND_HZ = (1400.0, 2800.0)
SCALOGRAM_HZ = (40.0, 1000.0)
ROWS = 100
ROUNDS = 3


@dataclass(frozen=True, kw_only=True)
class Timing:
    """Median wall times [s] of `what` and of `against`, one thread's work each, and their ratio."""

    what: str
    against: str
    seconds: float
    against_seconds: float
    ratio: float


def timings() -> tuple[Timing, ...]:
    """Record to envelope spectrum, and the scalogram image of a 30 s record."""
    samples = np.random.default_rng(0).standard_normal(round(FS_HZ * SECONDS))
    return (
        _timing("envelope spectrum, one pass", "sosfiltfilt, hilbert, abs, rfft", ROUNDS * 3,
                lambda: envelope_spectrum_one_pass(samples, FS_HZ, BAND_HZ), lambda: _usual(samples)),
        _timing("Morlet scalogram at figure resolution", "pywt.cwt, fft", 1,
                lambda: morlet_scalogram(samples, FS_HZ, range_hz=SCALOGRAM_HZ, rows=ROWS), lambda: _pywt(samples)),
    )  # fmt: skip


def _usual(samples: np.ndarray) -> object:
    import scipy.fft
    import scipy.signal

    return scipy.fft.rfft(np.abs(scipy.signal.hilbert(bandpass(samples, FS_HZ, BAND_HZ))))


def _pywt(samples: np.ndarray) -> object:
    import pywt

    scales = FS_HZ / np.geomspace(*SCALOGRAM_HZ, ROWS)
    for first in range(0, ROWS, 10):  # a 30 s record of all rows at once would take a gigabyte
        pywt.cwt(samples, scales[first : first + 10], "cmor1.5-1.0", 1 / FS_HZ, method="fft")
    return None


def _timing(
    what: str, against: str, rounds: int, ours: Callable[[], object], theirs: Callable[[], object]
) -> Timing:  # fmt: skip
    pairs = [(_wall(ours), _wall(theirs)) for _ in range(rounds)]
    own, other = (statistics.median(column) for column in zip(*pairs, strict=True))
    return Timing(what=what, against=against, seconds=own, against_seconds=other, ratio=own / other)


def _wall(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start
