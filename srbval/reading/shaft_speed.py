"""The shaft speed of a record without a tachometer, from its fault harmonics and the shaft's sidebands."""

import dataclasses
import itertools
import math
from typing import NamedTuple

import numpy as np
import scipy.special
import scipy.stats

from srbval.arrays import FloatArray
from srbval.reading.lines import Line, detected_fault_lines
from srbval.recordings import ShaftSpeed, SpeedSource
from srbval.signal import Periodogram, frequency_error_hz
from srbval.signal.comb_spectrum import CombSpectrum

HARMONICS = 5  # of the fault line whose sidebands are used
SIDEBANDS = 3  # shaft orders to either side of each
SHAFT_HARMONICS = 4  # of the shaft itself, in the envelope
# Half width of the search about the nominal speed, as a share of it: set points of rigs turn out 6 % wrong.
SEARCH_SHARE = 0.1
# Every speed but the best is a placebo: the next best peak of the score may rise above the median score by no more than
# this share of what the best does. Lines of other sources make up combs by chance, several about as good.
RIVAL_SHARE = 0.5
# Two speeds closer than this, in bins of the highest shaft order, are one.
SAME_BINS = 2.0
# -log p of one term counts no more than this: one strong line of another source must not outweigh all others.
LARGEST_NEG_LOG_P = 30.0
# Effective number of averaged bins of the local noise estimate, a median of some 65 bins.
NOISE_BINS = 30.0
FALSE_ALARM = 1e-3
# A term this far above the noise gives a frequency; fewer shaft terms leave too little to check the fit against.
SHOWN_SNR, LEAST_TERMS = 12.0, 4
# Least standard error of a peak's frequency, in bins: it is read by a parabola, and no shaft speed is constant.
LEAST_PEAK_ERROR_BINS = 0.01
# Share of the speed that the fit's scatter does not show: clocks of recorder and tachometer, drift within the record,
# rounding of the measured value. No record of a set whose estimates are used had a part in it (MFPT, HIT-SM); it is
# what the estimates are off on records whose speed is measured, by CWRU's integer rpm and the rig's tachometer. Each of
# those left out in turn, the largest excess of the others covers 16 of 17: the rig's 2 s excerpt needs 6.5e-4 for
# itself, the others 2.1e-4 at most (tests/reading/test_shaft_speed.py).
ALLOWANCE = 8e-4
_GRID_PER_BIN = 16
# The shaft's comb in a whitened envelope: its lines, and the least score. Of 61 measured records the wrong combs
# within `SEARCH_SHARE` reach 9.5, and all 26 above 12 whose speed is known otherwise are right to 0.2 %. Set on all.
COMB_LINES, LEAST_COMB = 5, 12.0
# Combs nearer than this are one shaft's, smeared: the interval reaches to the farthest one.
SMEAR = 0.02


class SpectralTerm(NamedTuple):
    """A line at ``harmonic`` times the fault line plus ``order`` times the shaft."""

    harmonic: int
    order: int

    def at(self, line_hz: float, shaft_hz: FloatArray | float) -> FloatArray:
        """Its frequency [Hz] for each shaft speed."""
        return np.asarray(self.harmonic * line_hz + self.order * shaft_hz, dtype=np.float64)


def estimate_speed(record: Periodogram, lines: tuple[Line, ...], nominal: ShaftSpeed) -> ShaftSpeed | None:
    """Shaft speed read from `record`, the periodogram of a squared envelope, about a `nominal` one.

    First the speed, within `SEARCH_SHARE` of the nominal one whatever its interval, at which sidebands of the deepest
    detected fault line and harmonics of the shaft stand out together most; then line and shaft jointly by least
    squares through the peaks of all terms that stand out, the scatter about the fit widening the interval (Birge's
    ratio), and `ALLOWANCE` for what scatter does not show. Cage slip moves the line and leaves the spacing of its
    sidebands alone: no kinematics is used. None where noise would do as well or another speed nearly as well
    (`RIVAL_SHARE`), where fewer than four shaft terms show, or where the result is no more certain than the nominal
    speed. It may lie outside the nominal speed's interval: the caller says so. A drift within the record is averaged,
    not followed.
    """
    bare = dataclasses.replace(record, masks_hz=np.empty((0, 2)))
    line = next((x.found_hz or 0.0 for x in detected_fault_lines(lines)), 0.0)
    half = max(SEARCH_SHARE, nominal.ci95_hz / nominal.value_hz) * nominal.value_hz
    start = _search(bare, line, nominal.value_hz, half)
    if start is None:
        return None
    found = _fit(bare, line, start)
    if found is None or found.ci95_hz >= nominal.ci95_hz or abs(found.value_hz - nominal.value_hz) > half:
        return None
    return found


