"""The bench of reading a frequency: accuracy against the Cramer-Rao bound, false alarms, the signal chain, timings."""

import contextlib
import functools
import multiprocessing
import operator
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

from srbval.bench.reading_trials import (
    NOISES,
    Accuracy,
    FalseAlarms,
    cells_of,
    chances_of,
    rates_of,
    summary,
    trials_of,
)
from srbval.bench.scalogram_check import TRANSFORMS, ScalogramCheck, check_scalogram
from srbval.bench.signal_chain import ChainError, ChainTiming, chain_errors, timings
from srbval.progress import Progress, silent

# Records a task is made of; each has a seed of its own, so that results do not depend on who does it.
_TASK = 50
_NOISE_SEED = 1_000_000

Piece = TypeVar("Piece")


@dataclass(frozen=True, kw_only=True)
class ReadingSettings:
    """Number of records per cell; durations, line-to-noise ratios and jitter to try.

    `timed`: also what is not Monte-Carlo, the wall times and the errors of the envelope chain and the transforms.
    """

    trials: int = 1000
    noise_records: int = 60_000
    seconds: tuple[float, ...] = (10.0, 30.0)
    snr_db: tuple[float, ...] = (16.0, 25.0, 35.0)
    jitter: tuple[float, ...] = (0.0, 0.001, 0.003, 0.01)
    timed: bool = True


QUICK_READING = ReadingSettings(trials=60, noise_records=300, seconds=(10.0,), snr_db=(25.0,), jitter=(0.0, 0.01))


@dataclass(frozen=True, kw_only=True)
class ReadingBench:
    """Everything ``srbval bench --reading`` measures."""

    accuracy: tuple[Accuracy, ...]
    false_alarms: tuple[FalseAlarms, ...]
    timings: tuple[ChainTiming, ...]
    chains: tuple[ChainError, ...]
    transforms: tuple[ScalogramCheck, ...]


def run_reading_bench(
    settings: ReadingSettings, *, seed: int = 0, jobs: int = 1, progress: Progress = silent
) -> ReadingBench:
    """Run all cells in `jobs` processes; deterministic except for the timings, which come first, with no other work."""
    timed = timings() if settings.timed else ()
    chains = chain_errors() if settings.timed else ()
    transforms = tuple(check_scalogram(name) for name in TRANSFORMS) if settings.timed else ()
    cells = cells_of(settings.seconds, settings.snr_db, settings.jitter)
    read = _in_pieces(
        [functools.partial(trials_of, cell) for cell in cells],
        settings.trials,
        (seed, 0),
        jobs,
        functools.partial(progress, "reading accuracy"),
    )
    noise = _in_pieces(
        [functools.partial(chances_of, noise) for noise in NOISES],
        settings.noise_records,
        (seed, _NOISE_SEED),
        jobs,
        functools.partial(progress, "false alarms"),
    )
    return ReadingBench(
        accuracy=tuple(summary(cell, trials) for cell, trials in zip(cells, read, strict=True)),
        false_alarms=tuple(row for name, chances in zip(NOISES, noise, strict=True) for row in rates_of(name, chances)),
        timings=timed,
        chains=chains,
        transforms=transforms,
    )


def _in_pieces(
    works: Sequence[Callable[[int, Sequence[int]], list[Piece]]],
    count: int,
    seed: tuple[int, int],
    jobs: int,
    report: Callable[[float], None],
) -> list[list[Piece]]:
    """`count` results of each work, made in pieces of `_TASK`, each with a seed of its own: `seed` + work, piece."""
    sizes = [min(_TASK, count - done) for done in range(0, count, _TASK)]
    tasks = [
        functools.partial(work, size, (seed[0], seed[1] + number, piece))
        for number, work in enumerate(works)
        for piece, size in enumerate(sizes)
    ]
    results: list[list[Piece]] = [[] for _ in works]
    pool = None if jobs == 1 else ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn"))
    mapped: Callable[..., Iterable[list[Piece]]] = map if pool is None else pool.map
    with pool or contextlib.nullcontext():
        for index, piece in enumerate(mapped(operator.call, tasks)):
            results[index // len(sizes)] += piece
            report((index + 1) / len(tasks))
    return results
