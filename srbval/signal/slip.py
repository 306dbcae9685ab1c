"""Mean frequency of a slipping line from its phase over the record, and its interval from noise and slip.

Random slip makes the phase of a line, whose slope is the frequency, a random walk over the blocks (parts) of a record;
noise adds an independent error to each block's phase. The ratio of walk to noise is estimated from the phase's
residuals about a straight line. The residuals cannot separate slip as large as the noise from no slip, so the half
width is a tabulated multiple of the estimated spread (`half_width`). The path of the phase is found by dynamic
programming (Viterbi 1967, IEEE Trans. Inf. Theory 13, 260), since phases may be wrong by a turn, and then refined.
"""

import functools
import importlib.resources
import math
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.special

from srbval.arrays import ComplexArray, FloatArray
from srbval.signal.periodogram import Phasors
from srbval.signal.phase_posterior import posterior

NORMAL_95 = 1.959964
WEAK_SNR = 10.0  # if the strongest harmonic is this many times its noise, phases scatter twice as far as to first order


def frequency_error_hz(information: float, seconds: float) -> float:
    """Least standard error of the frequency of a steady tone of unknown amplitude and phase in noise [Hz].

    Rife & Boorstyn 1974, IEEE Trans. Inf. Theory 20, 591. `information` is the tone's peak in a periodogram divided by
    the noise there; for a tone with harmonics h it is the sum of h^2 times each harmonic's peak over noise.
    """
    return math.sqrt(6 / information) / (2 * math.pi * seconds) if information > 0 else math.inf


@functools.cache
def slip_interval() -> dict[str, Any]:
    """Calibrated table of widths of the 95 % interval of a line's frequency (`slip_interval.toml`).

    Let r be the frequency's variance from slip over its variance from noise. The log spread s is the mean of log(1 + r)
    over the posterior of r. The half width is k standard errors from noise. k is ``floor`` for s below ``start``,
    otherwise the larger of ``floor`` and exp(s / 2) times a factor, interpolated in s between values ``factor`` at
    ``log_spread``. For weak lines see `weak_factor`.
    """
    file = importlib.resources.files("srbval.signal") / "slip_interval.toml"
    return tomllib.loads(file.read_text(encoding="utf-8"))


def walk_share(log_spread: float) -> float:
    """Confidence (0 to 1) that a line slips; `log_spread` is the mean of log(1 + slip variance / noise variance)."""
    return -math.expm1(-(max(log_spread - slip_interval()["start"], 0.0) ** 2))


def half_width(log_spread: float, blocks: int, snr: float) -> float:
    """95 % half width of a line's frequency, in standard errors from noise, by the calibrated table `slip_interval`.

    `log_spread` is the mean of log(1 + the frequency's variance from slip / from noise). The table is for strong lines
    and many `blocks` of a record. Few blocks or a low `snr` enlarge the half width in proportion to `walk_share`.
    """
    table = slip_interval()
    wide = math.exp(log_spread / 2) * float(np.interp(log_spread, table["log_spread"], table["factor"]))
    own = table["floor"] if log_spread < table["start"] else max(table["floor"], wide)
    student = float(scipy.special.stdtrit(blocks - 2, 0.975)) / NORMAL_95
    return own * (1 + walk_share(log_spread) * (student * (1 + WEAK_SNR / snr) - 1))


def weak_factor(steady: float, wide: float) -> float:
    """Factor by which the half width of a weak line's credible interval is multiplied to be right in 95 % of cases.

    `steady` is the probability of no slip, `wide` the interval's width over the width that noise alone gives it.
    """
    table = slip_interval()
    by_steady = np.interp(steady, table["weak_steady"], np.log(table["weak_factor"]))
    return math.exp(by_steady + np.interp(math.log(wide), np.log(table["wide"]), np.log(table["wide_factor"])))


