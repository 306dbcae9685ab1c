"""How well a frequency is read: accuracy against the Cramer-Rao bound, false alarms, the signal chain, transforms.

And how the intervals of weak lines cover the truth, on records that their table of factors was not made from; with
``--table`` that table is made again. Every piece is kept in the user's cache, so that an interrupted run goes on where
it was, and one with more records adds to it.
"""

import contextlib
import functools
import multiprocessing
import operator
import re
from argparse import Namespace
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from srbval.processes.machine import one_thread, usable_cores
from srbval.progress import Progress, silent
from srbval.progress.tables import text_rows
from srbval.storage.content_store import ContentStore
from srbval.studies.harness import StudyResult
from srbval.studies.reading_accuracy import intervals, trials
from srbval.studies.reading_accuracy.scalogram_check import TRANSFORMS, check_scalogram
from srbval.studies.reading_accuracy.signal_chain import chain_errors
from srbval.studies.reading_accuracy.trials import NOISES, by_length, cells_of, chances_of, rates_of, summary, trials_of

# Records a task is made of; each has a seed of its own, so that results do not depend on who does it.
_TASK = 50
_NOISE_SEED = 1_000_000
STORE = ContentStore(kind="reading", computed_by="srbval.signal")

Piece = TypeVar("Piece")


@dataclass(frozen=True, kw_only=True)
class ReadingSettings:
    """Number of records per cell; durations, line-to-noise ratios, jitter and slip to try.

    `chains`: also what is not Monte-Carlo, the errors of the envelope chain and of the transforms.
    """

    trials: int = 1000
    noise_records: int = 60_000
    weak_records: int = intervals.RECORDS
    seconds: tuple[float, ...] = (0.76, 1.0, 2.0, 3.4, 10.0, 30.0)  # 9 to 355 revolutions
    snr_db: tuple[float, ...] = (16.0, 25.0, 35.0)
    jitter: tuple[float, ...] = (0.0, 0.001, 0.003, 0.01, 0.03)
    slip: tuple[float, ...] = (0.01, 0.03)
    chains: bool = True


QUICK_READING = ReadingSettings(
    trials=60, noise_records=300, weak_records=4, seconds=(10.0,), snr_db=(25.0,), jitter=(0.0, 0.01), slip=()
)


def run_reading_bench(
    settings: ReadingSettings, *, seed: int = 0, jobs: int = 1, progress: Progress = silent,
) -> dict[str, list[dict[str, Any]]]:  # fmt: skip
    """Run all cells in `jobs` processes; pieces that are stored are not made again."""
    cells = cells_of(settings.seconds, settings.snr_db, settings.jitter, settings.slip)
    pieces = functools.partial(_in_pieces, jobs=jobs)
    works = [functools.partial(trials_of, cell) for cell in cells]
    read = pieces(works, settings.trials, (seed, 0), report=functools.partial(progress, "reading accuracy"))
    noises = [functools.partial(chances_of, noise) for noise in NOISES]
    report = functools.partial(progress, "false alarms")
    noise = pieces(noises, settings.noise_records, (seed, _NOISE_SEED), report=report)
    told = zip(NOISES, noise, strict=True)
    accuracy = [summary(cell, found) for cell, found in zip(cells, read, strict=True)]
    return {
        "accuracy": accuracy,
        "by_length": list(by_length(accuracy)),
        "false_alarms": [row for name, found in told if found for row in rates_of(name, found)],
        "chains": chain_errors() if settings.chains else [],
        "transforms": [check_scalogram(name) for name in TRANSFORMS] if settings.chains else [],
        "weak_lines": intervals.check_weak(settings.weak_records, jobs) if settings.weak_records else [],
    }  # fmt: skip


def _in_pieces(
    works: Sequence[Callable[[int, Sequence[int]], list[Piece]]],
    count: int,
    seed: tuple[int, int],
    *,
    jobs: int,
    report: Callable[[float], None],
) -> list[list[Piece]]:
    """`count` results of each work, made in pieces of `_TASK`, each with a seed of its own: `seed` + work, piece."""
    sizes = [min(_TASK, count - done) for done in range(0, count, _TASK)]
    tasks = [
        functools.partial(_kept, work, size, (seed[0], seed[1] + number, piece))
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


@one_thread()
def _kept(work: Callable[[int, Sequence[int]], list[Piece]], size: int, seed: Sequence[int]) -> list[Piece]:
    """A piece as it is stored: the store knows the code that reads, this name what the piece is made of."""
    name = f"{work} {size} {seed} {Path(trials.__file__).read_text(encoding='utf-8')}"
    name = re.sub(r" at 0x[0-9a-f]+", "", name)
    found = STORE.load(name, lambda table: [tuple(row) for row in table["piece"]])
    if found is None:
        STORE.save(name, {"piece": work(size, seed)})
        found = STORE.load(name, lambda table: [tuple(row) for row in table["piece"]])
    assert found is not None, "just saved"
    return found  # type: ignore[return-value]


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    jobs = options.jobs or usable_cores()
    if options.table:
        text = f"{intervals.slip_table()}\n{intervals.weak_table(jobs)}"
        return StudyResult(content={"table": text}, text=text)
    settings = QUICK_READING if options.quick else ReadingSettings()
    count = options.records or settings.trials
    settings = replace(settings, trials=count, noise_records=settings.noise_records * count // settings.trials)
    result = run_reading_bench(settings, jobs=jobs, progress=progress)
    text = "\n\n".join(text_rows(rows) for rows in result.values() if rows)
    return StudyResult(name=None if options.quick else "reading_accuracy", content=result, text=text)
