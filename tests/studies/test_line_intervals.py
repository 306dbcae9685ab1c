"""The calibrations of the intervals of slipping and of weak lines: few records, the same code."""

from __future__ import annotations

import numpy as np
import pytest

from srbval.signal.interval import slip_interval, weak_factor
from srbval.studies.line_intervals import slip as slip_calibrator
from srbval.studies.line_intervals import weak as weak_calibrator

DRAWS, RECORDS = 500, 6
# What the table is calibrated to, and four standard errors of a share of so many draws: 4 sqrt(0.95 0.05 / 500).
COVERAGE = (0.92 - 0.04, 0.98 + 0.02)
SHARP = 1e-6  # width of the step from covered to not: none to speak of


@pytest.mark.parametrize("ratio", [0.0, 10.0, 1000.0])
def test_the_table_covers_fresh_draws_of_every_ratio(ratio: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slip_calibrator, "DRAWS", DRAWS)
    spread, error = slip_calibrator.drawn(ratio, np.random.default_rng(1))
    assert spread.shape == error.shape == (DRAWS,)
    assert COVERAGE[0] < slip_calibrator.coverage(slip_interval(), spread, error) <= COVERAGE[1]


def test_draws_are_of_weak_lines_and_more_jitter_is_less_steady() -> None:
    cells = [(10.0, weak_calibrator.COMBS[0], jitter) for jitter in (0.0, 0.01)]
    steady, slipping = (weak_calibrator.drawn(cell, RECORDS) for cell in cells)
    assert steady.shape == (3, RECORDS)
    assert slipping.shape[0] == 3
    assert steady[1].mean() > slipping[1].mean()
    assert slipping[2].mean() > steady[2].mean() > 1


def test_coverage_is_counted_with_the_factors_that_readings_take() -> None:
    """Errors just inside and just outside of what `weak_factor` allows at the same steadiness and width."""
    table = slip_interval()
    logs = np.log([*table.weak_factor, *table.wide_factor])
    edge = weak_factor(0.2, 3.0)
    inside, outside = (np.array([[share * edge], [0.2], [3.0]]) for share in (0.99, 1.01))
    assert weak_calibrator.coverage(logs, inside, SHARP) == pytest.approx(1.0)
    assert weak_calibrator.coverage(logs, outside, SHARP) == pytest.approx(0.0)
