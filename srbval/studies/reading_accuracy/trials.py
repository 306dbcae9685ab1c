"""Monte-Carlo of reading a frequency: error against the Cramer-Rao bound, coverage, false alarms.

Records are synthetic: combs with slip in noise, and noise only.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.signal import NORMAL_95, LineReading, Periodogram, Phasors, frequency_error_hz, read_comb

FS_HZ = 2000.0
SHAFT_HZ = 71 / 6  # 710 rpm
LINE_HZ = 96.79  # the 22240's BPFO at that speed: none of five harmonics coincides with one of the shaft's
LIMIT_HZ = 520.0
# The window about the kinematic line, how far off its middle the true line lies, and the shortest block of a course.
HALF_SHARE, OFF_SHARE = 0.01, 0.001
BLOCK_S = 1 / SHAFT_HZ
MEAN = 3.0  # a squared envelope is positive
# Amplitudes of the harmonics: all equal, and decreasing as those of a short burst do.
PROFILES = {"equal": (1.0,) * 5, "falling": (1.0, 1 / 2, 1 / 3, 1 / 4, 1 / 5)}
UNEVEN = 0.01  # a cage that slips does not slip evenly
COLOUR_POLE = 0.9  # first-order noise: power falls by a factor 300 over the band, by a third over five lines' reach
# Frequencies that the informed fit tries, as far from the line as it can be off.
_INFORMED_BINS, _INFORMED_PLACES = 2.0, 801


def comb_record(
    rng: np.random.Generator, seconds: float, *, snr_db: float, jitter: float, amplitudes: tuple[float, ...]
) -> FloatArray:
    """A line and its harmonics in white noise, [FS_HZ seconds].

    Periods scatter independently by `jitter` (relative, one standard deviation), so that the phase is a random walk.
    The first harmonic's power over the mean noise power of a bin is `snr_db`.
    """
    time_s = np.arange(round(seconds * FS_HZ)) / FS_HZ
    impacts = round(seconds * LINE_HZ * (1 + 10 * jitter)) + 20
    at_s = np.cumsum(1 + jitter * rng.standard_normal(impacts)) / LINE_HZ
    at_s = np.concatenate(([0.0], at_s)) - (1 + rng.random()) / LINE_HZ
    phase = 2 * math.pi * np.interp(time_s, at_s, np.arange(impacts + 1))
    signal = sum(a * np.cos(h * phase + rng.uniform(0, 2 * math.pi)) for h, a in enumerate(amplitudes, 1))
    sigma = math.sqrt(time_s.size / 4 / 10 ** (snr_db / 10))
    record: FloatArray = MEAN + signal + sigma * rng.standard_normal(time_s.size)
    return record


def noise_record(rng: np.random.Generator, seconds: float, *, coloured: bool) -> FloatArray:
    """Gaussian noise, white or of first order, [FS_HZ seconds]."""
    noise = rng.standard_normal(round(seconds * FS_HZ))
    if coloured:
        import scipy.signal

        noise = scipy.signal.lfilter([1.0], [1.0, -COLOUR_POLE], noise)
    record: FloatArray = MEAN + noise
    return record


def cramer_rao_hz(seconds: float, snr_db: float, amplitudes: tuple[float, ...]) -> float:
    """Cramer-Rao bound of the standard error of the line's frequency [Hz], noise being the only cause."""
    information = 10 ** (snr_db / 10) * sum((h * a) ** 2 for h, a in enumerate(amplitudes, 1))
    return frequency_error_hz(information, seconds)


def periodogram_of(record: FloatArray) -> Periodogram:
    """The periodogram that every reading starts from."""
    return Periodogram.of(record, FS_HZ, limit_hz=LIMIT_HZ, shaft_hz=SHAFT_HZ)


def read_record(record: FloatArray, harmonics: int = 5, slip: float = 0.0) -> LineReading | None:
    """Read the line, in a window that is not centred on it; with `slip` it lies so far below, and the window is wider.

    The line is the same for every slip: where the cage lags, the kinematic line that is looked about is the higher one.
    """
    middle, half = LINE_HZ * (1 + OFF_SHARE) / (1 - slip), (HALF_SHARE + slip) * LINE_HZ
    return read_comb(periodogram_of(record), middle, half, harmonics=harmonics, period_s=BLOCK_S)


@dataclass(frozen=True, kw_only=True)
class AccuracyCell:
    """What is read: `snr_db` is the first harmonic's, `profile` the amplitudes of all five; the cage lags by `slip`."""

    seconds: float
    snr_db: float
    profile: str
    jitter: float
    slip: float = 0.0

    def record(self, rng: np.random.Generator) -> FloatArray:
        """A record of this cell."""
        return comb_record(rng, self.seconds, snr_db=self.snr_db, jitter=self.jitter, amplitudes=PROFILES[self.profile])


