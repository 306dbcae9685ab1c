"""The least error of a frequency, against the smallest that an estimator really makes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from srbval.signal.cramer_rao import frequency_error_hz


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
    assert np.std(found) == pytest.approx(frequency_error_hz(information, count / fs_hz), rel=0.06)


def test_without_information_nothing_is_known() -> None:
    assert frequency_error_hz(0.0, 10.0) == math.inf
