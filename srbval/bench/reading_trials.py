"""Monte-Carlo of reading a frequency: error against the Cramer-Rao bound, coverage, false alarms."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.bench.reading_records import (
    LINE_HZ,
    PROFILES,
    comb_record,
    cramer_rao_hz,
    noise_record,
    periodogram_of,
    read_record,
)
from srbval.signal import NORMAL_95, Phasors

# Frequencies that the informed fit tries, as far from the line as it can be off.
_INFORMED_BINS, _INFORMED_PLACES = 2.0, 801


@dataclass(frozen=True, kw_only=True)
class AccuracyCell:
    """What is read: `snr_db` is the first harmonic's, `profile` the amplitudes of all five."""

    seconds: float
    snr_db: float
    profile: str
    jitter: float

    def record(self, rng: np.random.Generator) -> FloatArray:
        """A record of this cell."""
        return comb_record(rng, self.seconds, snr_db=self.snr_db, jitter=self.jitter, amplitudes=PROFILES[self.profile])


@dataclass(frozen=True, kw_only=True)
class Accuracy:
    """One cell; all figures but `detected` are of the lines detected, for a frequency is stated of no other.

    `weakest_db` is the weakest harmonic's line-to-noise ratio, `detected` the share of `trials`. `rmse_over_bound` is
    against noise alone, so above one with slip; `informed_over_bound` is that of a fit that is given the noise, the
    strength of every harmonic and that nothing slips (None with jitter). `coverage` is the 95 % interval's;
    `ci95_over_error` the median half width over 1.96 root-mean-square errors: one where it is no wider than needed.
    """

    seconds: float
    snr_db: float
    weakest_db: float
    profile: str
    jitter: float
    trials: int
    detected: float
    rmse_hz: float
    rmse_over_bound: float
    informed_over_bound: float | None
    coverage: float
    ci95_over_error: float


Trial = tuple[bool, float, float, float]  # detected, error, half width, the informed fit's error [Hz]


def trials_of(cell: AccuracyCell, count: int, seed: Sequence[int]) -> list[Trial]:
    """`count` records of a cell, read."""
    rng = np.random.default_rng(seed)
    return [_trial(cell, cell.record(rng)) for _ in range(count)]


def _trial(cell: AccuracyCell, record: FloatArray) -> Trial:
    reading = read_record(record)
    informed = 0.0 if cell.jitter else _informed_hz(cell, record) - LINE_HZ
    if reading is None:
        return False, 0.0, 0.0, informed
    return reading.detected, reading.found_hz - LINE_HZ, reading.ci95_hz, informed


def _informed_hz(cell: AccuracyCell, record: FloatArray) -> float:
    """Frequency of the largest weighted power; weights rho / (1 + rho) are optimal for lines of Gaussian amplitude."""
    amplitudes = np.array(PROFILES[cell.profile])
    number = np.arange(1, amplitudes.size + 1, dtype=np.float64)
    rho = 10 ** (cell.snr_db / 10) * amplitudes**2
    reduced = periodogram_of(record)
    phasors = Phasors.of(reduced.samples, reduced.fs_hz, number * LINE_HZ)
    place = np.linspace(-1, 1, _INFORMED_PLACES) * _INFORMED_BINS / phasors.seconds
    turned = np.exp(-2j * np.pi * number[:, None, None] * place[:, None] * phasors.time_s)
    power = np.abs(np.einsum("cpb,cb->cp", turned, phasors.sums)) ** 2
    # A record's five lines are all of one noise: power adds up with the same scale.
    weighted = rho / (1 + rho) @ power
    top = int(np.clip(np.argmax(weighted), 1, place.size - 2))
    left, middle, right = weighted[top - 1 : top + 2]
    offset = (left - right) / (2 * (left - 2 * middle + right))
    return LINE_HZ + float(place[top] + offset * (place[1] - place[0]))


def summary(cell: AccuracyCell, trials: Sequence[Trial]) -> Accuracy:
    """The cell's row."""
    detected, error, half, informed = (np.array(column) for column in zip(*trials, strict=True))
    error, half = error[detected], half[detected]
    amplitudes = PROFILES[cell.profile]
    bound = cramer_rao_hz(cell.seconds, cell.snr_db, amplitudes)
    rmse = _rms(error)
    return Accuracy(
        seconds=cell.seconds, snr_db=cell.snr_db, weakest_db=cell.snr_db + 20 * float(np.log10(min(amplitudes))),
        profile=cell.profile, jitter=cell.jitter, trials=len(trials), detected=float(np.mean(detected)), rmse_hz=rmse,
        rmse_over_bound=rmse / bound, informed_over_bound=None if cell.jitter else _rms(informed) / bound,
        coverage=float(np.mean(np.abs(error) <= half)), ci95_over_error=float(np.median(half)) / (NORMAL_95 * rmse),
    )  # fmt: skip


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def cells_of(seconds: Sequence[float], snr_db: Sequence[float], jitter: Sequence[float]) -> tuple[AccuracyCell, ...]:
    """All combinations."""
    return tuple(
        AccuracyCell(seconds=s, snr_db=d, profile=p, jitter=j)
        for s, d, p, j in itertools.product(seconds, snr_db, PROFILES, jitter)
    )


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
    """False-alarm probabilities of `count` noise records, one per entry of `HARMONICS`; 1 where nothing peaks."""
    rng = np.random.default_rng(seed)
    records = (noise_record(rng, NOISE_SECONDS, coloured=noise == "coloured") for _ in range(count))
    return [tuple(_chance(record, harmonics) for harmonics in HARMONICS) for record in records]


def _chance(record: np.ndarray, harmonics: int) -> float:
    reading = read_record(record, harmonics)
    return 1.0 if reading is None else reading.false_alarm


def rates_of(noise: str, chances: Sequence[tuple[float, ...]]) -> list[FalseAlarms]:
    """One row per number of harmonics and nominal rate."""
    stated = np.array(chances)
    rows = []
    for (column, harmonics), nominal in itertools.product(enumerate(HARMONICS), RATES):
        observed = float(np.mean(stated[:, column] < nominal))
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
