"""A slipping line's mean frequency from the course of its phase, and the interval that noise and slip leave it.

Slip that comes at random makes the phase of a line a random walk; noise adds an independent error to each block's
phase. Frequency is the slope of that phase. Its variance under noise alone is known; the walk adds `ratio` times
that, and the ratio has to be told from the phase's residuals about a straight line. Their modes carry little of it (a
quarter, an eighth, a sixteenth, ... of what the slope carries), so that a slip as large as the noise cannot be told
from none by any means. The half width is therefore a tabulated multiple of the spread the residuals suggest, made
so that the interval covers 95 % as nearly as can be for every ratio; see `interval`.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from srbval.signal.cramer_rao import frequency_error_hz
from srbval.signal.interval import NORMAL_95, half_width, walk_share, weak_factor
from srbval.signal.phase_course import PhaseCourse, read_about, track
from srbval.signal.phase_posterior import posterior
from srbval.signal.phasors import Phasors

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# Numbers of blocks the record is cut into; the largest is taken that noise and sidebands allow.
BLOCK_NUMBERS = (96, 48, 32, 24, 16, 12, 8, 6, 5)
# What all harmonics tell of the phase, sum h^2 rho, below which all courses are weighed at once (`phase_posterior`); of
# a line whose best harmonic is weaker than that over the noise nothing is told.
WEAK_INFORMATION, LEAST_SNR = 1000.0, 8.0
WEAK_BLOCKS = 32
# Power over noise that the best harmonic needs in a block, so that the course of phase does not get lost.
BLOCK_SNR = 1.0
# Largest jitter of the spacing of impacts that is followed, as a share of it.
LARGEST_JITTER = 0.015
# Ratios of walk to noise, in the variance of the slope, that are weighed against one another, and their weights.
RATIOS = np.geomspace(0.05, 1e10, 93)
WEIGHTS = (1 + RATIOS) ** -0.5
# Steps that tracks are begun with, as shares of the largest jitter's.
STEP_SHARES = (1.0, 0.03)
# Noise at the line over that told of its neighbourhood; anything but the first must be likelier by this, in logarithms.
EXCESSES, CLEARLY = (1.0, 1.6, 2.5, 4.0, 6.3), 8.0
# How far the evidence, which is approximate, is trusted: as a power of the odds.
TEMPER = 0.5
# A track, which had the choice of all courses, must be likelier than the straight line by this much, in logarithms.
STRAIGHT = 8.0
# The least share of a line's power that noise in a bin is taken to have.
NOISELESS = 1e-12
_ROUNDS = 4


@dataclass(frozen=True, kw_only=True)
class Course:
    """The mean frequency lies `shift_hz` from the one turned back at, within the 95 % half width `ci95_hz`.

    `walk_rad2_s` is the likely random walk of the fundamental's phase.
    """

    shift_hz: float
    ci95_hz: float
    walk_rad2_s: float


def follow(
    phasors: Phasors, number: FloatArray, noise_power: FloatArray, *, line_hz: float, shortest_block_s: float = 0.0
) -> Course | None:
    """Mean frequency of a line that may slip, from its phase block by block; None if too weak to be followed.

    Component c of `phasors` moves with `number[c]` times the line's fundamental `line_hz`; `noise_power[c]` is its
    mean noise power in a bin of the whole record. Blocks shorter than `shortest_block_s` would mix the line with its
    sidebands. A steady drift of the speed is taken for wander.
    """
    # A line without any noise would leave nothing to weigh a walk against.
    noise_power = np.maximum(noise_power, NOISELESS * float(np.max(phasors.power())))
    if float(np.max(phasors.power() / noise_power)) < LEAST_SNR:
        return None
    allowed = _allowed(phasors, shortest_block_s)
    weak = weak_sums(phasors, number, noise_power, shortest_block_s=shortest_block_s)
    if weak is not None:
        return _weak(weak, number, line_hz, phasors.seconds / weak.shape[1])
    for blocks in allowed:
        sums = phasors.in_blocks(blocks) * np.sqrt(blocks / noise_power)[:, None]
        snr = np.mean(np.abs(sums) ** 2, axis=1) - 1
        if float(snr.max()) < BLOCK_SNR:
            continue
        block_s = phasors.seconds / blocks
        walk = (2 * math.pi * LARGEST_JITTER) ** 2 * line_hz * block_s
        return _course(sums, number, walk, block_s)
    return None


def weak_sums(
    phasors: Phasors, number: FloatArray, noise_power: FloatArray, *, shortest_block_s: float = 0.0
) -> ComplexArray | None:
    """Sums [c, blocks] in units of their noise of a line too weak for its phase to be read; None for a strong one."""
    for blocks in _allowed(phasors, shortest_block_s):
        if blocks <= WEAK_BLOCKS:
            sums = phasors.in_blocks(blocks) * np.sqrt(blocks / noise_power)[:, None]
            snr = np.mean(np.abs(sums) ** 2, axis=1) - 1
            return sums if float(number**2 @ np.maximum(snr, 0)) * blocks < WEAK_INFORMATION else None
    return None


def _allowed(phasors: Phasors, shortest_block_s: float) -> list[int]:
    """Numbers of blocks the record may be cut into, the largest first."""
    return [n for n in BLOCK_NUMBERS if phasors.seconds >= n * shortest_block_s and n <= phasors.sums.shape[1]]


def noise_error_hz(sums: ComplexArray, number: FloatArray, block_s: float) -> float:
    """Standard error of a steady line from noise alone [Hz]."""
    blocks = sums.shape[1]
    snr = np.abs(sums.sum(axis=1)) ** 2 / blocks - 1
    return frequency_error_hz(max(float(number**2 @ np.maximum(snr, 0)), 1.0), blocks * block_s)


def _weak(sums: ComplexArray, number: FloatArray, line_hz: float, block_s: float) -> Course:
    found = posterior(sums, number, line_hz=line_hz, block_s=block_s)
    wide = found.credible_hz / (NORMAL_95 * noise_error_hz(sums, number, block_s))
    return Course(
        shift_hz=found.shift_hz, ci95_hz=weak_factor(found.steady, wide) * found.credible_hz,
        walk_rad2_s=(2 * math.pi * found.jitter) ** 2 * line_hz,
    )  # fmt: skip


def _course(sums: ComplexArray, number: FloatArray, step_rad2: float, block_s: float) -> Course:
    """Courses begun from a straight line and from tracks of larger and smaller steps, by what speaks for each.

    Where several agree with the record about as well, what they differ by widens the interval.
    """
    modes = modes_of(sums.shape[1])
    starts = [np.zeros(sums.shape[1]), *(track(sums, number, step_rad2 * share) for share in STEP_SHARES)]
    settled = [_settled(sums, number, start, modes) for start in starts]
    strongest = max(float(np.max(np.mean(np.abs(sums) ** 2, axis=1) - 1)) * sums.shape[1], 1.0)
    evidence = np.array([s.evidence for s in settled])
    evidence[0] += STRAIGHT
    chance = np.exp(TEMPER * (evidence - evidence.max()))
    if chance[0] == 1:
        chance = np.eye(1, chance.size)[0]
    chance /= chance.sum()
    slope, half, walk = (np.array(column) for column in zip(*(s.slope(modes, strongest) for s in settled), strict=True))
    mean = float(chance @ slope)
    spread = float(chance @ (half**2 + (NORMAL_95 * (slope - mean)) ** 2))
    turn = 2 * math.pi * block_s
    return Course(
        shift_hz=mean / turn, ci95_hz=math.sqrt(spread) / turn, walk_rad2_s=float(chance @ walk) / block_s
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class _Settled:
    """Phases read about a course that agrees with them; `evidence` is the log of what speaks for that course."""

    read: PhaseCourse
    residual: FloatArray
    weight: FloatArray
    evidence: float

    def slope(self, modes: Modes, snr: float) -> tuple[float, float, float]:
        """Phase a block, its 95 % half width [rad], and the variance of the walk's step [rad2]."""
        weight, noise = self.weight, self.read.variance_rad2
        log_spread = float(weight @ np.log1p(RATIOS))
        # The place of most power needs no correction while no walk shows, and is then the better one for weak lines.
        mean = float(modes.slope @ self.read.phase_rad - modes.carried(weight) @ self.residual) * walk_share(log_spread)
        half = math.sqrt(noise * modes.slope_variance) * half_width(log_spread, len(modes.slope), snr)
        return mean, half, float(weight @ RATIOS) * noise * modes.walk_over_noise


