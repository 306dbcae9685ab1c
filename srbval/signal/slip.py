"""Mean frequency of a slipping line from its phase over the record, and its interval from noise and slip.

Random slip makes the phase of a line a random walk; noise adds an independent error to each block's phase. The
frequency is the slope of that phase. Its variance under noise alone is known; the walk adds `ratio` times that, and
the ratio has to be estimated from the phase's residuals about a straight line. Their modes carry little of it (a
quarter, an eighth, a sixteenth, ... of what the slope carries), so that slip as large as the noise cannot be
distinguished from none by any method. The half width is therefore a tabulated multiple of the spread that the
residuals suggest, chosen so that the interval covers as close to 95 % as possible for every ratio; see `interval`.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from srbval.arrays import ComplexArray, FloatArray
from srbval.signal.interval import NORMAL_95, frequency_error_hz, half_width, walk_share, weak_factor
from srbval.signal.phase_posterior import posterior
from srbval.signal.phase_track import PhaseTrack, refine, viterbi_path
from srbval.signal.phasors import Phasors

# Numbers of blocks that the record may be cut into; the largest that noise and sidebands allow is used.
BLOCK_NUMBERS = (96, 48, 32, 24, 16, 12, 8, 6, 5)
# Information of all harmonics about the phase, sum h^2 rho, below which all paths are weighted at once
# (`phase_posterior`), and the power over noise of the strongest harmonic below which slip is not estimated.
WEAK_INFORMATION, LEAST_SNR = 1000.0, 8.0
WEAK_BLOCKS = 32
# Power over noise that the strongest harmonic needs in a block for its phase to be tracked.
BLOCK_SNR = 1.0
# Largest jitter of the spacing of impacts that is tracked, relative to it.
LARGEST_JITTER = 0.035
# Ratios of walk to noise, in the variance of the slope, and their prior weights.
RATIOS = np.geomspace(0.05, 1e10, 93)
WEIGHTS = (1 + RATIOS) ** -0.5
# Variances of the steps that tracks are started with, relative to that of the largest jitter.
STEP_SHARES = (1.0, 0.03)
# Noise at the line over that of its neighbourhood; any but the first must be likelier by this log likelihood.
EXCESSES, EXCESS_MARGIN = (1.0, 1.6, 2.5, 4.0, 6.3), 8.0
# Exponent of the odds, because the log evidence is approximate.
TEMPER = 0.5
# A track, which was chosen among all paths, must be likelier than the straight line by this log likelihood.
STRAIGHT_MARGIN = 8.0
# Least noise power in a bin, relative to the line's power.
LEAST_NOISE = 1e-12
_ROUNDS = 4


@dataclass(frozen=True, kw_only=True)
class SlipEstimate:
    """The mean frequency lies `shift_hz` from that of the demodulation, with 95 % half width `ci95_hz`.

    `walk_rad2_s` is the estimated random walk of the fundamental's phase [rad2/s].
    """

    shift_hz: float
    ci95_hz: float
    walk_rad2_s: float


def track_slip(
    phasors: Phasors, number: FloatArray, noise_power: FloatArray, *, line_hz: float, shortest_block_s: float = 0.0
) -> SlipEstimate | None:
    """Mean frequency of a line that may slip, from its phase block by block; None if it is too weak.

    Component c of `phasors` moves with `number[c]` times the line's fundamental `line_hz`; `noise_power[c]` is its
    mean noise power in a bin of the whole record. Blocks shorter than `shortest_block_s` would mix the line with its
    sidebands. A steady drift of the speed is taken as slip.
    """
    # Without any noise there is nothing to compare a random walk with.
    noise_power = np.maximum(noise_power, LEAST_NOISE * float(np.max(phasors.power())))
    if float(np.max(phasors.power() / noise_power)) < LEAST_SNR:
        return None
    allowed = _block_numbers(phasors, shortest_block_s)
    weak = weak_sums(phasors, number, noise_power, shortest_block_s=shortest_block_s)
    if weak is not None:
        return _weak_estimate(weak, number, line_hz, phasors.seconds / weak.shape[1])
    for blocks in allowed:
        sums = phasors.in_blocks(blocks) * np.sqrt(blocks / noise_power)[:, None]
        snr = np.mean(np.abs(sums) ** 2, axis=1) - 1
        if float(snr.max()) < BLOCK_SNR:
            continue
        block_s = phasors.seconds / blocks
        walk = (2 * math.pi * LARGEST_JITTER) ** 2 * line_hz * block_s
        return _strong_estimate(sums, number, walk, block_s)
    return None


def weak_sums(
    phasors: Phasors, number: FloatArray, noise_power: FloatArray, *, shortest_block_s: float = 0.0
) -> ComplexArray | None:
    """Sums [c, blocks], in units of their noise, of a line too weak for its phase to be tracked; None if strong."""
    for blocks in _block_numbers(phasors, shortest_block_s):
        if blocks <= WEAK_BLOCKS:
            sums = phasors.in_blocks(blocks) * np.sqrt(blocks / noise_power)[:, None]
            snr = np.mean(np.abs(sums) ** 2, axis=1) - 1
            return sums if float(number**2 @ np.maximum(snr, 0)) * blocks < WEAK_INFORMATION else None
    return None


def _block_numbers(phasors: Phasors, shortest_block_s: float) -> list[int]:
    """Numbers of blocks the record may be cut into, the largest first."""
    return [n for n in BLOCK_NUMBERS if phasors.seconds >= n * shortest_block_s and n <= phasors.sums.shape[1]]


def noise_error_hz(sums: ComplexArray, number: FloatArray, block_s: float) -> float:
    """Standard error of a steady line from noise alone [Hz]."""
    blocks = sums.shape[1]
    snr = np.abs(sums.sum(axis=1)) ** 2 / blocks - 1
    return frequency_error_hz(max(float(number**2 @ np.maximum(snr, 0)), 1.0), blocks * block_s)


def _weak_estimate(sums: ComplexArray, number: FloatArray, line_hz: float, block_s: float) -> SlipEstimate:
    frequency = posterior(sums, number, line_hz=line_hz, block_s=block_s)
    wide = frequency.credible_hz / (NORMAL_95 * noise_error_hz(sums, number, block_s))
    return SlipEstimate(
        shift_hz=frequency.shift_hz, ci95_hz=weak_factor(frequency.steady, wide) * frequency.credible_hz,
        walk_rad2_s=(2 * math.pi * frequency.jitter) ** 2 * line_hz,
    )  # fmt: skip


def _strong_estimate(sums: ComplexArray, number: FloatArray, step_rad2: float, block_s: float) -> SlipEstimate:
    """Mean over tracks started from a straight line and from larger and smaller steps, weighted by their evidence.

    Where several fit the record about equally well, their differences widen the interval.
    """
    modes = modes_of(sums.shape[1])
    starts = [np.zeros(sums.shape[1]), *(viterbi_path(sums, number, step_rad2 * share) for share in STEP_SHARES)]
    tracks = [_converged(sums, number, start, modes) for start in starts]
    strongest = max(float(np.max(np.mean(np.abs(sums) ** 2, axis=1) - 1)) * sums.shape[1], 1.0)
    log_evidence = np.array([t.log_evidence for t in tracks])
    log_evidence[0] += STRAIGHT_MARGIN
    weight = np.exp(TEMPER * (log_evidence - log_evidence.max()))
    if weight[0] == 1:
        weight = np.eye(1, weight.size)[0]
    weight /= weight.sum()
    slope, half, walk = (np.array(column) for column in zip(*(t.slope(modes, strongest) for t in tracks), strict=True))
    mean = float(weight @ slope)
    spread = float(weight @ (half**2 + (NORMAL_95 * (slope - mean)) ** 2))
    rad_per_hz = 2 * math.pi * block_s
    return SlipEstimate(
        shift_hz=mean / rad_per_hz, ci95_hz=math.sqrt(spread) / rad_per_hz, walk_rad2_s=float(weight @ walk) / block_s
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class _ConvergedTrack:
    """A phase track refined about itself, with its residuals, the weights of `RATIOS` and its log evidence."""

    phases: PhaseTrack
    residual: FloatArray
    weight: FloatArray
    log_evidence: float

    def slope(self, modes: Modes, snr: float) -> tuple[float, float, float]:
        """Phase per block, its 95 % half width [rad], and the variance of the walk's step [rad2]."""
        weight, noise = self.weight, self.phases.variance_rad2
        log_spread = float(weight @ np.log1p(RATIOS))
        # The frequency of highest power needs no correction while no walk shows, and is then better for weak lines.
        correction = modes.carried(weight) @ self.residual
        mean = float(modes.slope @ self.phases.phase_rad - correction) * walk_share(log_spread)
        half = math.sqrt(noise * modes.slope_variance) * half_width(log_spread, len(modes.slope), snr)
        return mean, half, float(weight @ RATIOS) * noise * modes.walk_over_noise


