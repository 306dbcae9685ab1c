"""The one-pass signal chain against the paper's chain and the usual library calls: errors and wall times."""

import statistics
import timeit
from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
import scipy.fft

from srbval.arrays import FloatArray
from srbval.signal import (
    amplitude_spectrum,
    analytic_signal,
    bandpass,
    butterworth_gain,
    drop_ends,
    end_s,
    squared_envelope,
    squared_envelope_one_pass,
)

FS_HZ, SAMPLES = 20_480.0, 614_400
BANDS_HZ = ((1400.0, 2800.0), (500.0, 1500.0))  # of the rig's and of the simulated signals
RECORDS = 5  # the error of a truncated filtered record depends on the few samples at its ends: the worst of so many
AGREEMENT = 1e-4  # of the largest value
FAULT_HZ, FAULT_DEPTH = 97.0, 0.3
ROUNDS = 3


@dataclass(frozen=True, kw_only=True)
class ChainError:
    """Errors beyond the ends that are dropped, the worst of `records` records of white noise.

    Of the squared envelope, the largest error over its largest value: the true one is that of the same band of a record
    three times as long, of which this is the middle. `one_pass` and `papers_chain` (sosfiltfilt, Hilbert transform,
    square) are errors against it; `papers_chain_faded` is the latter with the dropped ends faded to zero between filter
    and Hilbert transform; `one_pass_less_chain` and `one_pass_less_faded` are differences of the one pass from these.

    Of what is computed from it, the one pass less the unchanged chain: `envelope_less_chain`, the largest difference of
    the modulus over its largest value; `envelope_rms_less_chain`, its root mean square over the modulus's own;
    `agree_beyond_s`, how far from either end the former is last above `AGREEMENT` [s] (the chain's error dies out as
    1/t only); `lines_less_chain`, the largest difference of a line of the squared envelope's amplitude spectrum, 0 Hz
    left out, over the largest line (of noise: the hardest case); `fault_line_less_chain`, the relative difference of
    the line that the noise gets when modulated at `FAULT_HZ` to the depth `FAULT_DEPTH`, as a fault line is.
    """

    low_hz: float
    high_hz: float
    samples: int
    records: int
    one_pass: float
    papers_chain: float
    papers_chain_faded: float
    one_pass_less_chain: float
    one_pass_less_faded: float
    envelope_less_chain: float
    envelope_rms_less_chain: float
    agree_beyond_s: float
    lines_less_chain: float
    fault_line_less_chain: float


def chain_errors(samples: int = SAMPLES, *, seed: int = 0, records: int = RECORDS) -> tuple[ChainError, ...]:
    """The errors on white noise in both bands."""
    rng = np.random.default_rng(seed)
    noise = [rng.standard_normal(3 * samples) for _ in range(records)]
    return tuple(_worst([_chain_error(whole, samples, band) for whole in noise]) for band in BANDS_HZ)


def _worst(errors: list[ChainError]) -> ChainError:
    worst = {field.name: max(getattr(error, field.name) for error in errors) for field in fields(ChainError)}
    return ChainError(**worst | {"records": len(errors)})


