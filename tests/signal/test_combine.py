import math

import numpy as np
import pytest

from srbval.errors import DataError
from srbval.signal import normalise, rotate_axes

ROUNDING = 1e-12


def test_motion_along_plus_45_degrees_is_seen_whole():
    motion = np.sin(np.arange(50.0))
    along = rotate_axes(motion / math.sqrt(2), motion / math.sqrt(2), math.pi / 4)
    np.testing.assert_allclose(along, motion, atol=ROUNDING)


def test_motion_along_minus_45_degrees_is_not_seen():
    motion = np.sin(np.arange(50.0))
    np.testing.assert_allclose(rotate_axes(motion, -motion, math.pi / 4), 0.0, atol=ROUNDING)


def test_quarter_turn_gives_the_second_axis():
    first, second = np.arange(4.0), np.array([3.0, 1.0, 4.0, 1.0])
    np.testing.assert_allclose(rotate_axes(first, second, math.pi / 2), second, atol=ROUNDING)


def test_axes_of_different_length_are_refused():
    with pytest.raises(DataError, match="3 and 4"):
        rotate_axes(np.zeros(3), np.zeros(4), 0.0)


def test_normalised_signal_has_mean_zero_and_spread_one():
    result = normalise(5.0 + 3.0 * np.random.default_rng(1).standard_normal(1000))
    assert abs(result.mean()) < ROUNDING
    assert result.std() == pytest.approx(1.0, abs=ROUNDING)


@pytest.mark.parametrize("samples", [np.full(100, 9.81), np.zeros(100), np.empty(0), np.array([1.0, np.nan])])
def test_signal_without_vibration_is_refused(samples):
    with pytest.raises(DataError):
        normalise(samples)
