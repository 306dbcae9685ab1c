"""Reading the frequency of a fault line by a joint fit of its harmonics."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from srbval.signal.false_alarm import comb_trials, evidence, false_alarm
from srbval.signal.periodogram import Noise, Periodogram
from srbval.signal.wander import wander_sigma_hz

FloatArray = NDArray[np.float64]

# Harmonics fitted together, where the record reaches that far.
HARMONICS = 5
# A line counts as detected when noise would show it less often than this ...
FALSE_ALARM = 1e-3
# ... and its first harmonic is this many times the local noise in the squared envelope spectrum, which parts
# the records that Smith & Randall (2015, Mech. Syst. Signal Process. 64-65, 100) call diagnosable from the
# rest.
LEAST_SNR = 10.0
# A peak this much below a line within a few bins of it is that line's own flank (side lobes of a record
# without window: 1/(pi k)^2 at k bins).
FLANK_BINS, FLANK_SHARE = 4.0, 0.1
# A harmonic this far above the noise is taken to be there; weaker ones do not sharpen the frequency.
SHOWN_SNR = 8.0
# Parabolas of the final fit.
_REFINEMENTS = 4
# Candidates per bin of the highest harmonic.
_OVERSAMPLING = 8
# Standard error of a tone's frequency, in units of bins over the root of its snr: sqrt(6) / (2 pi).
_RIFE_BOORSTYN = math.sqrt(6) / (2 * math.pi)
_NORMAL_95 = 1.96


@dataclass(frozen=True, kw_only=True)
class LineReading:
    """One line (or comb of lines) as found.

    `found_hz` is the fundamental, `ci95_hz` the half width of its 95 % interval without the uncertainty of
    the shaft speed; `snr` the power of each harmonic over the local mean noise power of a bin;
    `false_alarm` the chance of at least this much from noise alone anywhere in the window; `isolated` is
    False where the peak is the flank of a far stronger line or of one outside the window. `depth` is
    the first harmonic's amplitude over the record's mean. A line is always *found*: whether it is there is
    for `detected` to say.
    """

    found_hz: float
    ci95_hz: float
    snr: tuple[float, ...]
    false_alarm: float
    half_window_hz: float
    isolated: bool
    depth: float

    @property
    def detected(self) -> bool:
        """Whether the line is there: improbable as noise, strong enough, and not another line's flank."""
        return self.isolated and self.false_alarm < FALSE_ALARM and self.snr[0] > LEAST_SNR


def read_comb(
    record: Periodogram,
    expected_hz: float,
    half_window_hz: float,
    *,
    harmonics: int = HARMONICS,
    shortest_block_s: float = 0.0,
) -> LineReading | None:
    """Fit ``f, 2f, ... Hf`` together within `half_window_hz` of `expected_hz`.

    Maximises the sum of power over local noise, which is the maximum-likelihood estimate for lines of
    unknown amplitude and phase (Rife & Boorstyn 1974, IEEE Trans. Inf. Theory 20, 591). Harmonics beyond
    ``record.limit_hz`` are left out; shaft harmonics count as nothing. The uncertainty joins the
    Cramer-Rao bound of the noise and the line's own wander (see `wander_sigma_hz`). None where even the
    fundamental lies out of reach, its whole window is masked, or nothing peaks inside it.
    """
    used = min(harmonics, math.floor(record.limit_hz / (expected_hz + half_window_hz)))
    if used < 1:
        return None
    number = np.arange(1, used + 1)
    candidates = _candidates(record, expected_hz, half_window_hz, used)
    if np.all(record.masked(candidates)):
        return None
    noise = [record.noise_about(h * expected_hz, h * half_window_hz) for h in number]
    ratios = np.array([_ratio(record, h * candidates, n) for h, n in zip(number, noise, strict=True)])
    best = _highest_peak(candidates, ratios.sum(axis=0))
    if best is None:
        return None
    found = _refine(record, best, noise)
    snr = _snr(record, found, noise)
    bins = np.array([n.effective_bins for n in noise])
    return LineReading(
        found_hz=found,
        ci95_hz=_ci95_hz(record, found, snr, half_window_hz, shortest_block_s),
        snr=tuple(snr.tolist()),
        false_alarm=false_alarm(
            float(evidence(snr, bins).sum()), used, comb_trials(half_window_hz, record.seconds, used)
        ),
        half_window_hz=half_window_hz,
        depth=record.depth_at(found),
        isolated=abs(found - expected_hz) < half_window_hz and _isolated(record, found, noise[0], float(snr[0])),
    )


