"""Errors of the one-pass signal chain and of the paper's."""

from typing import Any

import numpy as np
import scipy.fft

from srbval.arrays import FloatArray
from srbval.signal import (
    analytic_signal,
    bandpass,
    butterworth_gain,
    end_s,
    squared_envelope,
    squared_envelope_one_pass,
)

FS_HZ, SAMPLES = 20_480.0, 614_400
BANDS_HZ = ((1400.0, 2800.0), (500.0, 1500.0))  # of the rig's and of the simulated signals
RECORDS = 5  # the error of a truncated filtered record depends on the few samples at its ends: the worst of so many
AGREEMENT = 1e-4  # of the largest value
FAULT_HZ, FAULT_DEPTH = 97.0, 0.3


def chain_errors(samples: int = SAMPLES, *, seed: int = 0, records: int = RECORDS) -> list[dict[str, Any]]:
    """Errors on white noise beyond the ends that are dropped, a row for each band, the worst of `records` records.

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
    rng, rows = np.random.default_rng(seed), []
    noise = [rng.standard_normal(3 * samples) for _ in range(records)]
    for band_hz in BANDS_HZ:
        errors = [_chain_error(whole, samples, band_hz) for whole in noise]
        worst = {name: max(error[name] for error in errors) for name in errors[0]}
        rows.append({"low_hz": band_hz[0], "high_hz": band_hz[1], "samples": samples, "records": records, **worst})
    return rows


def _chain_error(whole: FloatArray, count: int, band_hz: tuple[float, float]) -> dict[str, float]:
    gain = butterworth_gain(np.maximum(scipy.fft.rfftfreq(whole.size, 1 / FS_HZ), 1e-9), FS_HZ, band_hz)
    truth = squared_envelope(scipy.fft.irfft(scipy.fft.rfft(whole) * gain, n=whole.size))[count : 2 * count]
    record = whole[count : 2 * count]
    end = round(end_s(band_hz) * FS_HZ)
    ours = _one_pass(record, band_hz)
    filtered = bandpass(record, FS_HZ, band_hz)
    chain, faded = squared_envelope(filtered), squared_envelope(filtered, fade=end)
    envelope = np.sqrt(chain)
    difference = np.abs(np.abs(analytic_signal(record, FS_HZ, band_hz)) - envelope)
    kept = slice(end, -end)

    def largest(found: FloatArray, expected: FloatArray) -> float:
        return float(np.abs(found - expected)[kept].max() / truth[kept].max())

    return {
        "one_pass": largest(ours, truth),
        "papers_chain": largest(chain, truth),
        "papers_chain_faded": largest(faded, truth),
        "one_pass_less_chain": largest(ours, chain),
        "one_pass_less_faded": largest(ours, faded),
        "envelope_less_chain": float(difference[kept].max() / envelope[kept].max()),
        "envelope_rms_less_chain": float(np.linalg.norm(difference[kept]) / np.linalg.norm(envelope[kept])),
        "agree_beyond_s": _last_above(difference, AGREEMENT * envelope[kept].max()) / FS_HZ,
        "lines_less_chain": _line_difference(ours[kept], chain[kept]),
        "fault_line_less_chain": _fault_line_difference(record, band_hz, end),
    }


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
