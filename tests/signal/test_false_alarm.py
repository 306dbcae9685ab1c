import numpy as np
import pytest
import scipy.stats

from srbval.bench.reading import ReadingSettings, run_reading_bench
from srbval.signal.false_alarm import evidence, false_alarm, upcrossings

BINS = 65
# 200,000 draws at a tail of a few per mille: five standard errors.
DRAWS, TAIL_FACTOR = 200_000, 1.2
# 400 records at a nominal 10 %: two binomial standard errors about 0.86 to 1.
RECORDS, LOWEST, HIGHEST = 400, 0.56, 1.3


def test_evidence_is_the_exact_tail_of_a_line_over_a_median_of_its_neighbours():
    rng = np.random.default_rng(1)
    mean = np.median(rng.exponential(size=(DRAWS, BINS)), axis=1) / np.log(2)
    ratio = rng.exponential(size=DRAWS) / mean
    for level in (2.0, 6.0):
        chance = np.exp(-evidence(np.array([level]), np.array([BINS]))[0])
        assert 1 / TAIL_FACTOR < np.mean(ratio > level) / chance < TAIL_FACTOR
    # The mistake of taking the mean noise for known: at 12 times the noise twice too sure.
    assert np.exp(-evidence(np.array([12.0]), np.array([BINS]))[0]) > 2 * np.exp(-12.0)


def test_comb_is_the_gamma_tail_and_the_count_of_rises_above_it():
    tail = scipy.stats.gamma.sf(25.0, 5)
    crossings = upcrossings(25.0, 5, 1.0, 10.0)
    assert false_alarm(25.0, 5, 1.0, 10.0) == pytest.approx(1 - (1 - tail) * np.exp(-crossings), rel=1e-9)


def test_one_line_rises_as_often_as_rice_says():
    level, half_hz, seconds = 9.0, 1.5, 8.0
    expected = 2 * half_hz * seconds * np.sqrt(np.pi * level / 3) * np.exp(-level)
    assert upcrossings(level, 1, half_hz, seconds) == pytest.approx(expected, rel=1e-12)


def test_no_evidence_is_a_certain_false_alarm_and_strong_evidence_does_not_underflow_to_nonsense():
    assert false_alarm(0.0, 5, 1.0, 10.0) == 1.0
    assert 0.0 <= false_alarm(1e4, 5, 1.0, 10.0) < 1e-300


def test_a_wider_search_finds_more_in_noise():
    """A peak is always found: without the trials factor noise would pass at several times the stated rate."""
    narrow, wide = (false_alarm(22.0, 5, w, 10.0) for w in (0.1, 1.0))
    assert wide > 8 * narrow


def test_noise_alone_raises_false_alarms_at_the_nominal_rate():
    settings = ReadingSettings(
        trials=2, noise_records=RECORDS, seconds=(10.0,), snr_db=(25.0,), jitter=(0.0,), timed=False
    )
    rows = run_reading_bench(settings, seed=3).false_alarms
    assert {(r.noise, r.harmonics) for r in rows} == {(n, h) for n in ("white", "coloured") for h in (1, 5)}
    for row in rows:
        if row.nominal == 0.1:
            assert LOWEST < row.ratio < HIGHEST
