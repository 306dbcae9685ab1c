"""How often noise alone shows a line: observed against the nominal false-alarm probability."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from srbval.bench.reading_records import noise_record, read_record

RATES = (0.1, 0.01, 0.001)
HARMONICS = (1, 5)
NOISES = ("white", "coloured")
NOISE_SECONDS = 4.0


@dataclass(frozen=True, kw_only=True)
class FalseAlarms:
    """How often noise alone fell below a nominal false-alarm probability, over that probability."""

    noise: str
    harmonics: int
    nominal: float
    records: int
    observed: float
    ratio: float


def chances_of(noise: str, count: int, seed: Sequence[int]) -> list[tuple[float, ...]]:
    """False-alarm probabilities told of `count` noise records, one for each of `HARMONICS`; 1 where nothing peaks."""
    rng = np.random.default_rng(seed)
    records = (noise_record(rng, NOISE_SECONDS, coloured=noise == "coloured") for _ in range(count))
    return [tuple(_chance(record, harmonics) for harmonics in HARMONICS) for record in records]


def _chance(record: np.ndarray, harmonics: int) -> float:
    reading = read_record(record, harmonics)
    return 1.0 if reading is None else reading.false_alarm


def rates_of(noise: str, chances: Sequence[tuple[float, ...]]) -> list[FalseAlarms]:
    """A row for each number of harmonics and nominal rate."""
    told = np.array(chances)
    rows = []
    for (column, harmonics), nominal in itertools.product(enumerate(HARMONICS), RATES):
        observed = float(np.mean(told[:, column] < nominal))
        rows.append(
            FalseAlarms(
                noise=noise,
                harmonics=harmonics,
                nominal=nominal,
                records=len(chances),
                observed=observed,
                ratio=observed / nominal,
            )
        )
    return rows


def worst_rate_factor(rows: Sequence[FalseAlarms]) -> float:
    """The largest factor by which an observed rate is off its nominal one, either way."""
    return max(max(r.ratio, 1 / r.ratio) if r.ratio > 0 else math.inf for r in rows)
