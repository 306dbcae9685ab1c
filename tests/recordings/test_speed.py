"""Shaft speed from a tachometer: mean, interval, drift."""

from __future__ import annotations

import numpy as np
import pytest

from srbval.errors import DataError
from srbval.recordings import speed as speed_module
from srbval.recordings.speed import SCALE_CI95, nominal_speed, stated_speed, tachometer_speed

# Ten whole waves, sampled 400 times each, and a sensor without noise.
SPREAD = 0.01
# Quarters of 1000 samples of a ramp of 1 Hz.
RAMP_HZ = 1e-3
# 200 intervals: 88 to 99 %.
COVERED = (176, 198)


def test_the_shaft_s_own_variation_is_no_error_of_the_record_s_mean() -> None:
    """A wave of half a per cent, well sampled: the mean of what was is known to the clocks alone."""
    wave = 14.3 * (1 + 0.005 * np.sin(2 * np.pi * 5 * np.arange(4096) / 2048))
    speed = tachometer_speed(wave)
    assert speed.spread_hz == pytest.approx(0.005 * 14.3 / np.sqrt(2), rel=SPREAD)
    assert speed.ci95_hz == pytest.approx(SCALE_CI95 * 14.3, rel=SPREAD)


def test_sensor_noise_is_an_error_of_the_mean(monkeypatch: pytest.MonkeyPatch) -> None:
    """200 noisy signals of a shaft that varies: the interval covers the mean of what the shaft did."""
    monkeypatch.setattr(speed_module, "SCALE_CI95", 0.0)
    rng = np.random.default_rng(2)
    shaft = 14.3 + 0.05 * np.sin(np.linspace(0, 20, 4000))
    covered = 0
    for _ in range(200):
        speed = tachometer_speed(shaft + rng.normal(0, 0.01, shaft.size))
        covered += abs(speed.value_hz - shaft.mean()) < speed.ci95_hz
    assert COVERED[0] <= covered <= COVERED[1]


def test_drift_and_direction() -> None:
    up = tachometer_speed(np.linspace(10, 11, 1000))
    assert (up.value_hz, up.drift_hz) == (pytest.approx(10.5), pytest.approx(0.75, abs=RAMP_HZ))
    back = tachometer_speed(-np.linspace(10, 11, 1000))
    assert (back.value_hz, back.drift_hz) == (pytest.approx(10.5), pytest.approx(0.75, abs=RAMP_HZ))


def test_constant_signal_is_sure_to_its_clocks() -> None:
    speed = tachometer_speed(np.full(100, 14.0))
    assert (speed.ci95_hz, speed.spread_hz) == (pytest.approx(14 * SCALE_CI95), 0)


@pytest.mark.parametrize("signal", [np.zeros(100), np.full(100, 1e5), np.ones(3)])
def test_what_is_no_shaft_speed(signal: np.ndarray) -> None:
    with pytest.raises(DataError, match="speed signal"):
        tachometer_speed(signal)


def test_stated_and_nominal() -> None:
    assert stated_speed(1797, 1.0).ci95_hz == pytest.approx(1 / 60)
    assert nominal_speed(1500, 1.5).ci95_hz == pytest.approx(0.375)
    with pytest.raises(DataError, match="must be above 0"):
        stated_speed(0, 1.0)
