"""Makes the factors of ``srbval/signal/slip_interval.toml`` again: ``python -m tests.signal.slip_table`` prints them.

Slipping lines: the residuals and the slope that noise and a random walk of each ratio leave are drawn, and the factors
are moved until the coverage of every ratio is near `SLIP_WANTED`. Weak lines: weak combs are read, and the factors of
the credible interval are moved until the detected lines of every cell are covered as nearly alike as possible. The
floor, the start and the knots of the present table are kept; they were chosen by trial. Takes about five minutes.
"""

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.optimize

from srbval.arrays import FloatArray
from srbval.processes.worker import in_processes
from srbval.signal import NORMAL_95, Periodogram, Phasors, read_comb
from srbval.signal.phase_posterior import posterior
from srbval.signal.slip import WALK_RATIOS, contrasts_of, noise_error_hz, slip_interval, weak_sums, weigh_walk_ratios
from tests.signal.test_comb import FS_HZ, LINE_HZ, SHAFT_HZ, comb

BLOCKS, MODES, DRAWS, STEPS = 96, 24, 8000, 300
TRIED = np.concatenate(([0.0], np.geomspace(0.1, 3e4, 24)))  # ratios of walk to noise
SLIP_WANTED, SLIP_FREE, USUAL = 0.951, 0.02, 2.1  # coverage, its free deviation, and the factor preferred elsewhere
WANTED, FREE, FREE_WORST = 0.95, 0.01, 0.025  # coverage of weak lines, free deviation of a cell and of the worst one
SOFT, UNEVEN, STARTS = 0.05, 5e-5, 12  # width of the step from covered to not; price of uneven factors; searches
FIVE = (1, 1 / 2, 1 / 3, 1 / 4, 1 / 5)
COMBS = ((FIVE, 16.0), (FIVE, 20.0), ((1, 0.7), 16.0), ((1,), 18.0))
CELLS = tuple(itertools.product((10.0, 30.0), COMBS, (0.0, 0.0005, 0.001, 0.002, 0.003, 0.005, 0.01)))
RECORDS = 240  # of each cell: seconds, amplitudes with the first one's line-to-noise ratio in dB, jitter


def drawn_slip(ratio: float, rng: np.random.Generator, draws: int = DRAWS) -> tuple[FloatArray, FloatArray]:
    """Spread that the residuals suggest, and the modulus of the slope's error in noise errors, both [draws]."""
    contrasts = contrasts_of(BLOCKS)
    kept = np.argsort(contrasts.share)[::-1][:MODES]
    share, cross = contrasts.share[kept], contrasts.with_slope[kept] / math.sqrt(contrasts.slope_variance)
    covariance = np.eye(MODES + 1)
    covariance[0, 0] += ratio
    covariance[1:, 1:] += ratio * np.diag(share)
    covariance[0, 1:] = covariance[1:, 0] = ratio * cross
    sample = rng.standard_normal((draws, MODES + 1)) @ np.linalg.cholesky(covariance).T
    own = replace(contrasts, share=share)
    weight = np.array([weigh_walk_ratios(row**2, own)[0] for row in sample[:, 1:]])
    carried = (weight * WALK_RATIOS) @ own.by_noise * cross
    return weight @ np.log1p(WALK_RATIOS), np.abs(sample[:, 0] - np.sum(carried * sample[:, 1:], axis=1))


def slip_coverage(table: dict[str, Any], spread: FloatArray, error: FloatArray) -> float:
    """Share of the draws whose error lies within the table's half width."""
    wide = np.exp(spread / 2) * np.interp(spread, table["log_spread"], table["factor"])
    return float(np.mean(error < np.where(spread < table["start"], table["floor"], np.maximum(table["floor"], wide))))


