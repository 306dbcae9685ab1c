from __future__ import annotations

import numpy as np
import pytest

from srbval.plan.calibrated import LEAST_SCENES, margin, margins, shipped_calibration

# A margin is meant to be exceeded by one scene in hundreds.
ONE_IN_HUNDREDS = 0.003
LITTLE = 0.03  # four deviations of ratios that scatter by one per cent


def test_a_margin_covers_what_was_seen_and_is_no_discount() -> None:
    assert margin([0.2, 0.5, 0.9]) >= 1.0
    assert margin([0.1] * 10) == 1.0
    assert margin([0.5, 1.0, 7.0]) >= 7.0


def test_a_margin_of_scattered_errors_reaches_beyond_what_was_seen() -> None:
    """Of a lognormal ratio one scene in some hundreds lies beyond it."""
    random = np.random.default_rng(3)
    spread = 0.5
    found = [margin(np.exp(spread * random.standard_normal(24))) for _ in range(200)]
    assert np.exp(3.0 * spread) < np.median(found) < np.exp(5.0 * spread)
    beyond = [(np.exp(spread * random.standard_normal(1000)) > one).mean() for one in found]
    assert np.mean(beyond) < ONE_IN_HUNDREDS


def test_errors_that_scatter_little_need_little() -> None:
    assert margin([1.0, 1.01, 0.99, 1.02] * 6) == pytest.approx(1.04, abs=LITTLE)


def test_margins_of_the_shipped_table_are_per_fit_rung_and_question() -> None:
    table = shipped_calibration()
    found = margins(table)
    assert {key[0] for key in found} == {"play", "printed"}
    assert all(factor >= 1.0 for factor in found.values())
    assert margins(table) is found, "read once"
    assert len(table.between) >= LEAST_SCENES