def _settled(sums: ComplexArray, number: FloatArray, about: FloatArray, modes: Modes) -> _Settled:
    for _ in range(_ROUNDS):
        read = read_about(sums, number, about)
        residual = modes.contrasts @ read.phase_rad
        read, weight, likelihood = _with_excess(read, residual, modes)
        about = read.phase_rad - modes.contrasts.T @ (modes.noise_share(weight) * residual)
    return _Settled(read=read, residual=residual, weight=weight, evidence=read.agreement(sums, number) + likelihood)


def _with_excess(read: PhaseCourse, residual: FloatArray, modes: Modes) -> tuple[PhaseCourse, FloatArray, float]:
    """The phases' variance as the residuals have it, where they clearly exceed what the line's neighbourhood tells.

    Noise may be higher at a line than beside it, where skirts and sidebands leak into the blocks. It scatters phases
    without memory, and must not be taken for a walk.
    """
    tried = []
    for excess in EXCESSES:
        weight, likelihood = modes.weigh(residual / math.sqrt(excess * read.variance_rad2))
        tried.append((likelihood - residual.size * math.log(excess) / 2, excess, weight))
    told, best = tried[0], max(tried, key=lambda one: one[0])
    likelihood, excess, weight = best if best[0] - told[0] > CLEARLY else told
    return replace(read, variance_rad2=excess * read.variance_rad2), weight, likelihood