def _converged(sums: ComplexArray, number: FloatArray, path: FloatArray, modes: Modes) -> _ConvergedTrack:
    for _ in range(_ROUNDS):
        phases = refine(sums, number, path)
        residual = modes.contrasts @ phases.phase_rad
        phases, weight, log_likelihood = _with_excess(phases, residual, modes)
        path = phases.phase_rad - modes.contrasts.T @ (modes.noise_share(weight) * residual)
    log_evidence = phases.log_likelihood(sums, number) + log_likelihood
    return _ConvergedTrack(phases=phases, residual=residual, weight=weight, log_evidence=log_evidence)


def _with_excess(phases: PhaseTrack, residual: FloatArray, modes: Modes) -> tuple[PhaseTrack, FloatArray, float]:
    """The phases with the variance that their residuals show, where that clearly exceeds the neighbourhood's noise.

    Noise may be higher at a line than next to it, where skirts and sidebands leak into the blocks. It scatters phases
    independently, and must not be taken for a random walk.
    """
    tried = []
    for excess in EXCESSES:
        weight, log_likelihood = weigh(residual / math.sqrt(excess * phases.variance_rad2), modes.share)
        tried.append((log_likelihood - residual.size * math.log(excess) / 2, excess, weight))
    stated, best = tried[0], max(tried, key=lambda one: one[0])
    log_likelihood, excess, weight = best if best[0] - stated[0] > EXCESS_MARGIN else stated
    return replace(phases, variance_rad2=excess * phases.variance_rad2), weight, log_likelihood


