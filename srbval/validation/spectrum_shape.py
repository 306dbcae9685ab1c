"""Whether two envelope spectra have the same shape: the angle between them, free of amplitude and of line frequency.

The power of the squared envelope is averaged in bins that are shares of the fault line's own frequency, from half of
it to half a line above the last harmonic used, and its logarithm centred: a gain falls out with the mean, a shift of
the line with the scale. The measure is the angle whose cosine is the correlation of two such spectra (spectral
correlation mapper: de Carvalho & Meneses 2000, after the spectral angle of Kruse et al. 1993, Remote Sens. Environ.
44, 145): 0 degrees alike, 90 degrees unrelated. A record is cut in halves, so that it can also be compared with itself:
no model can resemble a record more closely than the record's halves resemble each other.
"""

import math
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.signal import NORMAL_95
from srbval.validation.analyse import Analysis
from srbval.validation.speed_search import USABLE_SHARE

HARMONICS, LEAST_HARMONICS = 5, 2
# Bins from one harmonic to the next: sidebands at the shaft's or the cage's speed fall in bins of their own.
BINS = 24
_PADDING = 4


@dataclass(frozen=True, kw_only=True)
class Angle:
    """An angle between spectra and its 95 % half width [degrees]."""

    degrees: float
    ci95: float

    @property
    def related(self) -> bool:
        """Whether the spectra are more alike than unrelated ones."""
        return self.degrees + self.ci95 < 90


def halves_of(analysis: Analysis, fault: Fault) -> FloatArray | None:
    """The halves of a record about a fault's line, None where the line or the bins are out of reach."""
    found_hz = analysis.line_of(fault).found_hz
    return None if found_hz is None else halves(analysis, found_hz)


def halves(analysis: Analysis, line_hz: float) -> FloatArray | None:
    """Log power of both halves of a record's squared envelope in bins of `line_hz`, [2, harmonics x `BINS`].

    Fewer than five harmonics where the band ends sooner; None where it holds less than two, or where half the record
    does not resolve a bin.
    """
    processed = analysis.processed
    low, high = processed.band_hz
    count = min(HARMONICS, math.floor(USABLE_SHARE * (high - low) / line_hz - 0.5))
    length = processed.squared.size // 2
    if count < LEAST_HARMONICS or length / processed.squared_fs_hz * line_hz < BINS:
        return None
    parts = (processed.squared[:length], processed.squared[-length:])
    return np.array([_log_power(part, processed.squared_fs_hz, line_hz, count) for part in parts])


def _log_power(samples: FloatArray, fs_hz: float, line_hz: float, harmonics: int) -> FloatArray:
    size = _PADDING * samples.size
    power = np.abs(np.fft.rfft((samples - samples.mean()) * np.hanning(samples.size), n=size)) ** 2
    # A line stands in the middle of its bin.
    edges = np.round((0.5 + (np.arange(harmonics * BINS + 1) - 0.5) / BINS) * line_hz * size / fs_hz).astype(int)
    sums = np.add.reduceat(power[: edges[-1]], edges[:-1]) / np.diff(edges)
    return np.log(np.maximum(sums, np.finfo(float).tiny))


def angle_between(first: FloatArray, second: FloatArray) -> Angle:
    """Mean angle of every half of one record with every half of another, over the harmonics both have."""
    return _mean_angle([(a, b) for a in first for b in second])


def angle_within(own: FloatArray) -> Angle:
    """The angle of a record's halves with each other."""
    return _mean_angle([(own[0], own[1])])


def _mean_angle(pairs: list[tuple[FloatArray, FloatArray]]) -> Angle:
    """Correlations averaged as Fisher's z; its interval, 1.96 / sqrt(n - 3) for n bins, carried over to the angle."""
    size = min(x.size for pair in pairs for x in pair)
    z = np.mean([np.arctanh(min(float(np.corrcoef(a[:size], b[:size])[0, 1]), 1 - 1e-12)) for a, b in pairs])
    angle = math.acos(math.tanh(float(z)))
    return Angle(
        degrees=math.degrees(angle), ci95=math.degrees(NORMAL_95 * math.sin(angle) / math.sqrt(size - 3))
    )  # fmt: skip
