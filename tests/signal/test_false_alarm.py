import numpy as np
import pytest

from srbval.signal.false_alarm import false_alarm, neg_log_p, true_noise_ratio, upcrossings

BINS = 65
ONE, FIVE = np.eye(2)[1], np.eye(6)[5]  # all lines of the comb are seen in all of the window
# 200,000 draws at a tail of a few per mille: five standard errors.
DRAWS, TAIL_FACTOR = 200_000, 1.2
# Some 500 rises, whose number scatters a little more than a Poisson one.
RISES, RISE_SCATTER = 1500, 0.15
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


def test_comb_rises_as_often_as_a_count_of_drawn_spectra():
    """Spectra of noise alone, their true level known: the mean number of rises above a level in the window."""
    rng = np.random.default_rng(2)
    half_hz, seconds, level, harmonics = 0.5, 8.0, 6.0, 2
    sample_s = np.arange(-160, 160) * seconds / 320
    offset_hz = np.linspace(-half_hz, half_hz, 161)
    transforms = [np.exp(-2j * np.pi * number * np.outer(offset_hz, sample_s)) for number in range(1, harmonics + 1)]
    rises = 0
    for _ in range(RISES):
        comb = np.zeros(offset_hz.size)
        for transform in transforms:
            noise = (rng.standard_normal(320) + 1j * rng.standard_normal(320)) / np.sqrt(640)
            comb += np.abs(transform @ noise) ** 2
        rises += np.count_nonzero((comb[:-1] <= level) & (comb[1:] > level))
    expected = upcrossings(level, level, harmonics, half_hz, seconds)
    assert rises / RISES == pytest.approx(expected, rel=RISE_SCATTER)


def test_a_zero_neg_log_p_is_a_certain_false_alarm_and_a_large_one_does_not_underflow():
    assert false_alarm(0.0, 0.0, FIVE, 1.0, 10.0) == 1.0
    assert 0.0 <= false_alarm(1e4, 1e4, FIVE, 1.0, 10.0) < 1e-300
