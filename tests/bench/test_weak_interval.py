"""The calibration of weak lines' intervals: few records, the same code."""

import numpy as np
import pytest

from srbval.bench import weak_interval
from srbval.bench.weak_interval import coverage, drawn
from srbval.signal.interval import slip_interval, weak_factor


def test_draws_are_of_weak_lines_and_more_jitter_is_less_steady(monkeypatch):
    monkeypatch.setattr(weak_interval, "RECORDS", 6)
    steady, slipping = (drawn((10.0, weak_interval.COMBS[0], jitter)) for jitter in (0.0, 0.01))
    assert steady.shape[0] == slipping.shape[0] == 3
    assert steady.shape[1] == 6
    assert steady[1].mean() > slipping[1].mean()
    assert slipping[2].mean() > steady[2].mean() > 1


def test_coverage_is_counted_with_the_factors_that_readings_take():
    """Errors just inside and just outside of what `weak_factor` allows at the same steadiness and width."""
    table = slip_interval()
    logs = np.log([*table.weak_factor, *table.wide_factor])
    edge = weak_factor(0.2, 3.0)
    inside, outside = (np.array([[share * edge], [0.2], [3.0]]) for share in (0.99, 1.01))
    assert coverage(logs, inside, 1e-6) == pytest.approx(1.0)
    assert coverage(logs, outside, 1e-6) == pytest.approx(0.0)