def _chain_error(whole: FloatArray, count: int, band_hz: tuple[float, float]) -> ChainError:
    gain = butterworth_gain(np.maximum(scipy.fft.rfftfreq(whole.size, 1 / FS_HZ), 1e-9), FS_HZ, band_hz)
    truth = squared_envelope(scipy.fft.irfft(scipy.fft.rfft(whole) * gain, n=whole.size))[count : 2 * count]
    record = whole[count : 2 * count]
    end = round(end_s(band_hz) * FS_HZ)
    ours = _one_pass(record, band_hz)
    filtered = bandpass(record, FS_HZ, band_hz)
    chain, faded = squared_envelope(filtered), squared_envelope(filtered, fade=end)
    envelope = np.sqrt(chain)
    difference = np.abs(np.abs(analytic_signal(record, FS_HZ, band_hz)) - envelope)

    def largest(found: FloatArray, expected: FloatArray) -> float:
        return float(np.abs(found - expected)[end:-end].max() / truth[end:-end].max())

    return ChainError(
        low_hz=band_hz[0],
        high_hz=band_hz[1],
        samples=count,
        records=1,
        one_pass=largest(ours, truth),
        papers_chain=largest(chain, truth),
        papers_chain_faded=largest(faded, truth),
        one_pass_less_chain=largest(ours, chain),
        one_pass_less_faded=largest(ours, faded),
        envelope_less_chain=float(difference[end:-end].max() / envelope[end:-end].max()),
        envelope_rms_less_chain=float(np.linalg.norm(difference[end:-end]) / np.linalg.norm(envelope[end:-end])),
        agree_beyond_s=_last_above(difference, AGREEMENT * envelope[end:-end].max()) / FS_HZ,
        lines_less_chain=_line_difference(ours[end:-end], chain[end:-end]),
        fault_line_less_chain=_fault_line_difference(record, band_hz, end),
    )


def _one_pass(record: FloatArray, band_hz: tuple[float, float]) -> FloatArray:
    """The one pass's squared envelope, interpolated to the full sampling rate, [n]."""
    square, _ = squared_envelope_one_pass(record, FS_HZ, band_hz)
    whole: FloatArray = scipy.fft.irfft(scipy.fft.rfft(square) * (record.size / square.size), n=record.size)
    return whole


def _last_above(values: FloatArray, limit: float) -> float:
    """Distance of the innermost of `values` above `limit` from the nearer end [samples]."""
    above = np.nonzero(values > limit)[0]
    return float(np.minimum(above, values.size - 1 - above).max(initial=0))


def _line_difference(found: FloatArray, expected: FloatArray) -> float:
    lines = np.abs(scipy.fft.rfft(expected))[1:]
    return float(np.abs(np.abs(scipy.fft.rfft(found))[1:] - lines).max() / lines.max())


def _fault_line_difference(noise: FloatArray, band_hz: tuple[float, float], end: int) -> float:
    turning = np.exp(2j * np.pi * FAULT_HZ / FS_HZ * np.arange(noise.size))
    record = noise * (1 + FAULT_DEPTH * turning.real)
    found, expected = (
        abs(np.vdot(turning[end:-end], square[end:-end]))
        for square in (_one_pass(record, band_hz), squared_envelope(bandpass(record, FS_HZ, band_hz)))
    )
    return float(abs(found / expected - 1))


@dataclass(frozen=True, kw_only=True)
class ChainTiming:
    """Median wall times [s] of `what` and of `against`, each in one thread, and their ratio."""

    what: str
    against: str
    seconds: float
    against_seconds: float
    ratio: float


def timings() -> tuple[ChainTiming, ...]:
    """Record to envelope spectrum."""
    samples = np.random.default_rng(0).standard_normal(SAMPLES)
    return (
        _timing("envelope spectrum, one pass", "sosfiltfilt, hilbert, abs, rfft", ROUNDS * 3,
                lambda: _own(samples), lambda: _usual(samples)),
    )  # fmt: skip


def _own(samples: FloatArray) -> object:
    square, rate = squared_envelope_one_pass(samples, FS_HZ, BANDS_HZ[0])
    return amplitude_spectrum(drop_ends(square, rate, end_s(BANDS_HZ[0])), rate)


def _usual(samples: FloatArray) -> object:
    import scipy.signal

    return scipy.fft.rfft(np.abs(scipy.signal.hilbert(bandpass(samples, FS_HZ, BANDS_HZ[0]))))


def _timing(
    what: str, against: str, rounds: int, ours: Callable[[], object], theirs: Callable[[], object]
) -> ChainTiming:  # fmt: skip
    pairs = [(timeit.timeit(ours, number=1), timeit.timeit(theirs, number=1)) for _ in range(rounds)]
    own, other = (statistics.median(column) for column in zip(*pairs, strict=True))
    return ChainTiming(what=what, against=against, seconds=own, against_seconds=other, ratio=own / other)
