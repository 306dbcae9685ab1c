"""Shaft speed from lines in a periodogram: harmonics of the shaft, and sidebands of a fault's line."""

import itertools
import math

import numpy as np
import scipy.special

from srbval.signal.comb import HARMONICS
from srbval.signal.periodogram import Periodogram
from srbval.signal.slip import frequency_error_hz

SIDEBANDS_PER_SIDE = 3  # shaft orders to either side of each
SHAFT_HARMONICS = 4  # of the shaft itself, in the envelope
RIVAL_SHARE = 0.5  # largest rise of the next best peak of the score above the median, as a share of the best peak's
SAME_BINS = 2.0  # two speeds closer than this, in bins of the highest shaft order, are one
LARGEST_NEG_LOG_P = 30.0  # largest -log p of one term: one strong line of another source must not outweigh all others
EFFECTIVE_NOISE_BINS = 30.0  # effective number of averaged bins of the local noise estimate, a median of some 65 bins
SHAFT_FALSE_ALARM = 1e-3
SHOWN_SNR, LEAST_TERMS = 12.0, 4  # least power over noise of a term, and least number of shaft terms, for a fit
LEAST_PEAK_ERROR_BINS = 0.01  # least standard error of a peak: it is read by a parabola, and speeds are not constant


def shaft_by_lines(
    record: Periodogram, line_hz: float, nominal_hz: float, half_hz: float
) -> tuple[float, float] | None:
    """Estimate a shaft speed within `half_hz` of a nominal speed, and its 95 % half width [Hz], from its lines.

    `record` must not have masks. The score of a speed sums the evidence for harmonics of the shaft and for sidebands of
    the fault line at `line_hz` (0: none). At the highest score, the frequencies of line and shaft are fitted by least
    squares to all clear peaks; the scatter about the fit (Birge's ratio) widens the interval. None if noise or another
    speed scores nearly as high (`RIVAL_SHARE`), or if fewer than `LEAST_TERMS` peaks are clear.
    """
    bin_hz = record.bin_hz
    speeds = np.arange(nominal_hz - half_hz, nominal_hz + half_hz, bin_hz / 16)
    score, used = np.zeros(speeds.size), 0  # joint -log p of all terms
    for harmonic, order in _terms(line_hz):
        frequencies = harmonic * line_hz + order * speeds
        ends = frequencies[0], frequencies[-1]
        if min(ends) < 3 * bin_hz or max(ends) > record.limit_hz:
            continue
        noise = record.noise_near(harmonic * line_hz + order * nominal_hz, abs(order) * half_hz)
        snr = record.power_at(frequencies) / noise.mean_power
        score += np.minimum(EFFECTIVE_NOISE_BINS * np.log1p(snr / EFFECTIVE_NOISE_BINS), LARGEST_NEG_LOG_P)
        used += 1
    if not used:
        return None
    best = int(np.argmax(score))
    trials = max(1.0, 2 * half_hz / bin_hz * SIDEBANDS_PER_SIDE)  # independent speeds
    rival = np.max(score, where=np.abs(speeds - speeds[best]) > SAME_BINS * bin_hz, initial=-np.inf)
    usual = float(np.median(score))
    if rival - usual > RIVAL_SHARE * (score[best] - usual):
        return None
    if trials * scipy.special.gammaincc(used, float(score[best])) >= SHAFT_FALSE_ALARM:
        return None
    found = _fit(record, line_hz, float(speeds[best]))
    return None if found is None or abs(found[0] - nominal_hz) > half_hz else found


def _terms(line_hz: float) -> list[tuple[int, int]]:
    """Pairs (h, k) for lines at h times the fault line plus k times the shaft: shaft harmonics and sidebands."""
    orders = [k for k in range(-SIDEBANDS_PER_SIDE, SIDEBANDS_PER_SIDE + 1) if k]
    sides = itertools.product(range(1, HARMONICS + 1), orders) if line_hz else ()
    return [*((0, k) for k in range(1, SHAFT_HARMONICS + 1)), *sides]


def _fit(record: Periodogram, line_hz: float, shaft_hz: float) -> tuple[float, float] | None:
    """Fit fault line and shaft speed by least squares to all clear peaks: speed and its 95 % half width [Hz]."""
    whole = [(h, 0) for h in range(1, HARMONICS + 1)] if line_hz else []
    terms = whole + _terms(line_hz)
    read = [(k, h, *p) for h, k in terms if (p := _peak(record, h * line_hz + k * shaft_hz))]
    order, harmonic, peak_hz, sigma = np.array(read, dtype=np.float64).reshape(-1, 4).T
    unknowns = 2 if np.any(harmonic) else 1
    if np.count_nonzero(order) < LEAST_TERMS or len(read) <= unknowns:
        return None
    design = np.column_stack((order, harmonic)[:unknowns])
    weighted = design / sigma[:, None]
    if np.linalg.matrix_rank(weighted) < unknowns:
        return None
    solution, *_ = np.linalg.lstsq(weighted, peak_hz / sigma, rcond=None)
    freedom = len(read) - unknowns
    scatter = float(np.sum(((peak_hz - design @ solution) / sigma) ** 2)) / freedom
    variance = float(np.linalg.inv(weighted.T @ weighted)[0, 0]) * max(1.0, scatter)
    value = float(solution[0])
    return value, float(scipy.special.stdtrit(freedom, 0.975)) * math.sqrt(variance)


def _peak(record: Periodogram, about_hz: float) -> tuple[float, float] | None:
    """Frequency and standard error [Hz] of the highest peak within a bin of `about_hz`; None if below `SHOWN_SNR`."""
    reach = record.bin_hz
    if not 3 * reach < about_hz < record.limit_hz:
        return None
    first = math.floor((about_hz - reach) / record.step_hz)
    power = record.power[first : math.ceil((about_hz + reach) / record.step_hz) + 1]
    top = int(np.argmax(power))
    snr = float(power[top]) / record.noise_near(about_hz, 3 * reach).mean_power
    if top in (0, power.size - 1) or snr < SHOWN_SNR:
        return None
    left, middle, right = np.log(power[top - 1 : top + 2])  # a parabola through them is within 0.01 bins of the peak
    peak_hz = record.step_hz * (first + top + 0.5 * float((left - right) / (left - 2 * middle + right)))
    return peak_hz, max(frequency_error_hz(snr, 1 / record.bin_hz), LEAST_PEAK_ERROR_BINS * record.bin_hz)