def slip_factors() -> FloatArray:
    """Factors over the spread."""
    draws = [drawn_slip(float(ratio), np.random.default_rng((0, n))) for n, ratio in enumerate(TRIED)]

    def cost(logs: FloatArray) -> float:
        table = slip_interval() | {"factor": np.exp(logs)}
        off = np.array([abs(slip_coverage(table, *draw) - SLIP_WANTED) for draw in draws])
        beyond = np.maximum(off - SLIP_FREE, 0)
        return float(20 * beyond.max() + 2 * beyond.mean() + 0.01 * np.mean((logs - math.log(USUAL)) ** 2))

    options = {"maxiter": STEPS, "adaptive": True}
    start = np.log(slip_interval()["factor"])
    return np.exp(scipy.optimize.minimize(cost, start, method="Nelder-Mead", options=options).x)


def drawn_weak(cell: tuple[float, tuple[tuple[float, ...], float], float], records: int = RECORDS) -> FloatArray:
    """Error in credible half widths, probability that nothing slips, and width of the detected lines, [3, lines]."""
    seconds, (amplitudes, snr_db), jitter = cell
    rng, number, found = np.random.default_rng(CELLS.index(cell)), np.arange(1.0, 6.0), []
    for _ in range(records):
        samples = comb(rng, seconds, jitter, 10 ** (snr_db / 10), amplitudes=amplitudes)
        record = Periodogram.of(samples, FS_HZ, limit_hz=520.0, shaft_hz=SHAFT_HZ)
        reading = read_comb(record, 1.001 * LINE_HZ, 0.01 * LINE_HZ, period_s=1 / SHAFT_HZ)
        if reading is None or not reading.detected:
            continue
        noise = np.array([record.noise_near(h * LINE_HZ, 0.01 * h * LINE_HZ).mean_power for h in number])
        phasors = Phasors.of(record.samples, record.fs_hz, number * reading.found_hz)
        sums = weak_sums(phasors, number, noise, period_s=1 / SHAFT_HZ)
        if sums is not None:
            block_s = seconds / sums.shape[1]
            shift_hz, credible_hz, steady = posterior(sums, number, line_hz=reading.found_hz, block_s=block_s)
            alone = NORMAL_95 * noise_error_hz(sums, number, block_s)
            off = abs(reading.found_hz + shift_hz - LINE_HZ)
            found.append((off / credible_hz, steady, credible_hz / alone))
    return np.array(found).reshape(-1, 3).T


def weak_coverage(logs: FloatArray, draw: FloatArray, soft: float) -> float:
    """Share of a cell's lines within their half widths, each counted in part within `soft` of its edge."""
    table = slip_interval()
    first = len(table["weak_steady"])
    stretch = np.interp(draw[1], table["weak_steady"], logs[:first])
    stretch += np.interp(np.log(draw[2]), np.log(table["wide"]), logs[first:])
    return float(np.mean(0.5 * (1 + np.tanh((stretch - np.log(np.maximum(draw[0], 1e-9))) / soft))))


def weak_factors(draws: list[FloatArray]) -> list[FloatArray]:
    """Factors over the steadiness and over the width; only their products matter, so the first of the latter is one."""
    first, wide = len(slip_interval()["weak_steady"]), len(slip_interval()["wide"])

    def cost(free: FloatArray) -> float:
        logs = np.insert(free, first, 0.0)
        off = np.abs(np.array([weak_coverage(logs, draw, SOFT) for draw in draws]) - WANTED)
        uneven = np.mean(np.diff(logs[:first]) ** 2) + np.mean(np.diff(logs[first:]) ** 2)
        worst = max(float(off.max()) - FREE_WORST, 0.0)
        return float(np.mean(np.maximum(off - FREE, 0) ** 2) + 0.15 * worst**2 + UNEVEN * uneven)

    starts = [0.5 * np.random.default_rng(seed).standard_normal(first + wide - 1) for seed in range(STARTS)]
    best = min((scipy.optimize.minimize(cost, start, method="L-BFGS-B") for start in starts), key=lambda one: one.fun)
    return np.split(np.exp(np.insert(best.x, first, 0.0)), [first])


if __name__ == "__main__":
    drawn = dict(in_processes(drawn_weak, CELLS))
    steady, width = weak_factors([drawn[cell] for cell in CELLS])
    for name, values in (("factor", slip_factors()), ("weak_factor", steady), ("wide_factor", width)):
        print(f"{name} = {[round(float(value), 2) for value in values]}")
