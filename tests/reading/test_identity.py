"""The probability that a found peak is the line: from the slip prior and how strong it is, not from the window."""

import numpy as np
import pytest

from srbval.bearing import LARGEST_SLIP
from srbval.reading.families import SLIP_FREEDOM, SLIP_SPREAD, identity_probability
from srbval.reading.lines import LEAST_IDENTITY
from srbval.signal import LineReading

HALF, LINE_HZ = 0.01, 100.0


def probability(
    deviation: float, speed_ci95: float, chance: float, *, half: float = HALF, largest_slip: float = LARGEST_SLIP
) -> float:
    reading = LineReading(
        found_hz=LINE_HZ * (1 + deviation),
        ci95_hz=0.0,
        snr=(20.0,),
        noise_false_alarm=chance,
        half_window_hz=half * LINE_HZ,
        isolated=True,
        depth=0.1,
        resolution_hz=0.1,
    )
    return identity_probability(reading, LINE_HZ, speed_ci95, chance, largest_slip)


def test_probability_is_the_share_of_lines_whatever_they_slip() -> None:
    """Lines by the prior, others anywhere, equally strong: of those called p a share p are lines, far off too."""
    rng, count = np.random.default_rng(3), 2000
    slips = SLIP_SPREAD * rng.standard_t(SLIP_FREEDOM, 2 * count)
    slips = slips[np.abs(slips) < HALF][:count]
    places = np.concatenate((slips, rng.uniform(-HALF, HALF, count)))
    is_line = np.arange(2 * count) < count
    called = np.array([probability(float(d), 0.0, 1.0) for d in places])
    for low, high in ((0.0, 0.05), (0.05, 0.1), (0.1, 0.3), (0.3, 0.6), (0.6, 0.8), (0.8, 1.0)):
        group = (called >= low) & (called < high)
        scatter = 0.5 / np.sqrt(group.sum())
        assert np.mean(is_line[group]) == pytest.approx(np.mean(called[group]), abs=4 * scatter)


def test_further_off_or_weaker_is_less_probable_and_an_unsure_speed_says_less() -> None:
    near, far = (probability(d, 1e-4, 1e-4) for d in (0.001, 0.006))
    assert near > 0.99 > LEAST_IDENTITY > probability(0.0095, 1e-4, 1e-4)
    assert near > far > probability(0.006, 1e-4, 1e-2)
    assert probability(0.0095, 2e-2, 1e-4) > 0.99
    assert probability(-0.006, 1e-4, 1e-4) == pytest.approx(far)
