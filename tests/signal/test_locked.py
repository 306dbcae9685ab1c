"""What repeats with a passage: known means over its phase, noise that adds nothing, intervals that hold, a tone."""

import numpy as np
import pytest

from srbval.errors import DataError
from srbval.signal import NORMAL_95
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
