"""Frequency of a fault line by a joint fit of its harmonics and sidebands; scores of combs over all frequencies."""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.ndimage import maximum_filter1d

from srbval.arrays import FloatArray
from srbval.signal.false_alarm import false_alarm, neg_log_p, true_noise_ratio
from srbval.signal.periodogram import MASK_BINS, Noise, Periodogram, Phasors
from srbval.signal.slip import NORMAL_95, frequency_error_hz, track_slip

HARMONICS = 5  # lines of a comb that are read together, if they are below the limit of the record
# Limits for a detected line: its probability on noise alone, the share of the record's placebos that are as strong, and
# its first harmonic over the local noise in the squared envelope spectrum, which separates the records that Smith &
# Randall (2015, Mech. Syst. Signal Process. 64-65, 100) call diagnosable from the others.
FALSE_ALARM, PLACEBO_FALSE_ALARM, LEAST_SNR = 1e-3, 1e-2, 10.0
SIDE_LOBE_BINS, SIDE_LOBE_SHARE = 4.0, 0.1  # a peak below this share of a line within so many bins is its side lobe
_OVERSAMPLING = 8  # candidates per bin of the highest harmonic
SIDEBAND_SNR = 12.0  # least power over noise of a sideband
SIDEBAND_HARMONICS = 3  # sidebands of higher harmonics overlap with other lines
_SPECTRUM_OVERSAMPLING = 2  # candidates per bin of the highest line, for scores over all frequencies
MASKED = 0.5963473623  # score of a masked line: the mean of log(1 + x) for an exponential variable x of mean one


@dataclass(frozen=True, kw_only=True)
class LineReading:
    """Highest peak in the search window of a line, or of a comb (a line with its harmonics); see `detected`.

    `ci95_hz` excludes the uncertainty of the shaft speed. `snr` is the power of each harmonic over the mean noise power
    in a bin, `depth` the first harmonic's amplitude over the squared envelope's mean, `noise_false_alarm` the chance
    that noise alone is as strong anywhere in the window. `isolated` is false for a side lobe of another line, `covered`
    true for a peak in a masked zone (a shaft harmonic or a stronger line). `sideband_hz` is the sidebands' spacing.
    """

    found_hz: float
    ci95_hz: float
    snr: tuple[float, ...]
    noise_false_alarm: float
    half_window_hz: float
    isolated: bool
    depth: float
    resolution_hz: float
    sideband_hz: float | None = None
    sideband_ci95_hz: float | None = None
    placebo_false_alarm: float | None = None
    comb_false_alarm: float | None = None
    covered: bool = False

    @property
    def detected(self) -> bool:
        """True for a strong peak, neither masked nor a side lobe, that neither noise nor other combs explain."""
        improbable = is_improbable(self.noise_false_alarm, self.placebo_false_alarm)
        return self.isolated and not self.covered and improbable and self.snr[0] > LEAST_SNR


def is_improbable(noise_false_alarm: float, placebo_false_alarm: float | None) -> bool:
    """True if a line is too strong to be noise or a placebo (harmonics of a frequency without a bearing line).

    Each argument is the probability of so strong a line; `placebo_false_alarm` is None if no placebos were compared.
    """
    return noise_false_alarm < FALSE_ALARM and (placebo_false_alarm or 0.0) < PLACEBO_FALSE_ALARM


