"""Phase of a line over a record, block by block: the most likely random walk on a grid, then refined about it.

A slipping line loses its phase over the record, and in noise the phase of a block may be wrong by a turn. The whole
path is therefore found at once by dynamic programming (Viterbi 1967, IEEE Trans. Inf. Theory 13, 260): the log
likelihood of each block's phase from all harmonics, less the cost of each step of the random walk.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import ComplexArray, FloatArray

# Phases of the fundamental tried for each block; the fifth harmonic still has 19 per turn.
GRID = 96
_PASSES = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class PhaseTrack:
    """Phase of a line's fundamental in each block [rad], [blocks], each with the same variance [rad2].

    `amplitude` [c] are the harmonic amplitudes along the track in units of a block's noise.
    """

    phase_rad: FloatArray
    variance_rad2: float
    amplitude: ComplexArray

    def log_likelihood(self, sums: ComplexArray, number: FloatArray) -> float:
        """Log likelihood of the sums [c, blocks] at these phases, less that of no line."""
        aligned = np.conj(self.amplitude)[:, None] * sums * np.exp(-1j * np.outer(number, self.phase_rad))
        return float(2 * aligned.real.sum() - sums.shape[1] * np.sum(np.abs(self.amplitude) ** 2))


def viterbi_path(sums: ComplexArray, number: FloatArray, step_rad2: float) -> FloatArray:
    """The most likely path of the fundamental's phase [rad], [blocks], started from its clearest harmonic.

    `sums` [c, blocks] are those of harmonics `number` [c], in units of their noise; steps from block to block have
    variance `step_rad2` at most.
    """
    grid = np.arange(GRID) * (2 * math.pi / GRID)
    rotation = np.exp(-1j * np.outer(number, grid))
    step = np.abs(grid[:, None] - grid)
    cost = np.minimum(step, 2 * math.pi - step) ** 2 / (2 * step_rad2)
    power = np.maximum(np.mean(np.abs(sums) ** 2, axis=1) - 1, 0)
    amplitude = np.where(np.arange(number.size) == np.argmax(power / number), np.sqrt(power), 0).astype(complex)
    path: FloatArray = np.zeros(sums.shape[1])
    for _ in range(_PASSES):
        likelihood = 2 * ((np.conj(amplitude)[:, None] * sums).T @ rotation).real
        before, path = path, np.asarray(grid[_best_path(likelihood, cost)], dtype=np.float64)
        if np.array_equal(path, before):  # and so would every further pass
            break
        amplitude = amplitudes(sums, number, path)
    return np.unwrap(path)


def refine(sums: ComplexArray, number: FloatArray, path_rad: FloatArray) -> PhaseTrack:
    """Each block's phase, to first order about the path `path_rad` [blocks]."""
    amplitude = amplitudes(sums, number, path_rad)
    aligned = np.conj(amplitude)[:, None] * sums * np.exp(-1j * np.outer(number, path_rad))
    parts = number**2 * np.abs(amplitude) ** 2
    # No less than what noise alone would show.
    least = float(np.min(number**2)) / sums.shape[1]
    used = max(float(parts.sum()), least)
    # Harmonics that are only noise are clipped at zero where they fall below it, but not where they exceed it.
    raw = number**2 * (np.abs(np.mean(sums * np.exp(-1j * np.outer(number, path_rad)), axis=1)) ** 2)
    information = max(float(np.sum(raw - number**2 / sums.shape[1])), float(parts.max()), used / 10, least)
    phase = path_rad + (number @ aligned.imag) / used
    return PhaseTrack(phase_rad=phase, variance_rad2=1 / (2 * information), amplitude=amplitude)


def amplitudes(sums: ComplexArray, number: FloatArray, path_rad: FloatArray) -> ComplexArray:
    """Complex amplitude of each harmonic along a path, less what noise alone would show, [c]."""
    mean = np.mean(sums * np.exp(-1j * np.outer(number, path_rad)), axis=1)
    power = np.abs(mean) ** 2
    share = np.maximum(power - 1 / sums.shape[1], 0) / np.maximum(power, np.finfo(float).tiny)
    return np.asarray(mean * np.sqrt(share), dtype=np.complex128)


def _best_path(log_likelihood: FloatArray, cost: FloatArray) -> NDArray[np.int64]:
    """Indices [blocks] of the path of highest likelihood [blocks, grid] less the cost of its steps [grid, grid]."""
    previous = np.zeros(log_likelihood.shape, dtype=np.int64)
    total = log_likelihood[0]
    columns = np.arange(total.size)
    for block in range(1, log_likelihood.shape[0]):
        reached = total - cost
        previous[block] = np.argmax(reached, axis=1)
        total = reached[columns, previous[block]] + log_likelihood[block]
    path = np.empty(log_likelihood.shape[0], dtype=np.int64)
    path[-1] = np.argmax(total)
    for block in range(log_likelihood.shape[0] - 1, 0, -1):
        path[block - 1] = previous[block, path[block]]
    return path
