"""Mean frequency of a line that may slip, and its interval from noise and slip.

Random slip makes the phase of a line, whose mean slope is the frequency, a random walk over the blocks (parts) of a
record. The phase is hidden in noise and known only up to whole turns, so it is a point on a circle. The likelihood for
a mean frequency and slip is summed over all paths by the forward recursion (Rabiner 1989, Proc. IEEE 77, 257).
"""

import math

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from srbval.arrays import ComplexArray, FloatArray
from srbval.signal.periodogram import Phasors

NORMAL_95 = 1.959964
# Numbers of blocks; the largest that the record and its sidebands allow is used. Blocks last at least two periods of
# the modulation, or one if fewer than `FEW_BLOCKS` of two fit: fewer phases do not distinguish slip from noise.
BLOCK_NUMBERS, FEW_BLOCKS = (32, 24, 16, 12, 8, 6, 5, 4), 8
MIN_SLIP_SNR = 8.0  # power over noise of the strongest harmonic below which slip is not estimated
# Most information of all harmonics about the phase, sum h^2 rho: the noise of a stronger line is assumed to be higher,
# so that the grid of phases resolves the line's phase in each block.
MOST_INFORMATION = 2000.0
LEAST_NOISE = 1e-12  # least noise power in a bin, relative to the line's power
# Half width of the stated interval over that of the credible interval. The latter contains the frequency in fewer than
# 95 % of cases if slip and noise scatter the line's phase about equally. Chosen on simulated combs (`studies/reading`).
WIDENING = 1.8
CIRCLE = 128  # points of the circle, enough for a line whose phase is known to 0.03 rad or worse in a block
JITTERS = np.geomspace(0.0005, 0.0325, 10)  # relative, of the spacing of impacts, each with prior weight one
STEADY_WEIGHT = 2.0  # prior weight of no jitter
# Range of the search for the mean frequency, in bins and in its standard errors, and its step.
REACH_BINS, REACH_ERRORS = 1.5, 4.0
STEP, FINEST_BINS = 0.6, 0.08
LEAST_DENSITY = 1e-18  # of a normalised phase density, below the rounding errors of its transform
_FIRST_ROUNDS, _LATER_ROUNDS = 5, 2
_ORDER = np.arange(CIRCLE // 2 + 1)
_STEADY_CIRCLE, _DENSITY = 512, 4001  # points of the circle without slip, and of the density that joins all jitters


def frequency_error_hz(information: float, seconds: float) -> float:
    """Least standard error of the frequency of a steady tone of unknown amplitude and phase in noise [Hz].

    Rife & Boorstyn 1974, IEEE Trans. Inf. Theory 20, 591. `information` is the tone's peak in a periodogram divided by
    the noise there; for a tone with harmonics h it is the sum of h^2 times each harmonic's peak over noise.
    """
    return math.sqrt(6 / information) / (2 * math.pi * seconds) if information > 0 else math.inf


def track_slip(
    phasors: Phasors, number: FloatArray, noise_power: FloatArray, *, line_hz: float, period_s: float = 0.0
) -> tuple[float, float] | None:
    """Shift from `line_hz` of the mean frequency of a line that may slip, and its 95 % half width [Hz].

    Component c of `phasors` is harmonic `number[c]`, with `noise_power[c]` in a bin; `period_s` is the period of the
    line's amplitude modulation by the shaft (0: none). The shift is the mean of the frequency's posterior, the half
    width `WIDENING` times that of its credible interval (`posterior`): several times the error with four or five
    blocks, which hardly bound slip, infinite with fewer. None if the line is too weak.
    """
    # Without noise, any slip would be certain.
    noise_power = np.maximum(noise_power, LEAST_NOISE * float(np.max(phasors.power())))
    if float(np.max(phasors.power() / noise_power)) < MIN_SLIP_SNR:
        return None
    shortest_s = period_s * (2 if phasors.seconds >= 2 * FEW_BLOCKS * period_s else 1)
    most = min(phasors.sums.shape[1], phasors.seconds / shortest_s if shortest_s else math.inf)
    blocks = next((count for count in BLOCK_NUMBERS if count <= most), None)
    if blocks is None:
        return 0.0, math.inf
    first = np.linspace(0, phasors.sums.shape[1], blocks + 1).astype(int)[:-1]
    sums = np.add.reduceat(phasors.sums, first, axis=1) * np.sqrt(blocks / noise_power)[:, None]
    information = float(number**2 @ np.maximum(np.sum(np.abs(sums) ** 2, axis=1) - blocks, 0))
    sums *= math.sqrt(min(1.0, MOST_INFORMATION / max(information, 1.0)))
    shift_hz, credible_hz = posterior(sums, number, line_hz=line_hz, block_s=phasors.seconds / blocks)
    return shift_hz, WIDENING * credible_hz


def posterior(sums: ComplexArray, number: FloatArray, *, line_hz: float, block_s: float) -> tuple[float, float]:
    """Compute the posterior of a line's frequency from Fourier sums over blocks of a record; a block lasts `block_s`.

    `sums` [c, blocks] are of the line's harmonics `number` [c], divided by noise. Returns the mean shift from `line_hz`
    and the half width of the 95 % credible interval [Hz]. The interval contains the true frequency in more than 95 % of
    cases without slip, in fewer with little slip: see `WIDENING`.

    All frequencies are equally probable beforehand. Each of `JITTERS` (relative scatter of the spacing of impacts) has
    the prior weight 1, zero jitter the weight `STEADY_WEIGHT`. Amplitudes are the likeliest for each jitter
    (expectation maximisation, Dempster et al. 1977, J. R. Stat. Soc. B 39, 1).
    """
    step_rad2 = (2 * math.pi * JITTERS) ** 2 * line_hz * block_s
    rad_per_hz = 2 * math.pi * block_s
    seconds = block_s * sums.shape[1]
    error_hz = np.hypot(np.sqrt(step_rad2 / sums.shape[1]) / rad_per_hz, FINEST_BINS / seconds)
    shifts = [_shift_grid(e, seconds) for e in error_hz]
    which = np.repeat(np.arange(JITTERS.size), [s.size for s in shifts])
    shift = np.concatenate(shifts)
    steps = _steps(step_rad2[which], rad_per_hz * shift)
    # Amplitudes [w, c] for each walk from the likelier of two starts: a constant phase, or the clearest harmonic.
    power = np.maximum(np.mean(np.abs(sums) ** 2, axis=1) - 1, 0.02)
    clearest = np.where(np.arange(number.size) == np.argmax(power / number), np.sqrt(power), 0.0)
    starts = np.repeat([np.mean(sums, axis=1), clearest], JITTERS.size, axis=0)
    still = _steps(np.tile(step_rad2, 2), np.zeros(2 * JITTERS.size))
    fitted = _fitted(sums, number, starts, still, _FIRST_ROUNDS)
    start_likelihood = _forward(_block_likelihood(sums, number, fitted), still, np.arange(fitted.shape[0]))
    better = np.argmax(start_likelihood.reshape(2, -1), axis=0)
    amplitude = fitted.reshape(2, JITTERS.size, -1)[better, np.arange(JITTERS.size)]
    log_likelihood = _forward(_block_likelihood(sums, number, amplitude), steps, which)
    best = np.array([shift[which == w][np.argmax(log_likelihood[which == w])] for w in range(JITTERS.size)])
    amplitude = _fitted(sums, number, amplitude, _steps(step_rad2, rad_per_hz * best), _LATER_ROUNDS)
    log_likelihood = _forward(_block_likelihood(sums, number, amplitude), steps, which)
    # Without slip the phase advances by the same step in every block.
    steady = _shift_grid(FINEST_BINS / 4 / seconds, seconds)
    index = np.arange(sums.shape[1]) - (sums.shape[1] - 1) / 2
    whole = np.sum(np.exp(-1j * (rad_per_hz * steady)[:, None, None] * number[:, None] * index) * sums, axis=2)
    best = whole[np.argmax(np.sum(np.abs(whole) ** 2, axis=1))] / sums.shape[1]
    likelihood = 2 * ((np.conj(best) * whole) @ _rotations(number, _STEADY_CIRCLE)).real
    of_steady = np.logaddexp.reduce(likelihood, axis=1) - sums.shape[1] * np.sum(np.abs(best) ** 2)
    # Join the log likelihoods, each on its grid of shifts; the first is without slip.
    tables = [(steady, of_steady + math.log(STEADY_WEIGHT / _STEADY_CIRCLE))]
    tables += [(shift[which == w], log_likelihood[which == w]) for w in range(JITTERS.size)]
    highest = max(float(table.max()) for _, table in tables)
    reach = max(float(grid[-1]) for grid, _ in tables)
    shift = np.linspace(-reach, reach, _DENSITY)
    parts = [np.exp(np.interp(shift, grid, table, left=-np.inf, right=-np.inf) - highest) for grid, table in tables]
    density = np.sum(parts, axis=0)
    density /= density.sum()
    centre = float(density @ shift)
    distance = np.abs(shift - centre)
    order = np.argsort(distance)
    return centre, float(distance[order][np.searchsorted(np.cumsum(density[order]), 0.95)])


def _shift_grid(error_hz: float, seconds: float) -> FloatArray:
    """Grid of offsets [Hz] from a line's approximate frequency, with steps below the standard error `error_hz`."""
    reach = REACH_BINS / seconds + REACH_ERRORS * error_hz
    count = math.ceil(reach / (STEP * error_hz))
    return np.linspace(-reach, reach, 2 * count + 1)


def _steps(step_rad2: FloatArray, mean_step_rad: FloatArray) -> ComplexArray:
    """Fourier coefficients of normal distributions of a phase step, of variances `step_rad2`, means `mean_step_rad`."""
    return np.asarray(np.exp(-0.5 * np.outer(step_rad2, _ORDER**2) - 1j * np.outer(mean_step_rad, _ORDER)))


def _stepped(density: FloatArray, steps: ComplexArray) -> FloatArray:
    """Convolve each phase density [b, CIRCLE] with a density of phase steps, given by Fourier coefficients `steps`."""
    stepped = scipy.fft.irfft(scipy.fft.rfft(density, axis=1) * steps, n=CIRCLE, axis=1)
    return np.maximum(stepped, LEAST_DENSITY)  # so that blocks which contradict each other leave some phase possible


def _rotations(number: FloatArray, circle: int) -> ComplexArray:
    """Factors exp(-i h phi) for harmonics h in `number` [c] at `circle` phases phi of a turn, [c, circle]."""
    return np.asarray(np.exp(-1j * np.outer(number, np.arange(circle) * (2 * math.pi / circle))))


def _block_likelihood(sums: ComplexArray, number: FloatArray, amplitude: ComplexArray) -> FloatArray:
    """Log likelihood ratio of a line to noise alone: [blocks of the record, rows of `amplitude`, `CIRCLE` phases]."""
    weighted = np.conj(amplitude)[:, :, None] * sums
    aligned = (weighted.transpose(2, 0, 1) @ _rotations(number, CIRCLE)).real
    return np.asarray(2 * aligned - np.sum(np.abs(amplitude) ** 2, axis=1)[:, None])


def _forward(block_likelihood: FloatArray, steps: ComplexArray, which: NDArray[np.int64]) -> FloatArray:
    """Log likelihood [b] of the record for b hypotheses, each a slip and a mean frequency of a line.

    Each row of `steps` contains Fourier coefficients of the distribution of the line's phase step from one block (part)
    of the record to the next, `which` [b] indices of the line's amplitudes on the second axis of `block_likelihood`.
    """
    peak = block_likelihood.max(axis=2)
    likelihood = np.exp(block_likelihood - peak[:, :, None])
    density = likelihood[0][which] / CIRCLE
    total = peak.sum(axis=0)[which]
    for block in likelihood[1:]:
        density = _stepped(density, steps) * block[which]
        size = density.sum(axis=1)
        total += np.log(size)
        density /= size[:, None]
    return np.asarray(total)


def _smoothed(block_likelihood: FloatArray, steps: ComplexArray) -> FloatArray:
    """Posterior of a line's phase in each block of a record, from all blocks and the distribution of phase `steps`."""
    likelihood = np.exp(block_likelihood - block_likelihood.max(axis=2, keepdims=True))
    forward = np.empty_like(likelihood)
    density = np.ones(likelihood.shape[1:])
    for index, block in enumerate(likelihood):
        density = (_stepped(density, steps) if index else density) * block
        density /= density.sum(axis=1, keepdims=True)
        forward[index] = density
    backward = np.ones(likelihood.shape[1:])
    reverse_steps = np.conj(steps)
    for index in range(len(likelihood) - 1, 0, -1):
        backward = _stepped(backward * likelihood[index], reverse_steps)
        backward /= backward.sum(axis=1, keepdims=True)
        forward[index - 1] *= backward
    return forward / forward.sum(axis=2, keepdims=True)


def _fitted(
    sums: ComplexArray, number: FloatArray, amplitude: ComplexArray, steps: ComplexArray, rounds: int
) -> ComplexArray:
    rotations = _rotations(number, CIRCLE).T
    for _ in range(rounds):
        expected = _smoothed(_block_likelihood(sums, number, amplitude), steps) @ rotations
        amplitude = np.einsum("cb,bwc->wc", sums, expected) / sums.shape[1]
    return amplitude