def speed_by_comb(record: Periodogram, nominal: ShaftSpeed) -> ShaftSpeed | None:
    """Shaft speed by the strongest comb of a whitened envelope within `SEARCH_SHARE` of a `nominal` one, or None.

    For records whose band shows too few lines of the shaft for `estimate_speed`. The interval reaches to the farthest
    comb within `SMEAR` that rises by `RIVAL_SHARE` of the best; where one beyond it does, no speed is given.
    """
    bare = dataclasses.replace(record, masks_hz=np.empty((0, 2)))
    combs = CombSpectrum.of(bare, (1 - SEARCH_SHARE) * nominal.value_hz, COMB_LINES)
    inside = np.abs(combs.frequency_hz / nominal.value_hz - 1) <= SEARCH_SHARE
    score, hz = combs.score[inside], combs.frequency_hz[inside]
    if not score.size or (highest := float(score.max())) < LEAST_COMB:
        return None
    value, usual = float(hz[np.argmax(score)]), float(np.median(score))
    spread = float(np.abs(hz[score - usual > RIVAL_SHARE * (highest - usual)] / value - 1).max())
    if spread > SMEAR:
        return None
    return ShaftSpeed(value_hz=value, ci95_hz=max(ALLOWANCE, spread) * value, source=SpeedSource.ESTIMATED)


def _terms(line_hz: float) -> list[SpectralTerm]:
    """Harmonics of the shaft and, where there is a fault line, the sidebands of its harmonics."""
    orders = [k for k in range(-SIDEBANDS, SIDEBANDS + 1) if k]
    sides = itertools.product(range(1, HARMONICS + 1), orders) if line_hz else ()
    return [SpectralTerm(*term) for term in (*((0, k) for k in range(1, SHAFT_HARMONICS + 1)), *sides)]


def _search(record: Periodogram, line_hz: float, nominal_hz: float, half_hz: float) -> float | None:
    """The speed in the window with the largest joint -log p of all terms; None where noise or a rival reaches it."""
    speeds = np.arange(nominal_hz - half_hz, nominal_hz + half_hz, record.bin_hz / _GRID_PER_BIN)
    score, used = np.zeros(speeds.size), 0
    for term in _terms(line_hz):
        frequencies = term.at(line_hz, speeds)
        ends = frequencies[0], frequencies[-1]
        if min(ends) < 3 * record.bin_hz or max(ends) > record.limit_hz:
            continue
        centre = float(term.at(line_hz, nominal_hz))
        snr = record.power_at(frequencies) / record.noise_near(centre, abs(term.order) * half_hz).mean_power
        neg_log_p = NOISE_BINS * np.log1p(snr / NOISE_BINS)
        score += np.minimum(neg_log_p, LARGEST_NEG_LOG_P)
        used += 1
    if not used:
        return None
    best = int(np.argmax(score))
    trials = max(1.0, 2 * half_hz / record.bin_hz * SIDEBANDS)  # independent speeds
    rival = np.max(score, where=np.abs(speeds - speeds[best]) > SAME_BINS * record.bin_hz, initial=-np.inf)
    usual = float(np.median(score))
    if rival - usual > RIVAL_SHARE * (score[best] - usual):
        return None
    return float(speeds[best]) if trials * scipy.special.gammaincc(used, float(score[best])) < FALSE_ALARM else None


def _fit(record: Periodogram, line_hz: float, shaft_hz: float) -> ShaftSpeed | None:
    """Least squares through the peaks of all terms that stand out, for line and shaft together."""
    whole = [SpectralTerm(harmonic=h, order=0) for h in range(1, HARMONICS + 1)] if line_hz else []
    read = [(t, *p) for t in whole + _terms(line_hz) if (p := _peak(record, float(t.at(line_hz, shaft_hz))))]
    unknowns = 2 if any(t.harmonic for t, *_ in read) else 1
    if sum(1 for t, *_ in read if t.order) < LEAST_TERMS or len(read) <= unknowns:
        return None
    design = np.array([(t.order, t.harmonic)[:unknowns] for t, *_ in read], dtype=np.float64)
    peak_hz, sigma = (np.array([entry[i] for entry in read]) for i in (1, 2))
    weighted = design / sigma[:, None]
    if np.linalg.matrix_rank(weighted) < unknowns:
        return None
    solution, *_ = np.linalg.lstsq(weighted, peak_hz / sigma, rcond=None)
    freedom = len(read) - unknowns
    scatter = float(np.sum(((peak_hz - design @ solution) / sigma) ** 2)) / freedom
    variance = float(np.linalg.inv(weighted.T @ weighted)[0, 0]) * max(1.0, scatter)
    value = float(solution[0])
    half = math.hypot(float(scipy.stats.t.ppf(0.975, freedom)) * math.sqrt(variance), ALLOWANCE * value)
    return ShaftSpeed(value_hz=value, ci95_hz=half, source=SpeedSource.ESTIMATED)


def _peak(record: Periodogram, about_hz: float) -> tuple[float, float] | None:
    """Frequency of the peak nearest `about_hz` and its standard error [Hz]; None if no peak stands out."""
    reach = record.bin_hz
    if not 3 * reach < about_hz < record.limit_hz:
        return None
    first = math.floor((about_hz - reach) / record.step_hz)
    power = record.power[first : math.ceil((about_hz + reach) / record.step_hz) + 1]
    top = int(np.argmax(power))
    snr = float(power[top]) / record.noise_near(about_hz, 3 * reach).mean_power
    if top in (0, power.size - 1) or snr < SHOWN_SNR:
        return None
    left, middle, right = np.log(power[top - 1 : top + 2])  # a parabola through the logs: within 0.01 bins of the peak
    peak_hz = record.step_hz * (first + top + 0.5 * float((left - right) / (left - 2 * middle + right)))
    return peak_hz, max(frequency_error_hz(snr, 1 / record.bin_hz), LEAST_PEAK_ERROR_BINS * record.bin_hz)