def read_comb(
    record: Periodogram,
    expected_hz: float,
    half_window_hz: float,
    *,
    harmonics: int = HARMONICS,
    sideband_hz: float = 0.0,
    period_s: float | None = 0.0,
) -> LineReading | None:
    """Fit lines at ``f, 2f, ... Hf`` and sidebands ``hf +- s``, f within `half_window_hz` of `expected_hz`.

    H is `harmonics`. The fit starts at the highest sum of `neg_log_p` of all harmonics and at the spacing s =
    `sideband_hz` (zero: no sidebands). f and s maximise the likelihood for lines of unknown amplitude and phase (Rife &
    Boorstyn 1974, IEEE Trans. Inf. Theory 20, 591). Then the line's phase is tracked for slip (`track_slip`), unless
    `period_s`, the period of the modulation by the shaft (0: none), is None. Masked lines and lines above
    ``record.limit_hz`` are ignored. Returns None if f may be above this limit, or its window is masked or has no peak.
    """
    used = min(harmonics, math.floor(record.limit_hz / (expected_hz + half_window_hz)))
    if used < 1:
        return None
    number = np.arange(1, used + 1)
    candidates = _candidates(record, expected_hz, half_window_hz, used)
    if np.all(record.masked(candidates)):
        return None
    noise = [record.noise_near(h * expected_hz, h * half_window_hz) for h in number]
    bins = np.array([n.bins for n in noise], dtype=np.float64)
    ratios = np.column_stack([_ratio(record, h * candidates, n) for h, n in zip(number, noise, strict=True)])
    best = _highest_peak(candidates, neg_log_p(ratios, bins).sum(axis=1))
    if best is None:
        return None
    # neg_log_p, which allows for estimated noise, flattens the top of a strong line; its power does not.
    highest = _totals(_snr(record, best, noise), bins)
    near = np.abs(candidates - best) <= record.bin_hz
    best = float(candidates[near][np.argmax(ratios[near].sum(axis=1))])
    fitted_hz, ci95_hz, spacing_hz, spacing_ci95_hz = fit(record, best, noise, sideband_hz, period_s=period_s)
    inside = abs(fitted_hz - expected_hz) < half_window_hz
    found_hz = fitted_hz if inside else best  # a fit that leaves the window follows another line
    snr = _snr(record, found_hz, noise)
    # The probability belongs to the highest value in the window, which may exceed the value at the fitted frequency.
    visible = np.count_nonzero([~record.masked(h * candidates) for h in number], axis=0)
    share = np.bincount(visible, minlength=used + 1) / candidates.size
    probability = false_alarm(*max(_totals(snr, bins), highest), share, half_window_hz, record.seconds)
    around = found_hz + np.linspace(-SIDE_LOBE_BINS, SIDE_LOBE_BINS, 8 * round(SIDE_LOBE_BINS) + 1) * record.bin_hz
    is_highest = float(snr[0]) >= SIDE_LOBE_SHARE * float(np.max(_ratio(record, around, noise[0])))
    covered = bool(record.masked(np.array(found_hz)))
    if covered:
        snr[0] = float(record.exact_power_at(np.array([found_hz]))[0]) / noise[0].mean_power
    return LineReading(
        found_hz=found_hz,
        # At most to the window's far end, so that the interval of a line off its middle is not cut.
        ci95_hz=min(ci95_hz, half_window_hz + abs(found_hz - expected_hz)),
        snr=tuple(snr.tolist()),
        noise_false_alarm=probability,
        half_window_hz=half_window_hz,
        depth=record.depth_at(found_hz),
        isolated=inside and is_highest,
        covered=covered,
        resolution_hz=record.bin_hz,
        sideband_hz=spacing_hz,
        sideband_ci95_hz=spacing_ci95_hz,
    )


def peak_snr(record: Periodogram, expected_hz: float, half_window_hz: float) -> float | None:
    """Power over noise of the highest peak within `half_window_hz`, without a fit; None if `read_comb` returns None."""
    candidates = _candidates(record, expected_hz, half_window_hz, 1)
    if expected_hz + half_window_hz > record.limit_hz or np.all(record.masked(candidates)):
        return None
    noise = record.noise_near(expected_hz, half_window_hz)
    best = _highest_peak(candidates, _ratio(record, candidates, noise))
    return None if best is None else float(_snr(record, best, [noise])[0])


def _totals(snr: FloatArray, bins: FloatArray) -> tuple[float, float]:
    """Sum of `neg_log_p` and sum of `true_noise_ratio` over the harmonics of a comb."""
    return float(neg_log_p(snr, bins).sum()), float(true_noise_ratio(snr, bins).sum())


def _highest_peak(candidates: FloatArray, score: FloatArray) -> float | None:
    """Frequency of `candidates` with the highest interior maximum of `score`; a maximum at the edge is ignored."""
    peaks = np.flatnonzero((score[1:-1] >= score[:-2]) & (score[1:-1] > score[2:])) + 1
    return float(candidates[peaks[np.argmax(score[peaks])]]) if peaks.size else None


def _candidates(record: Periodogram, expected_hz: float, half_window_hz: float, used: int) -> FloatArray:
    step = record.bin_hz / (_OVERSAMPLING * used)
    count = max(1, math.ceil(half_window_hz / step))
    return expected_hz + np.linspace(-half_window_hz, half_window_hz, 2 * count + 1)


def _ratio(record: Periodogram, frequency_hz: FloatArray, noise: Noise) -> FloatArray:
    return np.where(record.masked(frequency_hz), 0.0, record.power_at(frequency_hz) / noise.mean_power)


def _snr(record: Periodogram, found_hz: float, noise: list[Noise]) -> FloatArray:
    """Power of each harmonic of `found_hz`, from its exact Fourier sum, over the `noise` near it."""
    at = np.arange(1, len(noise) + 1, dtype=np.float64) * found_hz
    power = record.exact_power_at(at) / np.array([n.mean_power for n in noise])
    return np.where(record.masked(at), 0.0, power)


