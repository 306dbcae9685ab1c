import numpy as np
import pytest

from srbval.signal.false_alarm import false_alarm, neg_log_p, true_noise_ratio
from srbval.studies.reading_accuracy.study import ReadingSettings, run_reading_bench

BINS = 65
ONE, FIVE = np.eye(2)[1], np.eye(6)[5]  # all lines of the comb are seen in all of the window
# 200,000 draws at a tail of a few per mille: five standard errors.
DRAWS, TAIL_FACTOR = 200_000, 1.2
# 400 records at a nominal 10 %: three binomial standard errors about 0.93 to 0.97.
RECORDS, LOWEST, HIGHEST = 400, 0.5, 1.4
# Mean of four such rates, of which two and two are of the same records: three standard errors about 0.9.
LOWEST_MEAN, HIGHEST_MEAN = 0.625, 1.2
# Central difference of a relative step of 1e-5.
DERIVATIVE = 1e-6
# With 100,001 bins the sum differs from its limit by a term of the order of the ratio over the bins.
KNOWN_NOISE = 1e-3
# Nine bins leave the noise so uncertain that the ratio is less than this share of the estimated one.
FEW_BINS = 0.7


def test_neg_log_p_is_the_exact_tail_of_a_line_over_a_median_of_its_neighbours():
    rng = np.random.default_rng(1)
    mean = np.median(rng.exponential(size=(DRAWS, BINS)), axis=1) / np.log(2)
    ratio = rng.exponential(size=DRAWS) / mean
    for level in (2.0, 6.0):
        chance = np.exp(-neg_log_p(np.array([level]), np.array([BINS]))[0])
        assert 1 / TAIL_FACTOR < np.mean(ratio > level) / chance < TAIL_FACTOR
    # The mistake of taking the mean noise for known: at 12 times the noise twice too sure.
    assert np.exp(-neg_log_p(np.array([12.0]), np.array([BINS]))[0]) > 2 * np.exp(-12.0)


def test_true_noise_ratio_is_the_slope_of_neg_log_p_and_that_of_known_noise_with_many_bins():
    ratio, bins, step = 9.0, np.array([BINS]), 1e-5
    above, below = (neg_log_p(np.array([ratio * (1 + side * step)]), bins)[0] for side in (1, -1))
    assert true_noise_ratio(np.array([ratio]), bins)[0] == pytest.approx((above - below) / (2 * step), rel=DERIVATIVE)
    assert true_noise_ratio(np.array([ratio]), np.array([100_001]))[0] == pytest.approx(ratio, rel=KNOWN_NOISE)
    assert true_noise_ratio(np.array([ratio]), np.array([9]))[0] < FEW_BINS * ratio


def test_a_zero_neg_log_p_is_a_certain_false_alarm_and_a_large_one_does_not_underflow():
    assert false_alarm(0.0, 0.0, FIVE, 1.0, 10.0) == 1.0
    assert 0.0 <= false_alarm(1e4, 1e4, FIVE, 1.0, 10.0) < 1e-300


def test_noise_alone_raises_false_alarms_at_the_nominal_rate():
    settings = ReadingSettings(
        trials=2, noise_records=RECORDS, seconds=(10.0,), snr_db=(25.0,), jitter=(0.0,), timed=False
    )
    rows = run_reading_bench(settings, seed=3).false_alarms
    assert {(r.noise, r.harmonics) for r in rows} == {(n, h) for n in ("white", "coloured") for h in (1, 5)}
    tenth = [row.ratio for row in rows if row.nominal == 0.1]
    assert min(tenth) > LOWEST
    assert max(tenth) < HIGHEST
    assert LOWEST_MEAN < np.mean(tenth) < HIGHEST_MEAN
