"""Accuracy of wavelet transforms: unit tones and unit impulses at every scale, as in the paper's Figure 14."""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from srbval.arrays import FloatArray
from srbval.report.findings.shown_records import SCALOGRAM_ERROR, SCALOGRAM_HZ, SCALOGRAM_TRANSFORM
from srbval.signal import Scalogram, check_range, column_width, morlet_scalogram
from srbval.signal.scalogram import BANDWIDTH, COLUMNS, ROWS

# pywt samples the integrated wavelet at 2^precision points and picks the nearest. At its default of 10 the
# low rows of an impulsive signal are wrong by more than their own size.
PRECISION, PYWT_PRECISION = 18, 10
# Positions of the impulse, as shares of the record: none the middle of a column, all clear of the ends.
PLACES = (0.4137, 0.5003, 0.6271)
# Figure 14 shows 0.2 s of a record at the rig's sampling rate (section 3.2), both ends included.
SAMPLES, FS_HZ = 4097, 20_480.0
# A scalogram of samples [n] at a sampling rate [Hz], with `range_hz`, `rows` and `columns` as `morlet_scalogram`.
Transform = Callable[..., Scalogram]
# Tones are tried at this many of the rows.
_TONES = 12
_ROWS_PER_CALL = 8


def pywt_scalogram(
    samples: FloatArray,
    fs_hz: float,
    *,
    range_hz: tuple[float, float],
    rows: int = ROWS,
    columns: int = COLUMNS,
    precision: int = PRECISION,
    corrected: bool = True,
) -> Scalogram:
    """Complex-Morlet scalogram of `samples` [n] with PyWavelets (``pywt.cwt``), as the paper's Figure 14.

    pywt differences an integrated wavelet, which lowers each row by sin(x)/x, x = pi f / fs; `corrected` divides that
    out, and tones then read right to parts in a million. A single impulse is drawn within about two per cent of its
    row's peak below 0.15 of the sampling rate, six above. With pywt's own `precision` of 10, and not `corrected`, it is
    what pywt draws by default. Raises `ConfigurationError` where `range_hz` leaves what the record allows.
    """
    check_range(range_hz, fs_hz, samples.size / fs_hz)
    frequency = np.geomspace(*range_hz, rows)
    width = column_width(samples.size, columns)
    bounds = np.minimum(np.arange(0, samples.size + width, width), samples.size)
    parts = [
        np.add.reduceat(
            _modulus(samples, fs_hz, frequency[first : first + _ROWS_PER_CALL], precision, corrected),
            bounds[:-1],
            axis=1,
        )
        / np.diff(bounds)
        for first in range(0, rows, _ROWS_PER_CALL)
    ]
    return Scalogram(
        time_s=(bounds[:-1] + bounds[1:] - 1) / 2 / fs_hz,
        frequency_hz=frequency,
        amplitude=np.concatenate(parts),
        edge_s=math.sqrt(BANDWIDTH) / frequency,
    )


def _modulus(
    samples: FloatArray, fs_hz: float, frequency_hz: FloatArray, precision: int, corrected: bool
) -> FloatArray:
    import pywt

    scales = fs_hz / frequency_hz
    wavelet = pywt.ContinuousWavelet(f"cmor{BANDWIDTH}-1.0")
    rows, _ = pywt.cwt(samples, scales, wavelet, 1 / fs_hz, method="fft", precision=precision)
    gain = np.sqrt(scales) / 2 * (np.sinc(frequency_hz / fs_hz) if corrected else 1.0)
    return np.abs(rows) / gain[:, None]


TRANSFORMS: dict[str, Transform] = {
    SCALOGRAM_TRANSFORM: morlet_scalogram,
    "pywt.cwt, precision 18, differencing divided out": pywt_scalogram,
    "pywt.cwt as it comes": functools.partial(pywt_scalogram, precision=PYWT_PRECISION, corrected=False),
}


@dataclass(frozen=True, kw_only=True)
class ScalogramCheck:
    """Errors of a transform on records of `samples` at `fs_hz`, its rows from `low_hz` to `high_hz`.

    Largest over all rows: a unit tone's reading less one; an impulse's image, relative to the row's peak.
    `median_impulse_error` is the median over the rows of each row's largest.
    """

    JSON_PROPERTIES: ClassVar = ("passed",)

    transform: str
    samples: int
    fs_hz: float
    low_hz: float
    high_hz: float
    tone_error: float
    impulse_error: float
    median_impulse_error: float

    @property
    def passed(self) -> bool:
        """Whether the transform is accurate enough to draw the figure."""
        return max(self.tone_error, self.impulse_error) <= SCALOGRAM_ERROR


def check_scalogram(name: str, *, rows: int = ROWS, places: tuple[float, ...] = PLACES) -> ScalogramCheck:
    """Check the transform called `name` in `TRANSFORMS` on records like those of Figure 14.

    An impulse is compared with the direct sum, which for one impulse is the sampled wavelet itself, averaged over the
    samples of each column; a tone with one, away from the ends.
    """
    transform = TRANSFORMS[name]
    errors = np.concatenate([_impulse_errors(transform, round(place * SAMPLES), rows) for place in places])
    return ScalogramCheck(
        transform=name,
        samples=SAMPLES,
        fs_hz=FS_HZ,
        low_hz=SCALOGRAM_HZ[0],
        high_hz=SCALOGRAM_HZ[1],
        tone_error=_tone_error(transform),
        impulse_error=float(errors.max()),
        median_impulse_error=float(np.median(errors)),
    )


def _impulse_errors(transform: Transform, at: int, rows: int) -> FloatArray:
    """Largest error of each of the `rows` for a unit impulse at sample `at`, relative to the row's peak."""
    impulse = np.zeros(SAMPLES)
    impulse[at] = 1.0
    image = transform(impulse, FS_HZ, range_hz=SCALOGRAM_HZ, rows=rows, columns=COLUMNS)
    width = column_width(SAMPLES, COLUMNS)
    whole = SAMPLES // width
    periods = (np.arange(SAMPLES) - at)[None, : whole * width] / FS_HZ * image.frequency_hz[:, None]
    height = 2 * image.frequency_hz / FS_HZ / np.sqrt(np.pi * BANDWIDTH)
    wavelet = height[:, None] * np.exp(-(periods**2) / BANDWIDTH)
    expected = wavelet.reshape(rows, whole, width).mean(axis=2)
    errors: FloatArray = np.abs(image.amplitude[:, :whole] - expected).max(axis=1) / expected.max(axis=1)
    return errors


def _tone_error(transform: Transform) -> float:
    worst = 0.0
    time_s = np.arange(SAMPLES) / FS_HZ
    for tone_hz in np.geomspace(SCALOGRAM_HZ[0], SCALOGRAM_HZ[1] / 1.01, _TONES):
        tone = np.cos(2 * np.pi * tone_hz * time_s + 0.3)
        image = transform(tone, FS_HZ, range_hz=(tone_hz, 1.01 * tone_hz), rows=2, columns=COLUMNS)
        inside = slice(2 * image.time_s.size // 5, 3 * image.time_s.size // 5)
        worst = max(worst, float(np.abs(image.amplitude[0, inside] - 1).max()))
    return worst