def fit(
    record: Periodogram, start_hz: float, noise: Sequence[Noise], sideband_hz: float, *, period_s: float | None
) -> tuple[float, float, float | None, float | None]:
    """Fit a line's frequency, and the spacing of its sidebands if any; returns each with its 95 % half width [Hz]."""
    number, side, noise_power, snr = _present(record, start_hz, noise, sideband_hz)
    directions = np.column_stack((number, side)[: 2 if np.any(side != 0) else 1])
    phasors = Phasors.of(record.samples, record.fs_hz, number * start_hz + side * sideband_hz)
    shift = _maximise(phasors, directions, snr, noise_power)
    line_shift, side_shift = float(shift[0]), float(shift[1:].sum())
    found = line_hz = start_hz + line_shift
    shifted = phasors.shifted(number * line_shift + side * side_shift)
    information = directions.T @ (np.maximum(shifted.power() / noise_power - 1, 0)[:, None] * directions)
    variances = np.diag(np.linalg.inv(information + 1e-12 * np.eye(shift.size)))  # finite without information
    ci95, spacing_ci95 = (NORMAL_95 * frequency_error_hz(1 / float(variances[n]), phasors.seconds) for n in (0, -1))
    if period_s is not None:
        slip = track_slip(shifted, number, noise_power, line_hz=found, period_s=period_s)
        if slip is not None:
            found, ci95 = found + slip[0], slip[1]
    if shift.size == 1:
        return found, ci95, None, None
    # Side lobes of a line r times as strong in amplitude, d bins away, would shift its sidebands by 3 r / (pi^2 d)
    # bins. So the spacing is fitted again with the line's harmonics subtracted from the record.
    is_line, spacing_hz = side == 0, sideband_hz + side_shift
    phase = 2 * np.pi * line_hz * (np.arange(record.samples.size) - (record.samples.size - 1) / 2) / record.fs_hz
    waves = np.column_stack([wave(harmonic * phase) for harmonic in number[is_line] for wave in (np.cos, np.sin)])
    rest = record.samples - waves @ np.linalg.solve(waves.T @ waves, waves.T @ record.samples)
    number, side, noise_power = (values[~is_line] for values in (number, side, noise_power))
    phasors = Phasors.of(rest, record.fs_hz, number * line_hz + side * spacing_hz)
    shift = _maximise(phasors, side[:, None], phasors.power() / noise_power, noise_power)
    return found, ci95, spacing_hz + float(shift[0]), spacing_ci95


def _present(record: Periodogram, line_hz: float, noise: Sequence[Noise], sideband_hz: float) -> FloatArray:
    """Select lines h `line_hz` + k `sideband_hz` to fit: unmasked harmonics (k = 0), sidebands above noise (k = -1, 1).

    Returns the rows h, k, mean noise power in a bin, and power over noise, [4, lines].
    """
    harmonics = len(noise)
    terms = [(h, 0) for h in range(1, harmonics + 1)]
    if sideband_hz > 0:
        pairs = [(h, k) for h in range(1, min(harmonics, SIDEBAND_HARMONICS) + 1) for k in (-1, 1)]
        terms += [(h, k) for h, k in pairs if h * line_hz + k * sideband_hz < record.limit_hz]
    number, side = np.array(terms, dtype=np.float64).T
    power = np.array([noise[h - 1].mean_power for h, _ in terms])
    at = number * line_hz + side * sideband_hz
    snr = np.where(record.masked(at), 0.0, record.power_at(at) / power)
    present = (side == 0) & (snr > 0) | (side != 0) & (snr > SIDEBAND_SNR)
    if not np.any(present):
        present[0] = True
    return np.stack([values[present] for values in (number, side, power, snr)])


def _maximise(phasors: Phasors, directions: FloatArray, snr: FloatArray, noise_power: FloatArray) -> FloatArray:
    """Maximise the sum of the lines' powers by Newton steps; returns the shifts of the unknowns [Hz].

    `directions` [lines, unknowns] are the derivatives of the lines' frequencies with respect to the unknowns.
    """
    weight = np.maximum(snr - 1, 0.05) / np.maximum(snr, 1.05) / noise_power  # the line's share of the power
    longest = 0.25 / (phasors.seconds * np.abs(directions).max(axis=0))
    shift, time = np.zeros(directions.shape[1]), phasors.time_s
    for _ in range(6):
        shifted = phasors.shifted(directions @ shift)
        # Derivatives of each component's amplitude, and so of its power, by its own frequency.
        total = shifted.sums.sum(axis=1)
        first = -2j * np.pi * (shifted.sums @ time + shifted.moments.sum(axis=1))
        second = (-2j * np.pi) ** 2 * (shifted.sums @ time**2 + 2 * (shifted.moments @ time))
        slope = 2 * (np.conj(total) * first).real
        curvature = 2 * (np.abs(first) ** 2 + (np.conj(total) * second).real)
        gradient = directions.T @ (weight * slope)
        hessian = directions.T @ ((weight * curvature)[:, None] * directions)
        # Newton's step to the maximum; if the sum is not yet concave, the longest allowed step uphill.
        concave = np.all(np.linalg.eigvalsh(hessian) < 0)
        step = -np.linalg.solve(hessian, gradient) if concave else np.sign(gradient) * longest
        shift = shift + np.clip(step, -longest, longest)
    return shift