def _highest_peak(candidates: FloatArray, score: FloatArray) -> float | None:
    """The candidate of the highest interior maximum; a maximum at the edge belongs to something outside."""
    peaks = np.flatnonzero((score[1:-1] >= score[:-2]) & (score[1:-1] > score[2:])) + 1
    return float(candidates[peaks[np.argmax(score[peaks])]]) if peaks.size else None


def _isolated(record: Periodogram, found_hz: float, noise: Noise, snr: float) -> bool:
    around = found_hz + np.linspace(-FLANK_BINS, FLANK_BINS, 8 * round(FLANK_BINS) + 1) * record.bin_hz
    return snr >= FLANK_SHARE * float(np.max(_ratio(record, around, noise)))


def _candidates(record: Periodogram, expected_hz: float, half_window_hz: float, used: int) -> FloatArray:
    step = record.bin_hz / (_OVERSAMPLING * used)
    count = max(1, math.ceil(half_window_hz / step))
    return expected_hz + np.linspace(-half_window_hz, half_window_hz, 2 * count + 1)


def _ratio(record: Periodogram, frequency_hz: FloatArray, noise: Noise) -> FloatArray:
    return np.where(record.masked(frequency_hz), 0.0, record.power_at(frequency_hz) / noise.mean_power)


def _refine(record: Periodogram, start_hz: float, noise: list[Noise]) -> float:
    """Parabolas through the exact sum of the harmonics that show, from the best candidate."""
    number = np.arange(1, len(noise) + 1, dtype=np.float64)
    shown = _shown(_snr(record, start_hz, noise))
    weight = np.array([1 / n.mean_power for n in noise])[shown]
    found, width = start_hz, record.bin_hz / (4 * float(number[shown].max()))
    for _ in range(_REFINEMENTS):
        at = (found - width, found, found + width)
        left, middle, right = (float(weight @ record.exact_power_at(number[shown] * f)) for f in at)
        curvature = left - 2 * middle + right
        shift = 0.5 * (left - right) / curvature if curvature < 0 else math.copysign(1.0, right - left)
        found += width * min(max(float(shift), -1.0), 1.0)
        if abs(shift) < 1:
            width /= 2
    return found


def _snr(record: Periodogram, found_hz: float, noise: list[Noise]) -> FloatArray:
    """Power over noise of each harmonic of `found_hz`."""
    return np.array([_ratio(record, np.array([h * found_hz]), n)[0] for h, n in enumerate(noise, 1)])


def _shown(snr: FloatArray) -> NDArray[np.bool_]:
    """Harmonics that stand out of the noise, at least the strongest one; the others only add noise."""
    return snr >= min(SHOWN_SNR, float(snr.max()))


def _ci95_hz(
    record: Periodogram, found_hz: float, snr: FloatArray, half_window_hz: float, shortest_block_s: float
) -> float:
    number = np.arange(1, snr.size + 1)
    information = float(np.sum((number**2 * np.maximum(snr - 1, 0))[_shown(snr)]))
    noise = _RIFE_BOORSTYN * record.bin_hz / math.sqrt(max(information, 1e-12))
    wander = wander_sigma_hz(record.samples, record.fs_hz, found_hz, snr, shortest_block_s=shortest_block_s)
    return min(_NORMAL_95 * math.hypot(noise, wander), half_window_hz)