@dataclass(frozen=True, kw_only=True, eq=False)
class Modes:
    """The residuals of n phases about a straight line, parted so that walk and noise are independent in each.

    `contrasts` [n - 2, n] are orthonormal, so noise is white in them; the walk whose part in the slope's variance is
    once the noise's has variance `share` [n - 2] there, and covariance `with_slope` with the `slope` [n]. The
    noise's part is `slope_variance`; that walk takes `walk_over_noise` noise variances a step.
    """

    contrasts: FloatArray
    share: FloatArray
    with_slope: FloatArray
    slope: FloatArray
    slope_variance: float
    walk_over_noise: float

    def weigh(self, modes: FloatArray) -> tuple[FloatArray, float]:
        """Weight of each of `RATIOS` after the residuals, [n - 2] in units of the noise, were seen; log of the sum."""
        return weigh(modes, self.share)

    def noise_share(self, weight: FloatArray) -> FloatArray:
        """What part of each residual is noise, [n - 2]."""
        return np.asarray(weight @ (1 / (1 + RATIOS[:, None] * self.share)), dtype=np.float64)

    def carried(self, weight: FloatArray) -> FloatArray:
        """What of each residual the walk carries into the slope, [n - 2]."""
        ratios = RATIOS[:, None]
        return np.asarray(weight @ (ratios * self.with_slope / (1 + ratios * self.share)), dtype=np.float64)


def weigh(modes: FloatArray, share: FloatArray) -> tuple[FloatArray, float]:
    """Weight of each of `RATIOS` after `modes` of variance 1 + ratio `share` were seen; log of the weights' sum."""
    spread = 1 + RATIOS[:, None] * share
    likelihood = -0.5 * (np.log(spread).sum(axis=1) + (modes**2 / spread).sum(axis=1))
    weight = WEIGHTS * np.exp(likelihood - likelihood.max())
    total = float(weight.sum())
    return weight / total, math.log(total / float(WEIGHTS.sum())) + float(likelihood.max())


@functools.cache
def modes_of(count: int) -> Modes:
    """The modes of `count` blocks, over each of which the walk is averaged."""
    index = np.arange(count)
    walk = np.minimum.outer(index, index) + 0.5 - np.eye(count) / 6
    middle = index - (count - 1) / 2
    slope = middle / (middle @ middle)
    noise_variance, walk_variance = float(slope @ slope), float(slope @ walk @ slope)
    per_ratio = noise_variance / walk_variance
    free = scipy.linalg.null_space(np.vstack((np.ones(count), middle)))
    share, turn = np.linalg.eigh(free.T @ walk @ free)
    contrasts = (free @ turn).T
    return Modes(
        contrasts=contrasts, share=np.maximum(share, 0) * per_ratio,
        with_slope=contrasts @ walk @ slope * per_ratio, slope=slope,
        slope_variance=noise_variance, walk_over_noise=per_ratio,
    )  # fmt: skip
