"""Does a scalogram draw what it should? Unit tones and unit impulses at every scale, at a picture's own resolution."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from srbval.signal.morlet import morlet_scalogram
from srbval.signal.scalogram import BANDWIDTH, COLUMNS, ROWS, Scalogram, column_width, scalogram

FloatArray = NDArray[np.float64]

# pywt's own settings: its default precision, its differencing not divided out.
PYWT_PRECISION = 10
# Places of the impulse, as shares of the record: none the middle of a column, all clear of the ends.
PLACES = (0.4137, 0.5003, 0.6271)
# Both errors must stay below this for a transform to draw the report's figure.
LARGEST_ERROR = 0.005
# Tones are tried at this many of the rows.
_TONES = 12


class Transform(Protocol):
    """A scalogram of `samples` [n]."""

    def __call__(
        self, samples: FloatArray, fs_hz: float, *, range_hz: tuple[float, float], rows: int, columns: int
    ) -> Scalogram:
        """The picture: `rows` from low to high within `range_hz` [Hz], at most `columns`."""
        ...


TRANSFORMS: dict[str, Transform] = {
    "closed-form Morlet": morlet_scalogram,
    "pywt.cwt, precision 18, differencing divided out": scalogram,
    "pywt.cwt as it comes": functools.partial(scalogram, precision=PYWT_PRECISION, corrected=False),
}


@dataclass(frozen=True, kw_only=True)
class ScalogramCheck:
    """Largest errors over all rows: a unit tone's reading less one; an impulse's picture, in shares of the row's top.

    `median_impulse_error` is the median over the rows of each row's largest.
    """

    transform: str
    tone_error: float
    impulse_error: float
    median_impulse_error: float

    @property
    def passed(self) -> bool:
        """Fit to draw the figure."""
        return max(self.tone_error, self.impulse_error) <= LARGEST_ERROR


def check_scalogram(
    name: str,
    *,
    samples: int,
    fs_hz: float,
    range_hz: tuple[float, float],
    rows: int = ROWS,
    columns: int = COLUMNS,
    places: tuple[float, ...] = PLACES,
) -> ScalogramCheck:
    """Check the transform called `name` in `TRANSFORMS` on records of `samples` at `fs_hz`.

    An impulse is held against the direct sum, which for one is the sampled wavelet itself, averaged over the samples
    of each column; a tone against one, away from the ends.
    """
    transform = TRANSFORMS[name]
    errors = np.concatenate([
        _impulse_errors(transform, round(place * samples), samples, fs_hz, range_hz, rows, columns)
        for place in places
    ])  # fmt: skip
    return ScalogramCheck(
        transform=name,
        tone_error=_tone_error(transform, samples, fs_hz, range_hz, columns),
        impulse_error=float(errors.max()),
        median_impulse_error=float(np.median(errors)),
    )


def _impulse_errors(
    transform: Transform, at: int, samples: int, fs_hz: float, range_hz: tuple[float, float], rows: int, columns: int
) -> FloatArray:
    impulse = np.zeros(samples)
    impulse[at] = 1.0
    picture = transform(impulse, fs_hz, range_hz=range_hz, rows=rows, columns=columns)
    width = column_width(samples, columns)
    whole = samples // width
    periods = (np.arange(samples) - at)[None, : whole * width] / fs_hz * picture.frequency_hz[:, None]
    height = 2 * picture.frequency_hz / fs_hz / np.sqrt(np.pi * BANDWIDTH)
    wavelet = height[:, None] * np.exp(-(periods**2) / BANDWIDTH)
    expected = wavelet.reshape(rows, whole, width).mean(axis=2)
    wrong: FloatArray = np.abs(picture.amplitude[:, :whole] - expected).max(axis=1) / expected.max(axis=1)
    return wrong


def _tone_error(transform: Transform, samples: int, fs_hz: float, range_hz: tuple[float, float], columns: int) -> float:
    worst = 0.0
    time_s = np.arange(samples) / fs_hz
    for tone_hz in np.geomspace(range_hz[0], range_hz[1] / 1.01, _TONES):
        tone = np.cos(2 * np.pi * tone_hz * time_s + 0.3)
        picture = transform(tone, fs_hz, range_hz=(tone_hz, 1.01 * tone_hz), rows=2, columns=columns)
        inside = slice(2 * picture.time_s.size // 5, 3 * picture.time_s.size // 5)
        worst = max(worst, float(np.abs(picture.amplitude[0, inside] - 1).max()))
    return worst
