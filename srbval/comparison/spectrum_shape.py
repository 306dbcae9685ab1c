"""Whether two envelope spectra have the same shape: the angle between them, free of amplitude and of line frequency.

The power of the squared envelope is averaged in bins that are shares of the fault line's own frequency, from half of
it to half a line above the last harmonic used, and its logarithm centred: a gain falls out with the mean, a shift of
the line with the scale. The measure is the angle whose cosine is the correlation of two such spectra (spectral
correlation mapper: de Carvalho & Meneses 2000, after the spectral angle of Kruse et al. 1993, Remote Sens. Environ.
44, 145): 0 degrees alike, 90 degrees unrelated. A record is cut in halves, so that it can also be compared with itself:
no model can resemble a record more closely than the record's halves resemble each other.

Even a right model does not resemble it as closely, since its inputs are not known: what angle it has to expect is that
of the model with itself at drawn inputs, read in the record's noise (`excess`, `with_noise`).
"""

import math

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.reading.analyse import Analysis
from srbval.reading.lines import Line
from srbval.reading.pipeline import USABLE_SHARE
from srbval.signal import NORMAL_95

HARMONICS, LEAST_HARMONICS = 5, 2
UNRELATED_DEG = 90.0
# Bins from one harmonic to the next: sidebands at the shaft's or the cage's speed fall in bins of their own.
BINS = 24
_PADDING = 4
# What neighbouring values of a periodogram with Hann's window, and those next to these, correlate by in power.
_HANN = (4 / 9, 1 / 36)
Angle = tuple[float, float]  # between spectra, with its 95 % half width [degrees]


def halves_of(analysis: Analysis, fault: Fault) -> FloatArray | None:
    """Log power of both halves of a record's squared envelope in bins of a fault's line, [2, harmonics x `BINS`].

    Fewer than five harmonics where the band ends sooner; None where it holds less than two, where half the record does
    not resolve a bin, or without a line.
    """
    processed, line_hz = analysis.processed, analysis.line_of(fault).found_hz
    if line_hz is None:
        return None
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
    return _with_interval(_between(first, second), min(first.shape[-1], second.shape[-1]))


def angle_within(own: FloatArray) -> Angle:
    """The angle of a record's halves with each other."""
    return _with_interval(_within(own), own.shape[-1])


def excess(model: FloatArray, records: FloatArray) -> FloatArray:
    """How much further from `model`, [2, bins], records are than their halves are from each other [degrees], [...].

    `records` are [..., 2, bins].
    """
    return np.asarray(_between(model, records) - _within(records))


def noise_about(line: Line) -> tuple[float, float] | None:
    """A record's noise about its line: power over noise in the line's bin, and independent values in a bin of a half.

    A half has half the power over noise at the line's peak, spread over all of the bin's values, which Hann's window
    correlates: the mean of n of them varies as that of fewer (Welch 1967, IEEE Trans. Audio Electroacoust. 15, 70).
    None without a line.
    """
    if not line.found_hz or not line.resolution_hz or not line.snr:
        return None
    cells = line.found_hz / line.resolution_hz / 2 / BINS
    alike = 1 + 2 * sum(c * max(1 - apart / cells, 0.0) for apart, c in enumerate(_HANN, start=1))
    return line.snr / 2 / cells, max(cells / alike, 1.0)


def with_noise(own: FloatArray, snr: float, cells: float, rng: np.random.Generator) -> FloatArray:
    """Log spectra [..., 2, bins] of a run as a record shows them whose first harmonic's bin is `snr` times the noise.

    The power of a signal in noise is noncentral chi-squared with two degrees of freedom for each independent value
    (Whalen 1971, Detection of Signals in Noise, sect. 4.4; quoted from memory, not checked); noise of even level.
    """
    first = own[..., BINS // 2].mean(axis=-1)[..., None, None]
    freedom = 2 * cells
    power = rng.noncentral_chisquare(freedom, freedom * snr * np.exp(own - first)) / freedom
    return np.log(np.maximum(power, np.finfo(float).tiny))


def _between(first: FloatArray, second: FloatArray) -> FloatArray:
    """Correlations of all halves, averaged as Fisher's z, as an angle [degrees], [...]."""
    size = min(first.shape[-1], second.shape[-1])
    a, b = (_centred(one[..., :size]) for one in (first, second))
    return _degrees(np.arctanh(a @ b.swapaxes(-1, -2)).mean(axis=(-1, -2)))


def _within(own: FloatArray) -> FloatArray:
    a = _centred(own)
    return _degrees(np.arctanh((a[..., 0, :] * a[..., 1, :]).sum(axis=-1)))


def _centred(own: FloatArray) -> FloatArray:
    """Less their means, and of a length so little below one that no correlation is one."""
    off = own - own.mean(axis=-1, keepdims=True)
    return np.asarray((1 - 1e-12) * off / np.linalg.norm(off, axis=-1, keepdims=True))


def _degrees(z: FloatArray) -> FloatArray:
    return np.asarray(np.degrees(np.arccos(np.tanh(z))))


def _with_interval(angle: FloatArray, bins: int) -> Angle:
    """The interval of a correlation's Fisher z, 1.96 / sqrt(n - 3) for n bins, carried over to the angle."""
    degrees = float(angle)
    spread = NORMAL_95 * math.sin(math.radians(degrees)) / math.sqrt(bins - 3)
    return degrees, math.degrees(spread)
