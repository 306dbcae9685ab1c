"""The timed arithmetic computes what it should, so that no compiler can skip it."""

import numpy as np
import pytest

from srbval.studies.machine import FACTOR, LENGTH, SUMMAND, calibrate, expected_sum, multiply_adds

# The kernel may contract its products and reorder its sum: some hundred roundings of 1e-16 each.
SUM_ROUNDING = 1e-12
# The closed form takes differences from one of a power with up to 1000 factors.
SERIES_ROUNDING = 1e-10


@pytest.mark.parametrize("sweeps", [1, 2, 1000])
def test_sum_is_that_of_the_geometric_series(sweeps: int) -> None:
    x = 0.0
    for _ in range(sweeps):
        x = FACTOR * x + SUMMAND
    found = multiply_adds(np.zeros(LENGTH), FACTOR, SUMMAND, sweeps)
    assert found == pytest.approx(LENGTH * x, rel=SUM_ROUNDING)
    assert found == pytest.approx(expected_sum(sweeps), rel=SERIES_ROUNDING)


def test_calibration_is_a_positive_time_of_the_right_sum() -> None:
    found = calibrate(repeats=2)
    assert found["right"]
    assert 0 < found["seconds"] <= found["median_s"]
