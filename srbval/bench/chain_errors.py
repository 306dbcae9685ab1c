"""How far the one pass and the paper's chain are from the truth, and from each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from srbval.signal.bandpass import bandpass, end_s
from srbval.signal.envelope import squared_envelope
from srbval.signal.one_pass import butterworth_gain, squared_envelope_one_pass

FloatArray = NDArray[np.float64]

FS_HZ, SAMPLES = 20_480.0, 614_400
BANDS_HZ = ((1400.0, 2800.0), (500.0, 1500.0))  # of the rig's and of the simulated signals


@dataclass(frozen=True, kw_only=True)
class ChainError:
    """Largest errors of the squared envelope beyond the ends that are dropped, over its largest value there.

    The truth is the same band of a record three times as long, of which this is the middle. `one_pass` and
    `papers_chain` (sosfiltfilt, Hilbert transform, square) are against it; `papers_chain_faded` is the latter with the
    dropped ends brought smoothly to zero between filter and Hilbert transform; the last two are differences between the
    one pass and these.
    """

    low_hz: float
    high_hz: float
    samples: int
    one_pass: float
    papers_chain: float
    papers_chain_faded: float
    one_pass_less_chain: float
    one_pass_less_faded: float


def chain_errors(samples: int = SAMPLES, *, seed: int = 0) -> tuple[ChainError, ...]:
    """The errors on white noise in both bands."""
    whole = np.random.default_rng(seed).standard_normal(3 * samples)
    return tuple(_chain_error(whole, samples, band) for band in BANDS_HZ)


def _chain_error(whole: FloatArray, count: int, band_hz: tuple[float, float]) -> ChainError:
    gain = butterworth_gain(np.maximum(scipy.fft.rfftfreq(whole.size, 1 / FS_HZ), 1e-9), FS_HZ, band_hz)
    truth = squared_envelope(scipy.fft.irfft(scipy.fft.rfft(whole) * gain, n=whole.size))[count : 2 * count]
    record = whole[count : 2 * count]
    end = round(end_s(band_hz) * FS_HZ)
    square, _ = squared_envelope_one_pass(record, FS_HZ, band_hz)
    ours = scipy.fft.irfft(scipy.fft.rfft(square) * (count / square.size), n=count)
    filtered = bandpass(record, FS_HZ, band_hz)
    chain, faded = squared_envelope(filtered), squared_envelope(filtered, fade=end)

    def largest(found: FloatArray, expected: FloatArray) -> float:
        return float(np.abs(found - expected)[end:-end].max() / truth[end:-end].max())

    return ChainError(
        low_hz=band_hz[0],
        high_hz=band_hz[1],
        samples=count,
        one_pass=largest(ours, truth),
        papers_chain=largest(chain, truth),
        papers_chain_faded=largest(faded, truth),
        one_pass_less_chain=largest(ours, chain),
        one_pass_less_faded=largest(ours, faded),
    )
