"""The study of the reading in short: the same code, fewer records, no wall time asserted."""

import dataclasses
import functools

import numpy as np
import pytest

from srbval.signal import morlet_scalogram
from srbval.signal.interval import slip_interval, weak_factor
from srbval.signal.spectrum import SCALOGRAM_TRANSFORM
from srbval.studies.reading_accuracy import intervals
from srbval.studies.reading_accuracy.scalogram_check import TRANSFORMS, check_scalogram
from srbval.studies.reading_accuracy.signal_chain import BANDS_HZ, chain_errors
from srbval.studies.reading_accuracy.study import ReadingSettings, run_reading_bench
from srbval.studies.reading_accuracy.trials import (
    COLOUR_POLE,
    NOISES,
    chances_of,
    comb_record,
    cramer_rao_hz,
    noise_record,
    rates_of,
)

# 40 records: a root mean square scatters by 11 %; three of these above the bound's own 1.15.
TRIALS, RMSE_FACTOR = 40, 1.53
LEAST_RMSE_FACTOR = 0.6  # below: the bound or the records are wrong
RMSE_SCATTER = 3 / np.sqrt(2 * TRIALS)  # three standard errors of a root mean square
INFORMED_FACTOR = 1.25  # what not knowing the noise and the harmonics' strengths may cost
SLIP_FACTOR = 10  # jitter of 1 % makes errors ten times those of noise and more
CORRELATION_SCATTER, VARIANCE_SCATTER = 0.02, 0.05  # of 40 000 and 20 000 samples, with a wide margin
# 400 records at a nominal 10 %: three binomial standard errors about 0.93 to 0.97; mean of four such rates, of which
# two and two are of the same records: three standard errors about 0.9.
RATES, MEAN_RATE = (0.5, 1.4), (0.625, 1.2)
THREE_DIGITS = 1e-3  # of the constant sqrt(6) / (2 pi) = 0.390
# What a 95 % interval should cover, and two standard errors of 40 records below it.
LEAST_COVERAGE = 0.92 - 0.086
# Mean over all cells: 640 records, three standard errors about what is asked for.
MEAN_COVERAGE = (0.92 - 0.03, 0.98 + 0.01)


@pytest.fixture(scope="module")
def result():
    settings = ReadingSettings(
        trials=TRIALS, noise_records=20, seconds=(10.0,), snr_db=(16.0, 25.0), jitter=(0.0, 0.003, 0.01), slip=(0.03,),
        weak_records=0, chains=False,
    )  # fmt: skip
    return run_reading_bench(settings, seed=5)


def test_without_slip_the_error_is_the_cramer_rao_bound(result):
    steady = [a for a in result["accuracy"] if a["jitter"] == 0]
    assert len(steady) == 4
    assert max(a["rmse_over_bound"] for a in steady) < RMSE_FACTOR
    assert min(a["rmse_over_bound"] for a in steady) > LEAST_RMSE_FACTOR


def test_interval_covers_with_and_without_slip(result):
    cells = {(a["snr_db"], a["profile"], a["jitter"], a["slip"]): a["coverage"] for a in result["accuracy"]}
    assert {slip for *_, slip in cells} == {0.0, 0.03}
    assert min(cells.values()) > LEAST_COVERAGE - 1e-9
    assert MEAN_COVERAGE[0] < np.mean(list(cells.values())) < MEAN_COVERAGE[1]


def test_no_fit_reaches_the_bound_where_most_harmonics_drown(result):
    """A fit told all but the frequency is the yardstick: at 16 dB in the first of falling harmonics above the bound."""
    informed = {(a["snr_db"], a["profile"]): a["informed_over_bound"] for a in result["accuracy"] if a["jitter"] == 0}
    assert informed[25.0, "equal"] == pytest.approx(1.0, abs=RMSE_SCATTER)
    assert all(
        a["rmse_over_bound"] < INFORMED_FACTOR * a["informed_over_bound"]
        for a in result["accuracy"]
        if a["jitter"] == 0
    )
    assert all(a["informed_over_bound"] is None for a in result["accuracy"] if a["jitter"] > 0)


def test_slip_and_not_noise_rules_a_slipping_line(result):
    slipping = [a for a in result["accuracy"] if a["jitter"] == 0.01]
    assert min(a["rmse_over_bound"] for a in slipping) > SLIP_FACTOR
    assert all(a["detected"] == 1 for a in result["accuracy"] if a["profile"] == "equal" or a["snr_db"] > 16)