Trial = tuple[bool, float, float, float]  # detected, error, half width, the informed fit's error [Hz]


def trials_of(cell: AccuracyCell, count: int, seed: Sequence[int]) -> list[Trial]:
    """`count` records of a cell, read."""
    rng = np.random.default_rng(seed)
    return [_trial(cell, cell.record(rng)) for _ in range(count)]


def _trial(cell: AccuracyCell, record: FloatArray) -> Trial:
    reading = read_record(record, slip=cell.slip)
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


def summary(cell: AccuracyCell, trials: Sequence[Trial]) -> dict[str, Any]:
    """The cell's row; all figures but `detected` are of the lines detected, for a frequency is stated of no other.

    `weakest_db` is the weakest harmonic's line-to-noise ratio, `detected` the share of `trials`. `rmse_over_bound` is
    against noise alone, so above one with slip; `informed_over_bound` is that of a fit that is given the noise, the
    strength of every harmonic and that nothing slips (None with jitter). `coverage` is the 95 % interval's;
    `ci95_over_error` the median half width over 1.96 root-mean-square errors: one where it is no wider than needed.
    """
    detected, error, half, informed = (np.array(column) for column in zip(*trials, strict=True))
    error, half = error[detected], half[detected]
    amplitudes = PROFILES[cell.profile]
    bound = cramer_rao_hz(cell.seconds, cell.snr_db, amplitudes)
    rmse = _rms(error)
    return vars(cell) | {
        "weakest_db": cell.snr_db + 20 * math.log10(min(amplitudes)), "trials": len(trials),
        "detected": float(np.mean(detected)), "rmse_hz": rmse, "rmse_over_bound": rmse / bound,
        "informed_over_bound": None if cell.jitter else _rms(informed) / bound,
        "coverage": float(np.mean(np.abs(error) <= half)),
        "ci95_over_error": float(np.median(half)) / (NORMAL_95 * rmse),
    }  # fmt: skip


def by_length(rows: Sequence[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Per duration and jitter: coverage over all its cells, that of the least and best covered one, median width."""
    for seconds, jitter in dict.fromkeys((row["seconds"], row["jitter"]) for row in rows):
        own = [row for row in rows if (row["seconds"], row["jitter"]) == (seconds, jitter) and row["detected"] > 0]
        lines = [row["detected"] * row["trials"] for row in own]
        covered = [row["coverage"] for row in own]
        yield {
            "turns": seconds * SHAFT_HZ, "jitter": jitter, "lines": round(sum(lines)),
            "coverage": float(np.average(covered, weights=lines)), "least": min(covered), "most": max(covered),
            "ci95_over_error": float(np.median([row["ci95_over_error"] for row in own])),
        }  # fmt: skip


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def cells_of(
    seconds: Sequence[float], snr_db: Sequence[float], jitter: Sequence[float], slip: Sequence[float] = ()
) -> tuple[AccuracyCell, ...]:
    """All combinations; with `slip` only those of falling harmonics whose periods scatter by `UNEVEN` or more."""
    cells = [
        AccuracyCell(seconds=s, snr_db=d, profile=p, jitter=j)
        for s, d, p, j in itertools.product(seconds, snr_db, PROFILES, jitter)
    ]
    slipping = [c for c in cells if c.profile == "falling" and c.jitter >= UNEVEN]
    return (*cells, *(replace(cell, slip=share) for share, cell in itertools.product(slip, slipping)))


RATES = (0.1, 0.01, 0.001)
HARMONICS = (1, 5)
NOISES = ("white", "coloured")
NOISE_SECONDS = 4.0


def chances_of(noise: str, count: int, seed: Sequence[int]) -> list[tuple[float, ...]]:
    """False-alarm probabilities of `count` noise records, one per entry of `HARMONICS`; 1 where nothing peaks."""
    rng = np.random.default_rng(seed)
    records = (noise_record(rng, NOISE_SECONDS, coloured=noise == "coloured") for _ in range(count))
    readings = ([read_record(record, harmonics) for harmonics in HARMONICS] for record in records)
    return [tuple(1.0 if one is None else one.noise_false_alarm for one in both) for both in readings]


def rates_of(noise: str, chances: Sequence[tuple[float, ...]]) -> Iterator[dict[str, Any]]:
    """How often noise alone fell below a nominal false-alarm probability, over it: by number of harmonics and rate."""
    stated = np.array(chances)
    for (column, harmonics), nominal in itertools.product(enumerate(HARMONICS), RATES):
        observed = float(np.mean(stated[:, column] < nominal))
        yield {
            "noise": noise, "harmonics": harmonics, "nominal": nominal, "records": len(chances), "observed": observed,
            "ratio": observed / nominal,
        }  # fmt: skip
