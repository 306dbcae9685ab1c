"""Intervals of a line's frequency: the least error in noise, and coverage where slip adds to it."""

import math

import numpy as np
import pytest

from srbval.signal import frequency_error_hz
from srbval.signal.interval import half_width
from srbval.signal.slip import RATIOS, modes_of, weigh

BLOCKS, DRAWS = 96, 4000
# What the stated 95 % has to cover for every slip, and three standard errors of the draws at its ends.
LEAST, MOST = 0.92 - 0.013, 0.98 + 0.007
# The standard deviation of 2000 draws is known to 1.6 %: four of these.
SCATTER = 0.06


def covered(ratio, rng):
    """Share of drawn phase paths whose slope, truly zero, lies within the interval."""
    modes = modes_of(BLOCKS)
    step = np.sqrt(ratio * modes.walk_over_noise)
    phase = rng.standard_normal((DRAWS, BLOCKS)) + step * np.cumsum(rng.standard_normal((DRAWS, BLOCKS)), axis=1)
    inside = 0
    for path in phase:
        residual = modes.contrasts @ path
        weight, _ = weigh(residual, modes.share)
        slope = modes.slope @ path - modes.carried(weight) @ residual
        half = np.sqrt(modes.slope_variance) * half_width(float(weight @ np.log1p(RATIOS)), BLOCKS, np.inf)
        inside += abs(slope) < half
    return inside / DRAWS


def test_interval_covers_whatever_the_slip_is_beside_the_noise():
    """A slip as large as the noise is the hard case: neither the noise's interval nor the posterior's covers there."""
    rng = np.random.default_rng(1)
    for ratio in (0.0, 1.0, 5.0, 15.0, 50.0, 1000.0):
        assert LEAST < covered(ratio, rng) < MOST, ratio


def test_a_maximum_likelihood_fit_of_one_tone_has_this_error() -> None:
    """The peak of the periodogram, which is efficient well above the threshold, over 2000 records."""
    rng = np.random.default_rng(8)
    count, fs_hz, line_hz, amplitude = 1000, 100.0, 12.3, 0.5
    time_s = np.arange(count) / fs_hz
    offsets_hz = np.linspace(-0.4, 0.4, 81) * fs_hz / count
    waves = np.exp(-2j * np.pi * np.outer(line_hz + offsets_hz, time_s))
    phase = rng.uniform(0, 2 * math.pi, (2000, 1))
    records = amplitude * np.cos(2 * math.pi * line_hz * time_s + phase) + rng.standard_normal((2000, count))
    power = np.abs(records @ waves.T) ** 2
    top = np.clip(np.argmax(power, axis=1), 1, offsets_hz.size - 2)
    left, middle, right = (power[np.arange(2000), top + k] for k in (-1, 0, 1))
    found = offsets_hz[top] + 0.5 * (left - right) / (left - 2 * middle + right) * (offsets_hz[1] - offsets_hz[0])
    information = count * amplitude**2 / 4  # peak of |X|^2 over its mean of noise: (N A / 2)^2 / N
    assert np.std(found) == pytest.approx(frequency_error_hz(information, count / fs_hz), rel=SCATTER)
