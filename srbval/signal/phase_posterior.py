"""The mean frequency of a weak line that may slip: its posterior, over every course that its phase may have taken.

A weak line's phase cannot be read block by block, and slip as large as the noise hides in it. What can be done is to
weigh all courses at once: the phase is a hidden random walk on the circle, observed through the harmonics of each
block, and the chance of the record for a given mean frequency and slip is summed over all courses by the forward
recursion (Rabiner 1989, Proc. IEEE 77, 257). A strong line needs a finer circle than this: see `wander`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# Points of the circle: enough for a line whose phase noise leaves no finer than 0.03 rad in the whole record.
CIRCLE = 128
# Jitters of the spacing of impacts that are weighed, as shares of it, each with weight one; and the weight of none.
JITTERS = np.geomspace(0.0005, 0.0128, 8)
STEADY_WEIGHT = 2.0
# How far the mean frequency is looked for beside the start, in bins and in its own standard errors, and how finely.
REACH_BINS, REACH_ERRORS = 1.5, 4.0
STEP, FINEST_BINS = 0.6, 0.08
_FIRST_ROUNDS, _LATER_ROUNDS = 5, 2
_ORDER = np.arange(CIRCLE // 2 + 1)
# Points of the circle for a line that keeps its phase, and of the density that all jitters are joined on.
_STEADY_CIRCLE, _DENSITY = 512, 4001
COVERAGE = 0.95


@dataclass(frozen=True, kw_only=True)
class Posterior:
    """Mean shift of the line [Hz], half width of the 95 % most likely about it, and mean jitter (a share).

    `steady` is the chance that nothing slips. As a confidence interval `credible_hz` is too wide where nothing slips
    and too narrow where little does (`interval.weak_factor`): the amplitudes are plugged in, slip can hide in noise.
    """

    shift_hz: float
    credible_hz: float
    jitter: float
    steady: float


def posterior(sums: ComplexArray, number: FloatArray, *, line_hz: float, block_s: float) -> Posterior:
    """Of the frequency of a line whose harmonics `number` [c] have `sums` [c, blocks] in units of their noise.

    Blocks last `block_s` and were turned back at the multiples of `line_hz`. The prior is flat in the frequency and
    even over `JITTERS`, with `STEADY_WEIGHT` for none. Amplitudes of the harmonics are those of greatest likelihood
    for each jitter, by expectation maximisation (Dempster et al. 1977, J. R. Stat. Soc. B 39, 1).
    """
    step_rad2 = (2 * math.pi * JITTERS) ** 2 * line_hz * block_s
    turn = 2 * math.pi * block_s
    seconds = block_s * sums.shape[1]
    error_hz = np.hypot(np.sqrt(step_rad2 / sums.shape[1]) / turn, FINEST_BINS / seconds)
    shifts = [_places(e, seconds) for e in error_hz]
    which = np.repeat(np.arange(JITTERS.size), [s.size for s in shifts])
    shift = np.concatenate(shifts)
    amplitude = _begun(sums, number, step_rad2)
    log_likelihood = _forward(_agreement(sums, number, amplitude), _steps(step_rad2[which], turn * shift), which)
    best = np.array([shift[which == w][np.argmax(log_likelihood[which == w])] for w in range(JITTERS.size)])
    amplitude = _fitted(sums, number, amplitude, _steps(step_rad2, turn * best), _LATER_ROUNDS)
    log_likelihood = _forward(_agreement(sums, number, amplitude), _steps(step_rad2[which], turn * shift), which)
    steady = _places(FINEST_BINS / 4 / seconds, seconds)
    tables = [(steady, _steady(sums, number, turn * steady) + math.log(STEADY_WEIGHT))]
    tables += [(shift[which == w], log_likelihood[which == w]) for w in range(JITTERS.size)]
    return _joined(tables)


def _places(error_hz: float, seconds: float) -> FloatArray:
    """Shifts to be weighed [Hz], where the mean frequency's own standard error is about `error_hz`."""
    reach = REACH_BINS / seconds + REACH_ERRORS * error_hz
    count = math.ceil(reach / (STEP * error_hz))
    return np.linspace(-reach, reach, 2 * count + 1)


def _steps(step_rad2: FloatArray, turn_rad: FloatArray) -> ComplexArray:
    """The walk's step on the circle, in Fourier orders, [b, orders]."""
    return np.asarray(np.exp(-0.5 * np.outer(step_rad2, _ORDER**2) - 1j * np.outer(turn_rad, _ORDER)))


def _stepped(chance: FloatArray, steps: ComplexArray) -> FloatArray:
    moved = scipy.fft.irfft(scipy.fft.rfft(chance, axis=1) * steps, n=CIRCLE, axis=1)
    return np.maximum(moved, 0.0)


def _turns(number: FloatArray, circle: int) -> ComplexArray:
    return np.asarray(np.exp(-1j * np.outer(number, np.arange(circle) * (2 * math.pi / circle))))


