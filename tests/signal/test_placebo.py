"""A comb's rank among meaningless ones: uniform where noise-only probabilities are not, least for a true line."""

import numpy as np
import pytest

from srbval.signal import Periodogram
from srbval.signal.comb import read_comb
from srbval.signal.false_alarm import COMBS, GRID, fundamentals, joint_false_alarm, neg_log_rank, rank_among_placebos
from srbval.signal.false_alarm import rank as rank_of

FS_HZ, SECONDS, SHAFT_HZ, LIMIT_HZ = 2000.0, 4.0, 11.83, 520.0
HARMONICS, RELATIVE = 5, 0.01
TRUE_HZ = 88.7
LEAST = 1 / (COMBS + 1)
# 240 combs of 60 records: ranks below a twentieth within three binomial standard errors, and a distance from the
# uniform distribution that 60 independent ones stay below in 19 of 20 cases (1.36 / sqrt(60)).
RECORDS, COMBS_EACH, HIGHEST_SHARE, HIGHEST_DISTANCE = 60, 4, 0.13, 0.175


def record_of(rng, *, other=0.0, line=0.0):
    """White noise, six lines at random frequencies that are no one's harmonics, and a comb at `TRUE_HZ`."""
    time_s = np.arange(round(FS_HZ * SECONDS)) / FS_HZ
    samples = rng.standard_normal(time_s.size)
    for _ in range(6):
        samples += other * np.cos(2 * np.pi * rng.uniform(50, LIMIT_HZ) * time_s + rng.uniform(0, 6))
    for number in range(1, HARMONICS + 1):
        samples += line * np.cos(2 * np.pi * number * TRUE_HZ * time_s + rng.uniform(0, 6))
    return Periodogram.of(samples, FS_HZ, limit_hz=LIMIT_HZ, shaft_hz=SHAFT_HZ)


def pool(centre_hz):
    elsewhere = fundamentals(45.0, LIMIT_HZ / HARMONICS / (1 + RELATIVE), RELATIVE)
    return elsewhere[np.abs(elsewhere / centre_hz - 1) > 2 * RELATIVE]


def rank(record, centre_hz):
    return rank_among_placebos(record, centre_hz, RELATIVE * centre_hz, HARMONICS, pool(centre_hz)).false_alarm


def test_ranks_are_uniform_where_other_lines_make_noise_only_probabilities_small():
    rng = np.random.default_rng(3)
    rows = []
    for _ in range(RECORDS):
        record = record_of(rng, other=0.5)
        for centre_hz in rng.uniform(50, 100, COMBS_EACH):
            reading = read_comb(record, centre_hz, RELATIVE * centre_hz, period_s=None)
            rows.append((rank(record, centre_hz), 1.0 if reading is None else reading.noise_false_alarm))
    placebo, noise = np.array(rows).T
    assert np.mean(noise < 0.001) > 0.1
    assert np.mean(placebo < 0.05) < HIGHEST_SHARE
    ordered = np.sort(placebo)
    assert np.max(np.abs(ordered - (np.arange(ordered.size) + 0.5) / ordered.size)) < HIGHEST_DISTANCE


def test_a_comb_is_no_rarer_than_one_in_the_windows_that_share_no_line():
    """The strongest comb of a record stands in one of so few windows, whichever that is."""
    record = record_of(np.random.default_rng(4), other=0.3, line=0.4)
    assert rank(record, TRUE_HZ * 1.003) == LEAST
    windows = pool(TRUE_HZ).size / (2 * GRID)
    found = rank_among_placebos(record, TRUE_HZ, RELATIVE * TRUE_HZ, HARMONICS, pool(TRUE_HZ))
    assert found.whole_false_alarm == pytest.approx(1 / (windows + 1))
    assert joint_false_alarm(0.0, found.false_alarm, found.whole_false_alarm) > 0.1 / (windows + 1)
    elsewhere = rank_among_placebos(record, 0.8 * TRUE_HZ, RELATIVE * 0.8 * TRUE_HZ, HARMONICS, pool(0.8 * TRUE_HZ))
    assert elsewhere.whole_false_alarm >= 1.5 / (windows + 1)  # the comb at TRUE_HZ is stronger
    assert joint_false_alarm(0.5, 0.0, 0.0) == 0.5


@pytest.mark.parametrize("ties", [False, True])
def test_the_tail_is_the_rank_inside_and_goes_on_exponentially_beyond(ties):
    """Placebos drawn from an exponential distribution: what is as rare as 1e-5 has a tail of about that."""
    placebos = np.random.default_rng(8).exponential(3.0, 4000)
    inside, beyond = float(np.quantile(placebos, 0.5)), 3 * np.log(1e5)
    assert neg_log_rank(inside, placebos, ties=ties) == pytest.approx(-np.log(rank_of(inside, placebos)))
    assert rank_of(beyond, placebos) == 1 / 4001
    assert 0.3e-5 < np.exp(-neg_log_rank(beyond, placebos, ties=ties)) < 3e-5


def test_the_tail_of_few_placebos_is_no_rarer_than_it_says():
    """Exponential scores beside 100 placebos, ten of them in the tail: 2 in 1000 are below 0.002, not twice as many."""
    rng, level, draws = np.random.default_rng(5), 0.002, 20_000
    found = [(float(rng.exponential()), rng.exponential(size=100)) for _ in range(draws)]
    plug_in, predictive = (
        np.mean([neg_log_rank(score, placebos, independent=n) > -np.log(level) for score, placebos in found])
        for n in (np.inf, 100.0)
    )
    assert plug_in > 2 * level
    assert predictive == pytest.approx(level, abs=3 * np.sqrt(level / draws))
