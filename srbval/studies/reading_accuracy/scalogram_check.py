"""Accuracy of wavelet transforms: unit tones and unit impulses at every scale, as in the paper's Figure 14."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.signal import Scalogram, morlet_scalogram
from srbval.signal.spectrum import BANDWIDTH, COLUMNS, ROWS, SCALOGRAM_ERROR, SCALOGRAM_HZ, SCALOGRAM_TRANSFORM

# Positions of the impulse, as shares of the record: none the middle of a column, all clear of the ends.
PLACES = (0.4137, 0.5003, 0.6271)
# Figure 14 shows 0.2 s of a record at the rig's sampling rate (section 3.2), both ends included.
SAMPLES, FS_HZ = 4097, 20_480.0
# A scalogram of samples [n] at a sampling rate [Hz], with `range_hz`, `rows` and `columns` as `morlet_scalogram`.
Transform = Callable[..., Scalogram]
# Tones are tried at this many of the rows.
_TONES = 12


def plain_scalogram(
    samples: FloatArray, fs_hz: float, *, range_hz: tuple[float, float], rows: int = ROWS, columns: int = COLUMNS
) -> Scalogram:
    """What ``pywt.cwt`` draws by default: its own precision, rows wherever they are asked for, nothing divided out."""
    import pywt

    scales = fs_hz / np.geomspace(*range_hz, rows)[:, None]
    lines, _ = pywt.cwt(samples, scales.ravel(), f"cmor{BANDWIDTH}-1.0", method="fft")
    like = morlet_scalogram(samples, fs_hz, range_hz=range_hz, rows=rows, columns=columns)
    first = np.arange(0, samples.size, math.ceil(samples.size / columns))
    count = np.diff(np.append(first, samples.size))
    amplitude = np.add.reduceat(np.abs(lines) * (2 / np.sqrt(scales)), first, axis=1) / count
    return dataclasses.replace(like, frequency_hz=fs_hz / scales.ravel(), amplitude=amplitude)


TRANSFORMS: dict[str, Transform] = {SCALOGRAM_TRANSFORM: morlet_scalogram, "pywt.cwt as it comes": plain_scalogram}


def check_scalogram(name: str, *, rows: int = ROWS, places: tuple[float, ...] = PLACES) -> dict[str, Any]:
    """Check the transform called `name` in `TRANSFORMS` on records like those of Figure 14.

    An impulse is compared with the direct sum, which for one impulse is the sampled wavelet itself, averaged over the
    samples of each column; a tone with one, away from the ends. Largest over all rows: a unit tone's reading less one;
    an impulse's image, relative to the row's peak. `median_impulse_error` is the median over the rows of each row's
    largest; `passed`: accurate enough to draw the figure.
    """
    transform = TRANSFORMS[name]
    errors = np.concatenate([_impulse_errors(transform, round(place * SAMPLES), rows) for place in places])
    tone, impulse = _tone_error(transform), float(errors.max())
    return {
        "transform": name, "samples": SAMPLES, "fs_hz": FS_HZ, "low_hz": SCALOGRAM_HZ[0], "high_hz": SCALOGRAM_HZ[1],
        "tone_error": tone, "impulse_error": impulse, "median_impulse_error": float(np.median(errors)),
        "passed": max(tone, impulse) <= SCALOGRAM_ERROR,
    }  # fmt: skip


def _impulse_errors(transform: Transform, at: int, rows: int) -> FloatArray:
    """Largest error of each of the `rows` for a unit impulse at sample `at`, relative to the row's peak."""
    impulse = np.zeros(SAMPLES)
    impulse[at] = 1.0
    image = transform(impulse, FS_HZ, range_hz=SCALOGRAM_HZ, rows=rows, columns=COLUMNS)
    width = math.ceil(SAMPLES / COLUMNS)
    whole = SAMPLES // width
    periods = (np.arange(SAMPLES) - at)[None, : whole * width] / FS_HZ * image.frequency_hz[:, None]
    height = 2 * image.frequency_hz / FS_HZ / np.sqrt(np.pi * BANDWIDTH)
    wavelet = height[:, None] * np.exp(-(periods**2) / BANDWIDTH)
    expected = wavelet.reshape(len(wavelet), whole, width).mean(axis=2)
    errors: FloatArray = np.abs(image.amplitude[:, :whole] - expected).max(axis=1) / expected.max(axis=1)
    return errors


def _tone_error(transform: Transform) -> float:
    """Largest reading less one of unit tones at the rows' own frequencies, in the middle fifth of the record."""
    worst = 0.0
    time_s = np.arange(SAMPLES) / FS_HZ
    rows = transform(np.zeros(SAMPLES), FS_HZ, range_hz=SCALOGRAM_HZ, rows=_TONES).frequency_hz
    for row, tone_hz in enumerate(rows):
        image = transform(np.cos(2 * np.pi * tone_hz * time_s + 0.3), FS_HZ, range_hz=SCALOGRAM_HZ, rows=_TONES)
        inside = slice(2 * image.time_s.size // 5, 3 * image.time_s.size // 5)
        worst = max(worst, float(np.abs(image.amplitude[row, inside] - 1).max()))
    return worst