def _agreement(sums: ComplexArray, number: FloatArray, amplitude: ComplexArray) -> FloatArray:
    """Log likelihood of each block at each phase, less that of no line: [blocks, w, CIRCLE] for `amplitude` [w, c]."""
    seen = np.conj(amplitude)[:, :, None] * sums
    turned = (seen.transpose(2, 0, 1) @ _turns(number, CIRCLE)).real
    return np.asarray(2 * turned - np.sum(np.abs(amplitude) ** 2, axis=1)[:, None])


def _forward(agreement: FloatArray, steps: ComplexArray, which: NDArray[np.int64]) -> FloatArray:
    """Log likelihood [b] of the record for each of `steps` [b, orders], the agreement being that of `which` [b]."""
    top = agreement.max(axis=2)
    likely = np.exp(agreement - top[:, :, None])
    chance = likely[0][which] / CIRCLE
    total = top.sum(axis=0)[which]
    for block in likely[1:]:
        chance = _stepped(chance, steps) * block[which]
        size = chance.sum(axis=1)
        total += np.log(size)
        chance /= size[:, None]
    return np.asarray(total)


def _smoothed(agreement: FloatArray, steps: ComplexArray) -> FloatArray:
    """Chance of each phase in each block after all were seen, [blocks, w, CIRCLE]."""
    likely = np.exp(agreement - agreement.max(axis=2, keepdims=True))
    before = np.empty_like(likely)
    chance = np.ones(likely.shape[1:])
    for index, block in enumerate(likely):
        chance = (_stepped(chance, steps) if index else chance) * block
        chance /= chance.sum(axis=1, keepdims=True)
        before[index] = chance
    after = np.ones(likely.shape[1:])
    back = np.conj(steps)
    for index in range(len(likely) - 1, 0, -1):
        after = _stepped(after * likely[index], back)
        after /= after.sum(axis=1, keepdims=True)
        before[index - 1] *= after
    return before / before.sum(axis=2, keepdims=True)


def _begun(sums: ComplexArray, number: FloatArray, step_rad2: FloatArray) -> ComplexArray:
    """Amplitudes [w, c] for each walk, the likelier of two beginnings: a phase kept, the best harmonic alone."""
    power = np.maximum(np.mean(np.abs(sums) ** 2, axis=1) - 1, 0.02)
    alone = np.where(np.arange(number.size) == np.argmax(power / number), np.sqrt(power), 0.0)
    first = np.repeat([np.mean(sums, axis=1), alone], step_rad2.size, axis=0)
    steps = _steps(np.tile(step_rad2, 2), np.zeros(2 * step_rad2.size))
    fitted = _fitted(sums, number, first, steps, _FIRST_ROUNDS)
    likelihood = _forward(_agreement(sums, number, fitted), steps, np.arange(fitted.shape[0]))
    better = np.argmax(likelihood.reshape(2, -1), axis=0)
    return fitted.reshape(2, step_rad2.size, -1)[better, np.arange(step_rad2.size)]


def _fitted(
    sums: ComplexArray, number: FloatArray, amplitude: ComplexArray, steps: ComplexArray, rounds: int
) -> ComplexArray:
    """Amplitudes [w, c] of greater likelihood, by expectation maximisation."""
    turns = _turns(number, CIRCLE).T
    for _ in range(rounds):
        expected = _smoothed(_agreement(sums, number, amplitude), steps) @ turns
        amplitude = np.einsum("cb,bwc->wc", sums, expected) / sums.shape[1]
    return amplitude


def _steady(sums: ComplexArray, number: FloatArray, turn_rad: FloatArray) -> FloatArray:
    """Log likelihood of a line that keeps its phase, for a turn a block of `turn_rad` [s]."""
    index = np.arange(sums.shape[1]) - (sums.shape[1] - 1) / 2
    turned = np.exp(-1j * turn_rad[:, None, None] * number[:, None] * index)
    whole = np.sum(turned * sums, axis=2)
    best = whole[np.argmax(np.sum(np.abs(whole) ** 2, axis=1))] / sums.shape[1]
    seen = 2 * ((np.conj(best) * whole) @ _turns(number, _STEADY_CIRCLE)).real
    top = seen.max(axis=1)
    return np.asarray(
        top + np.log(np.mean(np.exp(seen - top[:, None]), axis=1)) - sums.shape[1] * np.sum(np.abs(best) ** 2)
    )


def _joined(tables: list[tuple[FloatArray, FloatArray]]) -> Posterior:
    """One density from the log likelihood of each jitter over its own places."""
    top = max(float(table.max()) for _, table in tables)
    reach = max(float(place[-1]) for place, _ in tables)
    shift = np.linspace(-reach, reach, _DENSITY)
    parts = [np.exp(np.interp(shift, place, table, left=-np.inf, right=-np.inf) - top) for place, table in tables]
    weight = np.array([part.sum() for part in parts])
    density = np.sum(parts, axis=0) / weight.sum()
    mean = float(density @ shift)
    away = np.abs(shift - mean)
    order = np.argsort(away)
    half = float(away[order][np.searchsorted(np.cumsum(density[order]), COVERAGE)])
    weight /= weight.sum()
    return Posterior(
        shift_hz=mean, credible_hz=half, jitter=float(weight[1:] @ JITTERS), steady=float(weight[0])
    )  # fmt: skip