def test_noise_alone_raises_false_alarms_at_the_nominal_rate():
    rows = [row for seed, noise in enumerate(NOISES) for row in rates_of(noise, chances_of(noise, 400, [3, seed]))]
    assert {(row["noise"], row["harmonics"]) for row in rows} == {(n, h) for n in NOISES for h in (1, 5)}
    tenth = [row["ratio"] for row in rows if row["nominal"] == 0.1]
    assert RATES[0] < min(tenth) <= max(tenth) < RATES[1]
    assert MEAN_RATE[0] < np.mean(tenth) < MEAN_RATE[1]


def test_records_are_what_they_say():
    noise = noise_record(np.random.default_rng(1), 20.0, coloured=True) - 3
    assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(COLOUR_POLE, abs=CORRELATION_SCATTER)
    record = comb_record(np.random.default_rng(2), 10.0, snr_db=40.0, jitter=0.0, amplitudes=(1.0,))
    assert np.var(record) == pytest.approx(0.5 + record.size / 4 / 1e4, rel=VARIANCE_SCATTER)
    assert cramer_rao_hz(10.0, 16.0, (1.0,)) == pytest.approx(0.390 / (10 * np.sqrt(10**1.6)), rel=THREE_DIGITS)


LARGEST = 1e-4  # of the largest squared envelope
SAMPLES = 102_400


@pytest.fixture(scope="module")
def rows():
    return chain_errors(SAMPLES, records=2)


def test_one_pass_is_the_truth_and_the_papers_chain_where_that_is_too(rows):
    assert [(row["low_hz"], row["high_hz"]) for row in rows] == list(BANDS_HZ)
    for row in rows:
        assert row["one_pass"] < LARGEST
        assert row["papers_chain_faded"] < LARGEST
        assert row["one_pass_less_faded"] < LARGEST
        # What the chain as it stands differs by is its own error.
        assert row["papers_chain"] > row["one_pass"]
        assert row["one_pass_less_chain"] <= row["papers_chain"] + row["one_pass"]


def test_what_draws_the_figure_passes_at_every_row():
    assert check_scalogram(SCALOGRAM_TRANSFORM)["passed"]


@pytest.mark.parametrize("kind", ["late", "low", "stepped"])
def test_a_planted_error_is_caught(kind, monkeypatch):
    monkeypatch.setitem(TRANSFORMS, kind, functools.partial(planted, kind=kind))
    assert not check_scalogram(kind)["passed"]


def planted(samples, fs_hz, *, kind, **options):
    picture = morlet_scalogram(samples, fs_hz, **options)
    image = {
        "late": lambda a: np.roll(a, 1, axis=1),
        "low": lambda a: 0.99 * a,
        "stepped": lambda a: np.repeat(a[:, ::2], 2, axis=1)[:, : a.shape[1]],
    }[kind](picture.amplitude)
    return dataclasses.replace(picture, amplitude=image)


DRAWS, RECORDS = 1000, 6
# What the table is calibrated to, and three standard errors of a share of 1000 draws: 3 sqrt(p (1 - p) / 1000).
DRAWN_COVERAGE = (0.92 - 0.026, 0.98 + 0.014)
SHARP = 1e-6  # width of the step from covered to not: none to speak of


@pytest.mark.parametrize("ratio", [0.0, 10.0, 1000.0])
def test_the_table_covers_fresh_draws_of_every_ratio(ratio, monkeypatch):
    monkeypatch.setattr(intervals, "DRAWS", DRAWS)
    spread, error = intervals.drawn_slip(ratio, np.random.default_rng(1))
    assert spread.shape == error.shape == (DRAWS,)
    assert DRAWN_COVERAGE[0] < intervals.slip_coverage(slip_interval(), spread, error) < DRAWN_COVERAGE[1]


def test_draws_are_of_weak_lines_and_more_jitter_is_less_steady():
    cells = [(10.0, intervals.COMBS[0], jitter) for jitter in (0.0, 0.01)]
    steady, slipping = (intervals.drawn(cell, RECORDS) for cell in cells)
    assert steady.shape == (3, RECORDS)
    assert slipping.shape[0] == 3
    assert steady[1].mean() > slipping[1].mean()
    assert slipping[2].mean() > steady[2].mean() > 1


def test_coverage_is_counted_with_the_factors_that_readings_take():
    """Errors just inside and just outside of what `weak_factor` allows at the same steadiness and width."""
    table = slip_interval()
    logs = np.log([*table.weak_factor, *table.wide_factor])
    edge = weak_factor(0.2, 3.0)
    inside, outside = (np.array([[share * edge], [0.2], [3.0]]) for share in (0.99, 1.01))
    assert intervals.coverage(logs, inside, SHARP) == pytest.approx(1.0)
    assert intervals.coverage(logs, outside, SHARP) == pytest.approx(0.0)
