"""The course of a line's phase through a record: the likeliest random walk on a grid, then its phases read off.

A slipping line loses its phase over the record, and in noise a block's phase may be told a turn wrong. The whole
course is therefore found at once by dynamic programming (Viterbi 1967, IEEE Trans. Inf. Theory 13, 260): what all
harmonics say of each block's phase, less what a step of that size costs a random walk.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# Phases of the fundamental that a block is tried at; five harmonics still have 19 to a turn.
GRID = 96
_PASSES = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class PhaseCourse:
    """Phases of a line's fundamental read in each block [rad], [blocks], each with the same variance [rad2].

    They are read off about `about` [blocks], a course near the true one, with harmonic amplitudes `amplitude` [c] in
    units of a block's noise.
    """

    phase_rad: FloatArray
    variance_rad2: float
    amplitude: ComplexArray

    def agreement(self, sums: ComplexArray, number: FloatArray) -> float:
        """Log likelihood of the sums [c, blocks] at these phases, less that of no line."""
        turned = np.conj(self.amplitude)[:, None] * sums * np.exp(-1j * np.outer(number, self.phase_rad))
        return float(2 * turned.real.sum() - sums.shape[1] * np.sum(np.abs(self.amplitude) ** 2))


def track(sums: ComplexArray, number: FloatArray, step_rad2: float) -> FloatArray:
    """The likeliest course of the fundamental's phase [blocks, rad], begun from the harmonic that shows it best.

    `sums` [c, blocks] are those of harmonics `number` [c], in units of their noise; steps from block to block have
    variance `step_rad2` at most.
    """
    grid = np.arange(GRID) * (2 * math.pi / GRID)
    turn = np.exp(-1j * np.outer(number, grid))
    away = np.abs(grid[:, None] - grid)
    cost = np.minimum(away, 2 * math.pi - away) ** 2 / (2 * step_rad2)
    power = np.maximum(np.mean(np.abs(sums) ** 2, axis=1) - 1, 0)
    amplitude = np.where(np.arange(number.size) == np.argmax(power / number), np.sqrt(power), 0).astype(complex)
    path: FloatArray = np.zeros(sums.shape[1])
    for _ in range(_PASSES):
        agreement = 2 * ((np.conj(amplitude)[:, None] * sums).T @ turn).real
        path = np.asarray(grid[_cheapest(agreement, cost)], dtype=np.float64)
        amplitude = amplitudes(sums, number, path)
    return np.unwrap(path)


def read_about(sums: ComplexArray, number: FloatArray, about_rad: FloatArray) -> PhaseCourse:
    """Each block's phase, to first order about the course `about_rad` [blocks]."""
    amplitude = amplitudes(sums, number, about_rad)
    turned = np.conj(amplitude)[:, None] * sums * np.exp(-1j * np.outer(number, about_rad))
    parts = number**2 * np.abs(amplitude) ** 2
    # No less than what noise alone would show.
    least = float(np.min(number**2)) / sums.shape[1]
    used = max(float(parts.sum()), least)
    # Harmonics that are but noise are cut off at zero where they fall short and not where they exceed it.
    raw = number**2 * (np.abs(np.mean(sums * np.exp(-1j * np.outer(number, about_rad)), axis=1)) ** 2)
    information = max(float(np.sum(raw - number**2 / sums.shape[1])), float(parts.max()), used / 10, least)
    phase = about_rad + (number @ turned.imag) / used
    return PhaseCourse(phase_rad=phase, variance_rad2=1 / (2 * information), amplitude=amplitude)


def amplitudes(sums: ComplexArray, number: FloatArray, course_rad: FloatArray) -> ComplexArray:
    """Complex amplitude of each harmonic along a course, less what noise alone would show, [c]."""
    mean = np.mean(sums * np.exp(-1j * np.outer(number, course_rad)), axis=1)
    power = np.abs(mean) ** 2
    share = np.maximum(power - 1 / sums.shape[1], 0) / np.maximum(power, np.finfo(float).tiny)
    return np.asarray(mean * np.sqrt(share), dtype=np.complex128)


def _cheapest(agreement: FloatArray, cost: FloatArray) -> NDArray[np.int64]:
    """Indices [blocks] of the course of highest agreement [blocks, grid] less the cost of its steps [grid, grid]."""
    before = np.zeros(agreement.shape, dtype=np.int64)
    total = agreement[0]
    columns = np.arange(total.size)
    for block in range(1, agreement.shape[0]):
        reached = total - cost
        before[block] = np.argmax(reached, axis=1)
        total = reached[columns, before[block]] + agreement[block]
    path = np.empty(agreement.shape[0], dtype=np.int64)
    path[-1] = np.argmax(total)
    for block in range(agreement.shape[0] - 1, 0, -1):
        path[block - 1] = before[block, path[block]]
    return path