# Numbers of blocks; the largest that noise and sidebands allow is used. Blocks last at least two periods of the
# modulation, or one if fewer than `FEW_BLOCKS` of two fit: fewer phases do not distinguish slip from noise.
BLOCK_NUMBERS, FEW_BLOCKS = (96, 48, 32, 24, 16, 12, 8, 6, 5, 4), 8
# Information of all harmonics about the phase, sum h^2 rho, below which all paths are weighted at once
# (`phase_posterior`), and power over noise of the strongest harmonic below which slip is not estimated.
WEAK_INFORMATION, MIN_SLIP_SNR = 1000.0, 8.0
WEAK_BLOCKS = 32
BLOCK_SNR = 1.0  # least power over noise of the strongest harmonic in a block for tracking its phase
LARGEST_JITTER = 0.035  # largest relative jitter of the spacing of impacts that is tracked
WALK_RATIOS = np.geomspace(0.05, 1e10, 93)  # of walk to noise, in the variance of the slope
WALK_RATIO_PRIOR = (1 + WALK_RATIOS) ** -0.5  # prior weights of the ratios
STEP_SHARES = (1.0, 0.03)  # variances of the first steps of a track, relative to that of the largest jitter
# Noise at the line over the noise about it; any but the first must be likelier by this log likelihood.
EXCESSES, EXCESS_MARGIN = (1.0, 1.6, 2.5, 4.0, 6.3), 8.0
TEMPER = 0.5  # exponent of the odds, because the log evidence is approximate
STRAIGHT_MARGIN = 8.0  # a track, chosen among all paths, must be likelier than the straight line by this log likelihood
LEAST_NOISE = 1e-12  # least noise power in a bin, relative to the line's power
PHASES = 96  # phases of the fundamental tried for each block; the fifth harmonic still has 19 per turn


def track_slip(
    phasors: Phasors, number: FloatArray, noise_power: FloatArray, *, line_hz: float, period_s: float = 0.0
) -> tuple[float, float] | None:
    """Shift from `line_hz` of the mean frequency of a line that may slip, and its 95 % half width [Hz].

    Component c of `phasors` is harmonic `number[c]`, with `noise_power[c]` in a bin; `period_s` is the period of the
    line's amplitude modulation by the shaft (0: none). None if the line is too weak; the half width is infinite for
    too few blocks to estimate slip.
    """
    # A random walk cannot be compared with no noise at all.
    noise_power = np.maximum(noise_power, LEAST_NOISE * float(np.max(phasors.power())))
    if float(np.max(phasors.power() / noise_power)) < MIN_SLIP_SNR:
        return None
    weak = weak_sums(phasors, number, noise_power, period_s=period_s)
    if weak is not None:
        block_s = phasors.seconds / weak.shape[1]
        shift_hz, credible_hz, steady = posterior(weak, number, line_hz=line_hz, block_s=block_s)
        wide = credible_hz / (NORMAL_95 * noise_error_hz(weak, number, block_s))
        return shift_hz, weak_factor(steady, wide) * credible_hz
    found_blocks = _in_blocks(phasors, noise_power, period_s)
    if (sums := next((sums for sums, snr in found_blocks if float(snr.max()) >= BLOCK_SNR), None)) is None:
        return 0.0, math.inf
    # The mean over tracks from several starts, weighted by their evidence; their differences widen the interval.
    block_s = phasors.seconds / sums.shape[1]
    walk = (2 * math.pi * LARGEST_JITTER) ** 2 * line_hz * block_s
    starts = [np.zeros(sums.shape[1]), *(_viterbi_path(sums, number, walk * share) for share in STEP_SHARES)]
    log_evidence, slope, half = np.array([_track(sums, number, start) for start in starts]).T
    log_evidence[0] += STRAIGHT_MARGIN
    weight = np.exp(TEMPER * (log_evidence - log_evidence.max()))
    if weight[0] == 1:
        weight = np.eye(1, weight.size)[0]
    weight /= weight.sum()
    mean = float(weight @ slope)
    spread = float(weight @ (half**2 + (NORMAL_95 * (slope - mean)) ** 2))
    rad_per_hz = 2 * math.pi * block_s
    return mean / rad_per_hz, math.sqrt(spread) / rad_per_hz


def weak_sums(
    phasors: Phasors, number: FloatArray, noise_power: FloatArray, *, period_s: float = 0.0
) -> ComplexArray | None:
    """Fourier sums of a weak line's c harmonics in noise units, [c, blocks]; None for a strong line or short record."""
    for sums, snr in _in_blocks(phasors, noise_power, period_s, most=WEAK_BLOCKS):
        return sums if float(number**2 @ np.maximum(snr, 0)) * sums.shape[1] < WEAK_INFORMATION else None
    return None