@dataclass(frozen=True, kw_only=True, eq=False)
class CombSpectrum:
    """Score [n] of a comb of `HARMONICS` lines at each fundamental `frequency_hz` [n], `step` apart in the logarithm.

    The score is the sum of log(1 + power over local noise): one strong line does not outweigh all others. `lines` [m]
    are these logarithms at the frequencies `line_hz` [m]. `depth` [m] is the amplitude at `line_hz` over the mean
    of the squared envelope; if the record was demodulated in several frequency bands, the greatest of these values.
    """

    line_hz: FloatArray
    lines: FloatArray
    depth: FloatArray
    step: float
    bin_hz: float

    @classmethod
    def of(cls, bands: Sequence[Sequence[Periodogram]], lowest_hz: float) -> Self:
        """Score combs with fundamentals from `lowest_hz` up in the mean of the spectra `bands[record][band]`.

        Each record has the same number of bands. The mean of n records scatters less by the root of n, so the distances
        of log(1 + S/N) from their median are multiplied by this root, to be comparable with those of one record.
        `depth`, the modulation depth, is reduced by the part due to noise if there are several records.
        """
        first, count = bands[0], len(bands)
        limit_hz = min(one.limit_hz for record in bands for one in record)
        step = 1 / (_SPECTRUM_OVERSAMPLING * first[0].seconds * limit_hz)
        hz = np.exp(np.arange(math.log(lowest_hz), math.log(limit_hz), step))
        snr = np.array([[one.snr_at(hz) for one in record] for record in bands])
        lines = np.log1p(snr.mean(axis=(0, 1)))
        square = np.array([[one.power_at(hz) * (2 / one.samples.size / one.mean) ** 2 for one in r] for r in bands])
        if count > 1:
            lines = MASKED + math.sqrt(count) * (lines - np.median(lines))
            square *= np.maximum(0, 1 - 1 / np.maximum(snr.mean(axis=0), 1))
        depth = np.sqrt(square.mean(axis=0).max(axis=0))
        return cls(line_hz=hz, lines=lines, depth=depth, step=step, bin_hz=first[0].bin_hz)

    @functools.cached_property
    def score(self) -> FloatArray:
        """Sums of the line scores, which are `step` apart in the log of frequency, over each comb's harmonics, [n]."""
        shift = [round(math.log(number) / self.step) for number in range(1, HARMONICS + 1)]
        size = max(0, self.lines.size - shift[-1])
        return np.asarray(np.sum([self.lines[at : at + size] for at in shift], axis=0))

    @property
    def frequency_hz(self) -> FloatArray:
        """Fundamentals of the combs [Hz], [n]."""
        return self.line_hz[: self.score.size]

    def highest(self, centre_hz: float, half_hz: float) -> int | None:
        """Index of the highest score within `half_hz` of `centre_hz`; None if the spectrum does not reach there."""
        first, end = np.searchsorted(self.frequency_hz, (centre_hz - half_hz, centre_hz + half_hz))
        return int(first + np.argmax(self.score[first:end])) if end > first else None

    def typical(self, relative: float) -> float:
        """Score of a typical comb: median, over all fundamentals, of the highest score within +-`relative` of each."""
        if self.score.size == 0:
            return 0.0
        half = max(1, round(relative / self.step))
        return float(np.median(maximum_filter1d(self.score, 2 * half + 1)))

    def without(self, centre_hz: FloatArray, half_hz: FloatArray) -> Self:
        """Comb spectrum in which lines up to `half_hz` [k] + 1.5 bins away from a `centre_hz` [k] count as noise."""
        reach = half_hz + MASK_BINS * self.bin_hz
        edges = np.zeros(self.line_hz.size + 1)
        np.add.at(edges, np.searchsorted(self.line_hz, centre_hz - reach), 1)
        np.add.at(edges, np.searchsorted(self.line_hz, centre_hz + reach), -1)
        return replace(self, lines=np.where(np.cumsum(edges[:-1]) > 0, MASKED, self.lines))