@dataclass(frozen=True, kw_only=True, eq=False)
class Modes:
    """Modes of the residuals of n phases about a straight line, in which both walk and noise are uncorrelated.

    `contrasts` [n - 2, n] are orthonormal, so noise is white in them; a walk that contributes as much as the noise to
    the slope's variance has variance `share` [n - 2] there, and covariance `with_slope` with the `slope` [n]. The
    noise contributes `slope_variance`; that walk has steps of `walk_over_noise` noise variances.
    """

    contrasts: FloatArray
    share: FloatArray
    with_slope: FloatArray
    slope: FloatArray
    slope_variance: float
    walk_over_noise: float

    def noise_share(self, weight: FloatArray) -> FloatArray:
        """Share of noise in each residual, [n - 2]."""
        return np.asarray(weight @ (1 / (1 + RATIOS[:, None] * self.share)), dtype=np.float64)

    def carried(self, weight: FloatArray) -> FloatArray:
        """Share of each residual that the walk carries into the slope, [n - 2]."""
        ratios = RATIOS[:, None]
        return np.asarray(weight @ (ratios * self.with_slope / (1 + ratios * self.share)), dtype=np.float64)


def weigh(modes: FloatArray, share: FloatArray) -> tuple[FloatArray, float]:
    """Posterior weight of each of `RATIOS` given `modes` of variance 1 + ratio `share`; log of the weights' sum."""
    spread = 1 + RATIOS[:, None] * share
    likelihood = -0.5 * (np.log(spread).sum(axis=1) + (modes**2 / spread).sum(axis=1))
    weight = WEIGHTS * np.exp(likelihood - likelihood.max())
    total = float(weight.sum())
    return weight / total, math.log(total / float(WEIGHTS.sum())) + float(likelihood.max())


@functools.cache
def modes_of(count: int) -> Modes:
    """The modes of `count` blocks, with the walk averaged over each block."""
    index = np.arange(count)
    walk = np.minimum.outer(index, index) + 0.5 - np.eye(count) / 6
    middle = index - (count - 1) / 2
    slope = middle / (middle @ middle)
    noise_variance, walk_variance = float(slope @ slope), float(slope @ walk @ slope)
    per_ratio = noise_variance / walk_variance
    free = scipy.linalg.null_space(np.vstack((np.ones(count), middle)))
    share, rotation = np.linalg.eigh(free.T @ walk @ free)
    contrasts = (free @ rotation).T
    return Modes(
        contrasts=contrasts, share=np.maximum(share, 0) * per_ratio,
        with_slope=contrasts @ walk @ slope * per_ratio, slope=slope,
        slope_variance=noise_variance, walk_over_noise=per_ratio,
    )  # fmt: skip
