"""Calibration of the intervals of slipping and of weak lines: the factors in ``srbval/signal/slip_interval.toml``.

Slipping lines: drawn are the residuals and the slope that noise and a random walk of every ratio leave; the table's
factors are moved until no ratio's coverage lies further from the middle of what is asked for than need be.

Weak lines: records of weak combs with and without slip are read; the factors of the credible interval are moved until
the lines detected are covered as nearly alike as can be, whatever they slip. `check_weak` changes nothing: how the
table in use covers on cells that it was not made from, of other durations, combs and jitters, and of two seconds.
"""

import dataclasses
import functools
import itertools
import math
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.signal import NORMAL_95, Phasors
from srbval.signal.interval import SlipInterval, slip_interval
from srbval.signal.phase_posterior import posterior
from srbval.signal.slip import RATIOS, modes_of, noise_error_hz, weak_sums, weigh
from srbval.studies.reading_accuracy.trials import (
    BLOCK_S,
    HALF_SHARE,
    LINE_HZ,
    PROFILES,
    comb_record,
    periodogram_of,
    read_record,
)

# Of slipping lines.
BLOCKS, MODES, DRAWS = 96, 24, 8000
TRIED = np.concatenate(([0.0], np.geomspace(0.1, 3e4, 24)))
SLIP_WANTED, SLIP_FREE = 0.951, 0.02  # coverage aimed at, and how far off costs nothing
USUAL = 2.1  # factor that wider ones are kept near where coverage allows
STEPS = 300

# Of weak lines.
Comb = tuple[tuple[float, ...], float]  # amplitudes, line-to-noise ratio of the first [dB]
Cell = tuple[float, Comb, float]  # seconds, comb, jitter

SECONDS = (10.0, 30.0)
COMBS: tuple[Comb, ...] = (
    (PROFILES["falling"], 16.0), (PROFILES["falling"], 20.0), ((1.0, 0.7), 16.0), ((1.0,), 18.0),
)  # fmt: skip
JITTERS = (0.0, 0.0005, 0.001, 0.002, 0.003, 0.005, 0.01)
RECORDS, SEED = 240, 22
# None of these has a part in the table.
OTHER_SECONDS, OTHER_JITTERS = (2.0, 5.0, 20.0), (0.0, 0.0007, 0.0025, 0.007)
OTHER_COMBS: tuple[Comb, ...] = (((1.0, 1 / 2, 1 / 3), 18.0), ((1.0, 0.85, 0.6, 0.3), 15.0))
# Coverage aimed at; how far off costs nothing, and how far off the worst cell's does.
WANTED, FREE, FREE_WORST = 0.95, 0.01, 0.025
BEGINNINGS = 12
# Width of the step from covered to not, in the logarithm of the half width: makes the search smooth. And the price of
# factors that differ from knot to knot.
SOFT, UNEVEN = 0.05, 5e-5