def _in_blocks(
    phasors: Phasors, noise_power: FloatArray, period_s: float, most: int = BLOCK_NUMBERS[0]
) -> Iterator[tuple[ComplexArray, FloatArray]]:
    """Yield for ever fewer blocks of a record its Fourier sums [c, blocks] in noise units, and power over noise [c]."""
    shortest_s = period_s * (2 if phasors.seconds >= 2 * FEW_BLOCKS * period_s else 1)
    for blocks in BLOCK_NUMBERS:
        if blocks <= min(most, phasors.sums.shape[1]) and phasors.seconds >= blocks * shortest_s:
            first = np.linspace(0, phasors.sums.shape[1], blocks + 1).astype(int)[:-1]
            sums = np.add.reduceat(phasors.sums, first, axis=1) * np.sqrt(blocks / noise_power)[:, None]
            yield sums, np.mean(np.abs(sums) ** 2, axis=1) - 1


def noise_error_hz(sums: ComplexArray, number: FloatArray, block_s: float) -> float:
    """Standard error [Hz] that noise gives the frequency of a line without slip, from the `sums` of `weak_sums`."""
    blocks = sums.shape[1]
    snr = np.abs(sums.sum(axis=1)) ** 2 / blocks - 1
    return frequency_error_hz(max(float(number**2 @ np.maximum(snr, 0)), 1.0), blocks * block_s)


@dataclass(frozen=True, kw_only=True, eq=False)
class Contrasts:
    """Weighted sums of n phases that separate a random walk of the phase from noise.

    Each row of `weights` [n - 2, n] gives one sum, a contrast. The rows are orthonormal; the contrasts vanish if the
    phases lie on a line, and are uncorrelated both for a random walk and for noise. `slope` [n] are the weights that
    give the phases' slope, `slope_variance` its variance for noise of variance 1. For a random walk that gives the
    slope this variance, `share` are the contrasts' variances, `with_slope` their covariances with the slope.
    """

    weights: FloatArray
    share: FloatArray
    with_slope: FloatArray
    slope: FloatArray
    slope_variance: float

    @functools.cached_property
    def by_noise(self) -> FloatArray:
        """Share of noise in each contrast's variance, 1 + r `share`, for each r of `WALK_RATIOS`, [ratios, n - 2]."""
        return np.asarray(1 / (1 + WALK_RATIOS[:, None] * self.share))

    @functools.cached_property
    def log_by_noise(self) -> FloatArray:
        """Sum over the contrasts of the logarithm of `by_noise`, [ratios]."""
        return np.asarray(np.log(self.by_noise).sum(axis=1))


def weigh_walk_ratios(squares: FloatArray, contrasts: Contrasts) -> tuple[FloatArray, float]:
    """Weights of `WALK_RATIOS` and log evidence, from the `squares` [n - 2] of contrasts in units of their noise."""
    likelihood = 0.5 * (contrasts.log_by_noise - contrasts.by_noise @ squares)
    weight = WALK_RATIO_PRIOR * np.exp(likelihood - likelihood.max())
    total = float(weight.sum())
    return weight / total, math.log(total / float(WALK_RATIO_PRIOR.sum())) + float(likelihood.max())


@functools.cache
def contrasts_of(count: int) -> Contrasts:
    """Weighted sums that separate a random walk from noise in a line's mean phases in `count` parts of a record."""
    index = np.arange(count)
    walk = np.minimum.outer(index, index) + 0.5 - np.eye(count) / 6
    middle = index - (count - 1) / 2
    slope = middle / (middle @ middle)
    noise_variance, walk_variance = float(slope @ slope), float(slope @ walk @ slope)
    per_ratio = noise_variance / walk_variance
    free = np.linalg.svd(np.vstack((np.ones(count), middle)))[2][2:].T  # all that has no mean and no slope
    share, rotation = np.linalg.eigh(free.T @ walk @ free)
    weights = (free @ rotation).T
    return Contrasts(
        weights=weights,
        share=np.maximum(share, 0) * per_ratio,
        with_slope=weights @ walk @ slope * per_ratio,
        slope=slope,
        slope_variance=noise_variance,
    )


