"""How far random slip may have carried a line from its mean rate."""

from __future__ import annotations

import math

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# Blocks the record is cut into, at most and at least.
MOST_BLOCKS, LEAST_BLOCKS = 32, 5
# Power over noise a block needs for its phase to be known well within half a turn.
BLOCK_SNR = 4.0
# A harmonic whose phase moves more than this from block to block [rad, rms] may have slipped a turn.
_LARGEST_STEP_RAD = 1.0
# Ratios of wander to phase noise per block that are weighed against each other.
_RATIOS = np.logspace(-5, 5, 101)


def wander_sigma_hz(
    samples: FloatArray, fs_hz: float, line_hz: float, snr: FloatArray, *, shortest_block_s: float = 0.0
) -> float:
    """Standard error of a line's mean frequency due to its own phase wander [Hz]; 0 where it cannot be told.

    Random slip makes the line's phase a random walk of q rad^2/s; a straight line through it has a slope
    of variance 6 q / (5 T). The harmonics of `line_hz` (`snr`: each one's power over mean noise power per
    bin) are demodulated in blocks and their phase steps joined, weighed by h snr. The steps' covariance
    is that of a walk plus independent phase noise per block; q is averaged over all ratios of the two by
    their restricted likelihood. Blocks shorter than `shortest_block_s` would mix the line with its sidebands.
    Not valid where the strongest harmonic turns more than half a turn a block; a steady drift of the
    speed is no wander and is not seen.
    """
    seconds = samples.size / fs_hz
    longest = seconds / shortest_block_s if shortest_block_s > 0 else MOST_BLOCKS
    blocks = int(min(MOST_BLOCKS, snr.max() / BLOCK_SNR, longest))
    if blocks < LEAST_BLOCKS:
        return 0.0
    steps = _joint_steps(samples, fs_hz, line_hz, snr, blocks)
    walk_rad2_s = _walk_variance(steps) * blocks / seconds
    return math.sqrt(1.2 * walk_rad2_s / seconds) / (2 * math.pi)


def _joint_steps(samples: FloatArray, fs_hz: float, line_hz: float, snr: FloatArray, blocks: int) -> FloatArray:
    """Steps of the fundamental's phase between blocks [rad], from all harmonics that show it clearly."""
    strongest = int(np.argmax(snr))
    total, weight = np.zeros(blocks - 1), 0.0
    for index in range(snr.size):
        if snr[index] < BLOCK_SNR * blocks:
            continue
        number = index + 1
        steps = _phase_steps(samples, fs_hz, number * line_hz, blocks)
        if index == strongest or float(np.sqrt(np.mean(steps**2))) < _LARGEST_STEP_RAD:
            total += number * snr[index] * steps
            weight += number**2 * snr[index]
    return total / weight


def _phase_steps(samples: FloatArray, fs_hz: float, line_hz: float, blocks: int) -> FloatArray:
    length = samples.size // blocks
    used = samples[: length * blocks]
    turned = used * np.exp(-2j * np.pi * line_hz * np.arange(used.size) / fs_hz)
    phasors = turned.reshape(blocks, length).sum(axis=1)
    return np.angle(phasors[1:] * np.conj(phasors[:-1]))


def _walk_variance(steps: FloatArray) -> float:
    """Variance of the walk over one block [rad^2]: mean over the likelihood of walk and phase noise.

    Steps of a walk averaged over blocks have variance 2/3 and neighbour covariance 1/6 of the walk's; steps
    of independent noise 2 and -1. A constant step (an error of the line's frequency) is projected out.
    """
    count = steps.size
    neighbours = np.eye(count, k=1) + np.eye(count, k=-1)
    contrasts = scipy.linalg.null_space(np.ones((1, count))).T
    walk = contrasts @ (np.eye(count) * 2 / 3 + neighbours / 6) @ contrasts.T
    noise = contrasts @ (np.eye(count) * 2 - neighbours) @ contrasts.T
    ratio_of_mode, modes = scipy.linalg.eigh(walk, noise)
    power = (modes.T @ (contrasts @ steps)) ** 2
    spread = 1 + _RATIOS[:, None] * ratio_of_mode
    scale = (power / spread).sum(axis=1)
    likelihood = -0.5 * np.log(spread).sum(axis=1) - 0.5 * power.size * np.log(np.maximum(scale, 1e-300))
    weight = np.exp(likelihood - likelihood.max())
    return float(weight @ (_RATIOS * scale) / weight.sum() / (power.size - 2))