def drawn_slip(ratio: float, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Spread [draws] that the residuals suggest, and the modulus of the slope's error in noise errors [draws]."""
    modes = modes_of(BLOCKS)
    kept = np.argsort(modes.share)[::-1][:MODES]
    share, cross = modes.share[kept], modes.with_slope[kept] / math.sqrt(modes.slope_variance)
    covariance = np.eye(MODES + 1)
    covariance[0, 0] += ratio
    covariance[1:, 1:] += ratio * np.diag(share)
    covariance[0, 1:] = covariance[1:, 0] = ratio * cross
    sample = rng.standard_normal((DRAWS, MODES + 1)) @ np.linalg.cholesky(covariance).T
    weight = np.array([weigh(row, share)[0] for row in sample[:, 1:]])
    carried = weight @ (RATIOS[:, None] * cross / (1 + RATIOS[:, None] * share))
    error = sample[:, 0] - np.sum(carried * sample[:, 1:], axis=1)
    return weight @ np.log1p(RATIOS), np.abs(error)


def slip_coverage(table: SlipInterval, spread: FloatArray, error: FloatArray) -> float:
    """Share of draws whose error lies within the table's half width (`SlipInterval.half_width`, all draws at once)."""
    wide = np.exp(spread / 2) * np.interp(spread, table.log_spread, table.factor)
    half = np.where(spread < table.start, table.floor, np.maximum(table.floor, wide))
    return float(np.mean(error < half))


def calibrate_slip(seed: int = 0) -> SlipInterval:
    """The table again, from the present one's floor and knots."""
    import scipy.optimize

    rng = np.random.default_rng(seed)
    draws = [drawn_slip(float(ratio), rng) for ratio in TRIED]
    old = slip_interval()

    def table(logs: FloatArray) -> SlipInterval:
        factor = tuple(float(f) for f in np.exp(logs))
        return dataclasses.replace(old, factor=factor)

    def cost(logs: FloatArray) -> float:
        off = np.array([abs(slip_coverage(table(logs), *draw) - SLIP_WANTED) for draw in draws])
        beyond = np.maximum(off - SLIP_FREE, 0)
        return float(20 * beyond.max() + 2 * beyond.mean() + 0.01 * np.mean((logs - math.log(USUAL)) ** 2))

    found = scipy.optimize.minimize(
        cost, np.log(old.factor), method="Nelder-Mead", options={"maxiter": STEPS, "adaptive": True}
    )
    return table(found.x)


def slip_table() -> str:
    """The table anew, as TOML, with its coverage of fresh draws."""
    new = calibrate_slip()
    fresh = np.random.default_rng(1)
    shares = [slip_coverage(new, *drawn_slip(float(ratio), fresh)) for ratio in TRIED]
    return (
        f"# coverage of fresh draws: {min(shares):.3f} to {max(shares):.3f}\n"
        f"floor = {new.floor}\nstart = {new.start}\n"
        f"log_spread = {list(new.log_spread)}\nfactor = {[round(f, 2) for f in new.factor]}"
    )


def drawn(cell: Cell, count: int = RECORDS) -> FloatArray:
    """Of the lines detected: errors in credible half widths, chances that nothing slips, widths, [3, detected]."""
    seconds, (amplitudes, snr_db), jitter = cell
    rng = np.random.default_rng((SEED, *(round(1e4 * v) for v in (seconds, sum(amplitudes), snr_db, jitter))))
    found = []
    for _ in range(count):
        record = comb_record(rng, seconds, snr_db=snr_db, jitter=jitter, amplitudes=amplitudes)
        reading = read_record(record)
        if reading is None or not reading.detected:
            continue
        number = np.arange(1, 6, dtype=np.float64)
        reduced = periodogram_of(record)
        noise = np.array([reduced.noise_near(h * LINE_HZ, h * HALF_SHARE * LINE_HZ).mean_power for h in number])
        phasors = Phasors.of(reduced.samples, reduced.fs_hz, number * reading.found_hz)
        sums = weak_sums(phasors, number, noise, period_s=BLOCK_S)
        if sums is not None:
            told = posterior(sums, number, line_hz=reading.found_hz, block_s=seconds / sums.shape[1])
            off = abs(reading.found_hz + told.shift_hz - LINE_HZ)
            alone = NORMAL_95 * noise_error_hz(sums, number, seconds / sums.shape[1])
            found.append((off / told.credible_hz, told.steady, told.credible_hz / alone))
    return np.array(found).reshape(-1, 3).T


def calibrate(draws: list[FloatArray]) -> FloatArray:
    """Logarithms of the factors at the table's knots, those over the steadiness first.

    Only products of two factors matter: the first over the width is one.
    """
    import scipy.optimize

    first = len(slip_interval().weak_steady)

    def whole(free: FloatArray) -> FloatArray:
        return np.insert(free, first, 0.0)

    def cost(free: FloatArray) -> float:
        logs = whole(free)
        off = np.abs(np.array([coverage(logs, draw, SOFT) for draw in draws]) - WANTED)
        uneven = np.mean(np.diff(logs[:first]) ** 2) + np.mean(np.diff(logs[first:]) ** 2)
        worst = max(float(off.max()) - FREE_WORST, 0.0)
        return float(np.mean(np.maximum(off - FREE, 0) ** 2) + 0.15 * worst**2 + UNEVEN * uneven)

    size = first + len(slip_interval().wide) - 1
    beginnings = [0.5 * np.random.default_rng(seed).standard_normal(size) for seed in range(BEGINNINGS)]
    tried = [scipy.optimize.minimize(cost, beginning, method="L-BFGS-B") for beginning in beginnings]
    return whole(min(tried, key=lambda result: float(result.fun)).x)


def coverage(logs: FloatArray, draw: FloatArray, soft: float) -> float:
    """Share of a cell's lines that lie within their half widths, each counted in part within `soft` of its edge."""
    table = slip_interval()
    first = len(table.weak_steady)
    stretch = np.interp(draw[1], table.weak_steady, logs[:first])
    stretch += np.interp(np.log(draw[2]), np.log(table.wide), logs[first:])
    return float(np.mean(0.5 * (1 + np.tanh((stretch - np.log(np.maximum(draw[0], 1e-9))) / soft))))


def check_weak(count: int, jobs: int) -> list[dict[str, Any]]:
    """Coverage of the table in use on other cells, `count` records each, by the record's duration."""
    known = slip_interval()
    logs, rows = np.log(np.concatenate((known.weak_factor, known.wide_factor))), []
    every = _all_drawn(list(itertools.product(OTHER_SECONDS, OTHER_COMBS, OTHER_JITTERS)), count, jobs)
    of_one = len(every) // len(OTHER_SECONDS)
    for number, seconds in enumerate(OTHER_SECONDS):
        whole = np.concatenate(every[of_one * number : of_one * (number + 1)], axis=1)
        rows.append({"seconds": seconds, "lines": whole.shape[1], "coverage": coverage(logs, whole, 1e-6)})
    return rows


def _all_drawn(cells: list[Cell], count: int, jobs: int) -> list[FloatArray]:
    work = functools.partial(drawn, count=count)
    if jobs == 1:
        return [work(cell) for cell in cells]
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        return list(pool.map(work, cells))


def weak_table(jobs: int) -> str:
    """The table anew, as TOML, with its coverage of the records that it was made from."""
    all_draws = _all_drawn(list(itertools.product(SECONDS, COMBS, JITTERS)), RECORDS, jobs)
    found_logs = calibrate(all_draws)
    shares = [coverage(found_logs, draw, 1e-6) for draw in all_draws]
    factors, knots = [round(float(f), 2) for f in np.exp(found_logs)], slip_interval()
    first = len(knots.weak_steady)
    return (
        f"# coverage {min(shares):.3f} to {max(shares):.3f}, standard deviation {math.sqrt(np.var(shares)):.3f}\n"
        f"weak_steady = {list(knots.weak_steady)}\nweak_factor = {factors[:first]}\n"
        f"wide = {list(knots.wide)}\nwide_factor = {factors[first:]}"
    )
