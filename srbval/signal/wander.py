"""A line's mean frequency from the course of its phase, and how far slip may have carried it."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.special
from numpy.typing import NDArray

from srbval.signal.phasors import Phasors

FloatArray = NDArray[np.float64]

# Numbers of blocks the record is cut into; the largest is taken that noise and sidebands allow.
BLOCK_NUMBERS = (32, 24, 16, 12, 8, 6, 4)
# Power over noise, summed over components, that a block needs for its phase to be known well within half a turn.
BLOCK_SNR = 8.0
# Points per half turn in the search for a phase step.
_GRID = 8
# A line that walks more than a radian over the record has no single top: its place scatters this much more, in
# variance, than a straight line through the phase would (simulated).
_PEAK_EXCESS, _PEAK_FROM_RAD2 = 1.2, 3.0
# A step this many standard deviations out was told a turn wrong.
_OUTLYING = 4.5
# Median of a normal variable's modulus, in standard deviations; and the least spread that steps are taken to have.
_MEDIAN_OF_NORMAL, _LEAST_STEP_RAD = 0.6745, 0.1
# The phase noise that the spectrum's noise predicts counts as this many observed steps.
_PRIOR_STEPS = 16.0
# Slip that is weighed against none: shares of wander to noise in the variance of the slope, in equal ratios, with
# `_SLIP_WEIGHT` a natural logarithm of it against 1 for no slip. Slip whose share is about one cannot be told from none
# by any means; the interval is then wider than noise alone would ask for.
_SHARES = np.concatenate(([0.0], np.geomspace(0.3, 1e5, 41)))
_SLIP_WEIGHT = 0.3
_PRIOR = np.concatenate(([1.0], np.full(_SHARES.size - 1, _SLIP_WEIGHT * math.log(_SHARES[2] / _SHARES[1]))))


@dataclass(frozen=True, kw_only=True)
class Course:
    """How well the phase's course lets the mean frequency be known: 95 % half width `ci95_hz`.

    `walk_rad2_s` is the phase's random walk, the mean over what the steps leave possible.
    """

    ci95_hz: float
    walk_rad2_s: float


def follow(
    phasors: Phasors, number: FloatArray, noise_power: FloatArray, *, shortest_block_s: float = 0.0
) -> Course | None:
    """Interval of the mean frequency of a line that may slip, from its phase block by block; None if too weak.

    Component c of `phasors` is harmonic `number[c]` of the line; `noise_power[c]` is its mean noise power in a bin
    of the whole record. Random slip makes the line's phase a random walk, the noise adds an independent error to
    each block's phase. All ratios of the two are weighed by their restricted likelihood, and so is the Student
    interval of a straight line's slope; where no slip at all is likelier than any, it alone counts.
    Blocks shorter than `shortest_block_s` would mix the line with its sidebands. A steady drift of the speed is
    taken for wander.
    """
    for blocks in BLOCK_NUMBERS:
        if phasors.seconds < blocks * shortest_block_s or blocks > phasors.sums.shape[1]:
            continue
        sums = phasors.in_blocks(blocks) * np.sqrt(blocks / noise_power)[:, None]
        snr = np.maximum(np.mean(np.abs(sums) ** 2, axis=1) - 1, 0)
        if float(snr.sum()) >= BLOCK_SNR:
            # What is mostly noise in a block only leads the phase astray.
            shown = snr >= min(1.0, float(snr.max()))
            sums, snr, order = sums[shown], snr[shown], number[shown]
            steps = _joint_steps(sums * np.sqrt(snr / (snr + 0.5))[:, None], order)
            if _one_turn_wrong(steps) and blocks > BLOCK_NUMBERS[-1]:
                continue
            # The last term is what a phase read from little more than noise is worse than Cramer and Rao's.
            information = float(np.sum(order**2 * snr**2 / (snr + 0.5)))
            return _course(steps, 1 / (2 * information), phasors.seconds / blocks)
    return None


def _joint_steps(sums: NDArray[np.complex128], number: FloatArray) -> FloatArray:
    """Steps of the fundamental's phase from block to block [rad] that all components, [c, blocks], agree on best.

    `sums` are in units of their noise. The sum over components of ``Re(turn exp(-i h d))`` is highest over d; half
    a turn of the lowest component is as far as a step can be told.
    """
    turns = (sums[:, 1:] * np.conj(sums[:, :-1])).T
    grid = np.linspace(-1, 1, 2 * _GRID * round(number.max() / number.min()) + 1) * math.pi / number.min()
    agreement = (turns @ np.exp(-1j * np.outer(number, grid))).real
    # Which turn a step belongs to is weighed by how far steps go: at first within a radian, then as they are seen to.
    steps = grid[np.argmax(agreement - grid**2 / 2, axis=1)]
    seen = max(float(np.median(np.abs(steps))) / _MEDIAN_OF_NORMAL, _LEAST_STEP_RAD)
    steps = grid[np.argmax(agreement - grid**2 / (2 * seen**2), axis=1)]
    for _ in range(3):
        turned = turns * np.exp(-1j * np.outer(steps, number))
        slope, curvature = turned.imag @ number, turned.real @ number**2
        steps = steps + np.where(curvature > 0, slope / np.maximum(curvature, 1e-300), 0.0)
    return steps


def _one_turn_wrong(steps: FloatArray) -> bool:
    """Whether a step stands so far out that it was most likely told a turn wrong; fewer blocks are then surer."""
    spread = max(float(np.median(np.abs(steps))) / _MEDIAN_OF_NORMAL, _LEAST_STEP_RAD / 2)
    return bool(np.max(np.abs(steps)) > _OUTLYING * spread)


def _posterior(modes: _Modes, steps: FloatArray, noise_variance: float) -> tuple[FloatArray, FloatArray]:
    """Weight of each ratio of walk to noise, and the noise variance that goes with it."""
    power = (modes.contrasts @ steps) ** 2
    spread = 1 + modes.ratios[:, None] * modes.ratio_of_mode
    freedom = _PRIOR_STEPS + power.size
    scale = (_PRIOR_STEPS * noise_variance + (power / spread).sum(axis=1)) / freedom
    likelihood = -0.5 * np.log(spread).sum(axis=1) - 0.5 * freedom * np.log(scale)
    weight = _PRIOR * np.exp(likelihood - likelihood.max())
    return weight / weight.sum(), scale


def _course(steps: FloatArray, noise_variance: float, block_s: float) -> Course:
    modes = _modes(steps.size)
    weight, scale = _posterior(modes, steps, noise_variance)
    if weight[0] > 0.5:
        weight = np.eye(1, weight.size)[0]
    turn = 2 * math.pi * block_s
    half = _half_width(weight, np.sqrt(scale * modes.variance), _PRIOR_STEPS + steps.size - 1) / turn
    walk_rad2_s = float(weight @ (modes.ratios * scale)) / block_s
    walked = walk_rad2_s * block_s * (steps.size + 1)
    return Course(
        ci95_hz=half * math.sqrt(1 + _PEAK_EXCESS * walked / (_PEAK_FROM_RAD2 + walked)), walk_rad2_s=walk_rad2_s
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Modes:
    """Covariances of phase steps for every ratio of walk to noise, worked out once a number of steps.

    `contrasts` [n - 1, n] whiten the noise and part the modes; `slope` [n] gives the mean step, of `variance` [ratios]
    in units of the noise's, `wander_share` of it the walk's; `smoothing` [ratios, n, n] takes the noise away.
    """

    ratios: FloatArray
    contrasts: FloatArray
    ratio_of_mode: FloatArray
    variance: FloatArray


@functools.cache
def _modes(count: int) -> _Modes:
    """Steps of a walk averaged over blocks have variance 2/3 and neighbour covariance 1/6 of the walk's; steps of
    independent noise 2 and -1. A constant step (the frequency) is projected out of the contrasts.

    The straight line's weights on the steps are `slope`.
    """
    neighbours = np.eye(count, k=1) + np.eye(count, k=-1)
    walk = np.eye(count) * 2 / 3 + neighbours / 6
    noise = np.eye(count) * 2 - neighbours
    contrasts = scipy.linalg.null_space(np.ones((1, count))).T
    ratio_of_mode, modes = scipy.linalg.eigh(contrasts @ walk @ contrasts.T, contrasts @ noise @ contrasts.T)
    middle = np.arange(count + 1) - count / 2
    slope = -np.cumsum(middle)[:-1] / (middle @ middle)
    ratios = _SHARES * (slope @ noise @ slope) / (slope @ walk @ slope)
    variance = slope @ noise @ slope * (1 + _SHARES)
    return _Modes(ratios=ratios, contrasts=modes.T @ contrasts, ratio_of_mode=ratio_of_mode, variance=variance)


def _half_width(weight: FloatArray, sigma: FloatArray, freedom: float) -> float:
    """Half width that holds 95 % of a mixture of Student distributions, found by halving."""
    low, high = 0.0, float(np.max(20 * sigma))
    for _ in range(40):
        half = (low + high) / 2
        outside = 2 * float(weight @ scipy.special.stdtr(freedom, -half / sigma))
        low, high = (half, high) if outside > 0.05 else (low, half)
    return high
