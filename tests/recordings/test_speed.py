"""Shaft speed from a tachometer: mean, interval, drift."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from srbval.errors import DataError
from srbval.recordings.speed import correlated_samples, nominal_speed, stated_speed, tachometer_speed

# Lags before the first zero of the autocorrelation, of some 1 / sqrt(100,000) = 0.003 each.
WHITE = 0.05
# 400,000 samples hold 21,000 independent ones; the cut at the first zero adds some per cent.
CORRELATED = 0.15
# The mean of 16 repeated samples is the sample: only rounding is left.
SAME_PROCESS = 1e-9
# Quarters of 1000 samples of a ramp of 1 Hz.
RAMP_HZ = 1e-3
# 200 intervals: 88 to 99 %.
COVERED = (176, 198)


def correlated(rng: np.random.Generator, n: int, keep: float) -> np.ndarray:
    return lfilter([np.sqrt(1 - keep**2)], [1, -keep], rng.normal(0, 1, n + 2000))[2000:]


def test_white_samples_count_one_each() -> None:
    assert correlated_samples(np.random.default_rng(0).normal(0, 1, 100_000)) == pytest.approx(1.0, abs=WHITE)


def test_first_order_noise_has_its_known_correlation_time() -> None:
    """Sum of the autocorrelation of a first-order process: (1 + a) / (1 - a)."""
    found = correlated_samples(correlated(np.random.default_rng(1), 400_000, 0.9))
    assert found == pytest.approx(19.0, rel=CORRELATED)


def test_interval_covers_the_truth() -> None:
    """200 smoothed tachometer signals about 14.3 Hz: 95 % intervals must cover in 88 to 99 % of them.

    With the correlation ignored they would cover in some 30 %.
    """
    rng = np.random.default_rng(2)
    covered = 0
    for _ in range(200):
        speed = tachometer_speed(14.3 + 0.01 * correlated(rng, 4000, 0.95))
        covered += abs(speed.value_hz - 14.3) < speed.ci95_hz
    assert COVERED[0] <= covered <= COVERED[1]


def test_long_signal_gives_the_interval_of_the_short_one() -> None:
    """The same process sampled 16 times faster: the interval of the mean must not shrink."""
    slow = correlated(np.random.default_rng(3), 8000, 0.9)
    fast = np.repeat(slow, 16)
    assert tachometer_speed(14 + 0.01 * fast).ci95_hz == pytest.approx(
        tachometer_speed(14 + 0.01 * slow).ci95_hz, rel=SAME_PROCESS
    )


def test_drift_and_direction() -> None:
    up = tachometer_speed(np.linspace(10, 11, 1000))
    assert (up.value_hz, up.drift_hz) == (pytest.approx(10.5), pytest.approx(0.75, abs=RAMP_HZ))
    back = tachometer_speed(-np.linspace(10, 11, 1000))
    assert (back.value_hz, back.drift_hz) == (pytest.approx(10.5), pytest.approx(0.75, abs=RAMP_HZ))


def test_constant_signal_has_no_spread() -> None:
    assert tachometer_speed(np.full(100, 14.0)).ci95_hz == 0


@pytest.mark.parametrize("signal", [np.zeros(100), np.full(100, 1e5), np.ones(3)])
def test_what_is_no_shaft_speed(signal: np.ndarray) -> None:
    with pytest.raises(DataError, match="speed signal"):
        tachometer_speed(signal)


def test_stated_and_nominal() -> None:
    assert stated_speed(1797, 1.0).ci95_hz == pytest.approx(1 / 60)
    assert nominal_speed(1500, 1.5).ci95_hz == pytest.approx(0.375)
    with pytest.raises(DataError, match="must be above 0"):
        stated_speed(0, 1.0)
