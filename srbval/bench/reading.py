"""Monte-Carlo bench of reading a frequency: error against the Cramer-Rao bound, coverage, false alarms; timings."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from srbval.bench.chain_errors import ChainError, chain_errors
from srbval.bench.reading_records import (
    FS_HZ,
    LIMIT_HZ,
    LINE_HZ,
    PROFILES,
    SHAFT_HZ,
    comb_record,
    cramer_rao_hz,
    noise_record,
)
from srbval.bench.reading_timing import Timing, timings
from srbval.signal import LineReading, Periodogram, read_comb

# The window about the kinematic line, and how far off its middle the true line lies.
HALF_SHARE, OFF_SHARE = 0.01, 0.001
BLOCK_S = 2 / SHAFT_HZ
RATES = (0.1, 0.01, 0.001)
NOISE_SECONDS = 4.0


@dataclass(frozen=True, kw_only=True)
class ReadingSettings:
    """How many records each figure takes; jitter and line-to-noise ratios to try."""

    trials: int = 200
    noise_records: int = 5000
    seconds: tuple[float, ...] = (10.0, 30.0)
    snr_db: tuple[float, ...] = (16.0, 25.0, 35.0)
    jitter: tuple[float, ...] = (0.0, 0.001, 0.003, 0.01)
    timed: bool = True


QUICK_READING = ReadingSettings(trials=60, noise_records=300, seconds=(10.0,), snr_db=(25.0,), jitter=(0.0, 0.01))


@dataclass(frozen=True, kw_only=True)
class Accuracy:
    """One cell: `rmse_over_bound` is against noise alone, so above one with slip; `coverage` of the 95 % interval.

    `ci95_over_error` is the median half width over 1.96 root-mean-square errors: one where no wider than needed.
    """

    seconds: float
    snr_db: float
    profile: str
    jitter: float
    trials: int
    not_read: int
    rmse_hz: float
    rmse_over_bound: float
    coverage: float
    ci95_over_error: float


@dataclass(frozen=True, kw_only=True)
class FalseAlarms:
    """How often noise alone fell below a nominal false-alarm probability, over that probability."""

    noise: str
    harmonics: int
    nominal: float
    records: int
    observed: float
    ratio: float


@dataclass(frozen=True, kw_only=True)
class ReadingBench:
    """Everything ``srbval bench --reading`` measures."""

    accuracy: tuple[Accuracy, ...]
    false_alarms: tuple[FalseAlarms, ...]
    timings: tuple[Timing, ...]
    chains: tuple[ChainError, ...]

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return asdict(self)


def run_reading_bench(
    settings: ReadingSettings, *, seed: int = 0, progress: Callable[[str, float], None] | None = None
) -> ReadingBench:
    """Run all cells; deterministic but for the timings. `progress` is told a task and its share."""
    told = progress or (_untold)
    return ReadingBench(
        accuracy=tuple(_accuracies(settings, seed, told)),
        false_alarms=tuple(_false_alarms(settings, seed, told)),
        timings=timings() if settings.timed else (),
        chains=chain_errors() if settings.timed else (),
    )


def _accuracies(settings: ReadingSettings, seed: int, told: Callable[[str, float], None]) -> Iterator[Accuracy]:
    cells = list(itertools.product(settings.seconds, settings.snr_db, PROFILES, settings.jitter))
    for index, (seconds, snr_db, profile, jitter) in enumerate(cells):
        yield _accuracy(seconds, snr_db, profile, jitter, settings.trials, np.random.default_rng((seed, index)))
        told("reading accuracy", (index + 1) / len(cells))


def _accuracy(
    seconds: float, snr_db: float, profile: str, jitter: float, trials: int, rng: np.random.Generator
) -> Accuracy:
    amplitudes = PROFILES[profile]
    readings = [
        _read(comb_record(rng, seconds, snr_db=snr_db, jitter=jitter, amplitudes=amplitudes)) for _ in range(trials)
    ]
    read = [r for r in readings if r is not None]
    error = np.array([r.found_hz - LINE_HZ for r in read])
    half = np.array([r.ci95_hz for r in read])
    rmse = float(np.sqrt(np.mean(error**2)))
    return Accuracy(
        seconds=seconds, snr_db=snr_db, profile=profile, jitter=jitter, trials=trials, not_read=trials - len(read),
        rmse_hz=rmse, rmse_over_bound=rmse / cramer_rao_hz(seconds, snr_db, amplitudes),
        coverage=float(np.mean(np.abs(error) <= half)), ci95_over_error=float(np.median(half)) / (1.96 * rmse),
    )  # fmt: skip


def _false_alarms(settings: ReadingSettings, seed: int, told: Callable[[str, float], None]) -> Iterator[FalseAlarms]:
    for number, noise in enumerate(("white", "coloured")):
        rng = np.random.default_rng((seed, 1_000_000 + number))
        chances: dict[int, list[float]] = {1: [], 5: []}
        for index in range(settings.noise_records):
            record = noise_record(rng, NOISE_SECONDS, coloured=noise == "coloured")
            for harmonics, kept in chances.items():
                reading = _read(record, harmonics)
                kept.append(1.0 if reading is None else reading.false_alarm)
            told(f"false alarms, {noise} noise", (index + 1) / settings.noise_records)
        for harmonics, nominal in itertools.product(chances, RATES):
            observed = float(np.mean(np.array(chances[harmonics]) < nominal))
            yield FalseAlarms(
                noise=noise, harmonics=harmonics, nominal=nominal, records=settings.noise_records,
                observed=observed, ratio=observed / nominal,
            )  # fmt: skip


def _read(samples: np.ndarray, harmonics: int = 5) -> LineReading | None:
    record = Periodogram.of(samples, FS_HZ, limit_hz=LIMIT_HZ, shaft_hz=SHAFT_HZ)
    middle = LINE_HZ * (1 + OFF_SHARE)
    return read_comb(record, middle, HALF_SHARE * LINE_HZ, harmonics=harmonics, shortest_block_s=BLOCK_S)


def worst_rate_factor(rows: tuple[FalseAlarms, ...]) -> float:
    """The largest factor by which an observed rate is off its nominal one, either way."""
    return max(max(r.ratio, 1 / r.ratio) if r.ratio > 0 else math.inf for r in rows)


def _untold(_task: str, _share: float) -> None:
    """No one asked to be told."""