def _track(sums: ComplexArray, number: FloatArray, path_rad: FloatArray) -> tuple[float, float, float]:
    """Refine the phases `path_rad`; returns log evidence of a line, mean step per block, its 95 % half width [rad]."""
    blocks = sums.shape[1]
    contrasts = contrasts_of(blocks)
    for _ in range(4):
        amplitude = _amplitudes(sums, number, path_rad)
        phase, variance = _refined(sums, number, path_rad, amplitude)
        residual = contrasts.weights @ phase
        excess, weight, log_likelihood = _excess_noise(residual, variance, contrasts)
        by_noise = weight @ contrasts.by_noise * residual  # each residual's share of noise
        path_rad = phase - contrasts.weights.T @ by_noise
    aligned = np.conj(amplitude)[:, None] * sums * np.exp(-1j * np.outer(number, phase))
    log_evidence = float(2 * aligned.real.sum() - blocks * np.sum(np.abs(amplitude) ** 2)) + log_likelihood
    log_spread = float(weight @ np.log1p(WALK_RATIOS))
    # A walk adds a share of each residual to the slope. Without a walk the frequency of highest power needs no
    # correction, and is better for weak lines.
    carried = (weight * WALK_RATIOS) @ contrasts.by_noise * contrasts.with_slope
    slope = float(contrasts.slope @ phase - carried @ residual) * walk_share(log_spread)
    strongest = max(float(np.max(np.mean(np.abs(sums) ** 2, axis=1) - 1)) * blocks, 1.0)
    error = math.sqrt(excess * variance * contrasts.slope_variance)
    return log_evidence, slope, error * half_width(log_spread, blocks, strongest)


def _excess_noise(residual: FloatArray, variance: float, contrasts: Contrasts) -> tuple[float, FloatArray, float]:
    """Noise at a line over noise nearby; posterior weights of `WALK_RATIOS` (ratios of slip to noise); log evidence."""
    tried = []
    for excess in EXCESSES:
        weight, log_likelihood = weigh_walk_ratios(residual**2 / (excess * variance), contrasts)
        tried.append((excess, weight, log_likelihood - residual.size * math.log(excess) / 2))
    best = max(tried, key=lambda one: one[2])
    return best if best[2] - tried[0][2] > EXCESS_MARGIN else tried[0]


def _viterbi_path(sums: ComplexArray, number: FloatArray, step_rad2: float) -> FloatArray:
    """Most likely phase of a line in each block [rad], [blocks], for steps between blocks of variance `step_rad2`."""
    grid = np.arange(PHASES) * (2 * math.pi / PHASES)
    rotation = np.exp(-1j * np.outer(number, grid))
    step = np.abs(grid[:, None] - grid)
    cost = np.minimum(step, 2 * math.pi - step) ** 2 / (2 * step_rad2)
    power = np.maximum(np.mean(np.abs(sums) ** 2, axis=1) - 1, 0)
    amplitude = np.where(np.arange(number.size) == np.argmax(power / number), np.sqrt(power), 0).astype(complex)
    path: FloatArray = np.zeros(sums.shape[1])
    for _ in range(4):
        likelihood = 2 * ((np.conj(amplitude)[:, None] * sums).T @ rotation).real  # less the cost of the path's steps
        for block in range(1, sums.shape[1]):
            likelihood[block] += np.max(likelihood[block - 1] - cost, axis=1)  # of the best path to each phase
        best = [int(np.argmax(likelihood[-1]))]
        for reached in likelihood[-2::-1]:
            best.append(int(np.argmax(reached - cost[best[-1]])))
        before, path = path, np.asarray(grid[best[::-1]], dtype=np.float64)
        if np.array_equal(path, before):  # no further pass would change it
            break
        amplitude = _amplitudes(sums, number, path)
    return np.unwrap(path)


def _refined(
    sums: ComplexArray, number: FloatArray, path_rad: FloatArray, amplitude: ComplexArray
) -> tuple[FloatArray, float]:
    """Phase of a line in each block [rad], to first order about `path_rad`, and its variance by noise [rad2]."""
    rotation = np.exp(-1j * np.outer(number, path_rad))
    parts = number**2 * np.abs(amplitude) ** 2
    least = float(np.min(number**2)) / sums.shape[1]  # the value of noise alone
    used = max(float(parts.sum()), least)
    # Harmonics of noise alone are clipped if negative, but not if positive.
    raw = number**2 * (np.abs(np.mean(sums * rotation, axis=1)) ** 2)
    information = max(float(np.sum(raw - number**2 / sums.shape[1])), float(parts.max()), used / 10, least)
    aligned = np.conj(amplitude)[:, None] * sums * rotation
    return path_rad + (number @ aligned.imag) / used, 1 / (2 * information)


def _amplitudes(sums: ComplexArray, number: FloatArray, path_rad: FloatArray) -> ComplexArray:
    """Complex amplitudes of the harmonics if their phases are `path_rad`; the mean power of noise is subtracted."""
    mean = np.mean(sums * np.exp(-1j * np.outer(number, path_rad)), axis=1)
    power = np.abs(mean) ** 2
    share = np.maximum(power - 1 / sums.shape[1], 0) / np.maximum(power, np.finfo(float).tiny)
    return np.asarray(mean * np.sqrt(share), dtype=np.complex128)
