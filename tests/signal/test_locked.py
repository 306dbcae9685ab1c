"""Power that repeats with a passage, a tone, and the envelope's record with its noise."""

import numpy as np
import pytest

from srbval.errors import DataError
from srbval.signal import NORMAL_95, Periodogram
from srbval.signal.locked import locked_mean, steady_tone

PASSAGES, PER_PASSAGE, BLOCKS = 200, 20, 10
PERIODS = (np.arange(PASSAGES * PER_PASSAGE) + 0.5) / PER_PASSAGE
RAISED = np.where(PERIODS % 1.0 < 0.3, 1.0, 0.0)
TRIALS = 400


def noise(random: np.random.Generator) -> np.ndarray:
    """Squares of a complex normal variable: those of a band's analytic signal, mean one."""
    return random.exponential(size=PERIODS.size)


def test_a_known_power_is_the_mean_less_the_quiet_level():
    found = locked_mean(2.0 * RAISED + 5.0, PERIODS, BLOCKS)
    assert found.value == pytest.approx(0.6)
    assert locked_mean(5.0 - 2.0 * RAISED, PERIODS, BLOCKS).value == pytest.approx(1.4), "a dip is quieter, not louder"


def test_noise_alone_has_no_locked_power_and_is_rarely_shown():
    """The least of noisy means, taken in the same passages, would be below their mean in every trial."""
    random = np.random.default_rng(1)
    found = [locked_mean(noise(random), PERIODS, BLOCKS) for _ in range(TRIALS)]
    values = np.array([one.value for one in found])
    assert abs(values.mean()) < 2.5 * values.std() / np.sqrt(TRIALS)
    assert np.mean([one.value > one.ci95 for one in found]) < 0.05  # one side of 95 %


@pytest.mark.parametrize("strength", [0.5, 3.0])
def test_the_interval_holds_as_often_as_it_says(strength):
    random = np.random.default_rng(2)
    found = [locked_mean((strength * RAISED + 1.0) * noise(random), PERIODS, BLOCKS) for _ in range(TRIALS)]
    inside = [abs(one.value - 0.3 * strength) <= one.ci95 for one in found]
    assert np.mean(inside) > 0.92  # 95 % and more, by three deviations of as many trials
    assert np.mean([one.ci95 for one in found]) < 2.5 * NORMAL_95 * np.std([one.value for one in found])


def test_a_tone_is_read_where_the_passage_is_quiet():
    """A passage excites the tone's own frequency too; a mean over the whole phase would take both for the tone."""
    amplitude, slip = 0.5 - 0.2j, 1.5
    over = np.arange(PERIODS.size) / PERIODS.size
    passages = 2.0 * np.sin(np.pi * (PERIODS % 1.0) / 0.3) * RAISED * np.exp(2j * np.pi * 15 * PERIODS)
    tone = amplitude * np.exp(2j * np.pi * (15 * PERIODS + slip * over))
    for signal, periods in ((passages + tone, PERIODS), (tone, None)):
        assert steady_tone(signal, 15 * PERIODS, periods, 4.0) == pytest.approx((amplitude, slip))
    assert abs(steady_tone(passages, 15 * PERIODS, PERIODS, 4.0)[0]) < 1e-12
    assert abs(steady_tone(passages, 15 * PERIODS, None, 4.0)[0]) > 0.3


def test_too_few_passages_are_refused():
    with pytest.raises(DataError, match=r"9\.95 passages .* needs 16"):
        locked_mean(RAISED[:200], PERIODS[:200], BLOCKS)


FS_HZ = 20_000.0
SHAFT_HZ = 14.3
# The median of 64 exponential bins scatters by 1/sqrt(64)/ln 2, 18 %; four of these.
NOISE_SCATTER = 0.72
# Linear interpolation between eighths of a bin, at the top of a line.
INTERPOLATION = 0.02
# Ripple of the decimation filter.
DEPTH = 0.01


def record_of(samples, limit_hz=900.0, shaft_ci_hz=0.0):
    return Periodogram.of(samples, FS_HZ, limit_hz=limit_hz, shaft_hz=SHAFT_HZ, shaft_ci_hz=shaft_ci_hz)


def test_reduced_record_keeps_a_tone_and_its_place():
    time_s = np.arange(40_000) / FS_HZ
    record = record_of(5.0 + 2.0 * np.cos(2 * np.pi * 321.4 * time_s))
    assert record.fs_hz < FS_HZ / 4
    assert record.depth_at(321.4) == pytest.approx(2.0 / 5.0, rel=DEPTH)
    at = np.array([321.4])
    assert record.power_at(at) == pytest.approx(record.exact_power_at(at), rel=INTERPOLATION)


def test_noise_mean_is_that_of_the_bins_and_ignores_lines_among_them():
    rng = np.random.default_rng(4)
    samples = rng.standard_normal(40_000)
    time_s = np.arange(samples.size) / FS_HZ
    clean = record_of(samples).noise_near(200.0, 2.0).mean_power
    lines = samples + sum(0.1 * np.cos(2 * np.pi * f * time_s) for f in (195.3, 206.1, 209.0))
    reduced = record_of(samples)
    # White noise of unit variance at the full rate keeps its density, so its variance falls with the rate.
    expected = reduced.samples.size * reduced.fs_hz / FS_HZ
    assert clean == pytest.approx(expected, rel=NOISE_SCATTER)
    # Three lines of a hundred times the noise would raise the plain mean of 64 bins about fivefold.
    assert record_of(lines).noise_near(200.0, 2.0).mean_power < 2 * clean


def test_shaft_harmonics_are_masked_and_wider_with_an_uncertain_speed():
    samples = np.random.default_rng(5).standard_normal(40_000)
    at = np.array([8 * SHAFT_HZ, 8 * SHAFT_HZ + 1.2, 8 * SHAFT_HZ + 5.0])
    assert record_of(samples).masked(at).tolist() == [True, False, False]
    assert record_of(samples, shaft_ci_hz=0.1).masked(at).tolist() == [True, True, False]


def test_too_short_a_record_to_know_its_noise_is_refused():
    record = record_of(np.random.default_rng(7).standard_normal(400), limit_hz=100.0)
    with pytest.raises(DataError, match="longer record"):
        record.noise_near(50.0, 60.0)
