from __future__ import annotations

from dataclasses import replace

import pytest

from srbval.validation.comparison import Comparison, ComparisonVerdict, RigSource
from srbval.validation.sum_rule import sum_rule

ROW = Comparison(
    defect="outer",
    line="BPFO",
    shaft_rpm=858.0,
    kinematic_hz=100.0,
    model_hz=100.3,
    model_ci95_hz=0.01,
    model_cage_hz=100.3,
    rig_hz=100.1,
    rig_ci95_hz=0.02,
    rig_source=RigSource.MEASURED,
    uncertainty_parts_pct={"a": 0.03, "b": 0.04},
)


def test_error_is_model_minus_rig() -> None:
    assert ROW.comparison_error_pct == pytest.approx(100 * 0.2 / 100.1)
    assert ROW.model_deviation_pct == pytest.approx(0.3)
    assert ROW.rig_deviation_pct == pytest.approx(0.1)


def test_uncertainty_is_the_root_sum_of_squares() -> None:
    assert ROW.validation_uncertainty_pct == pytest.approx(0.05)


def test_verdicts() -> None:
    assert ROW.verdict is ComparisonVerdict.RESOLVED
    assert replace(ROW, model_hz=100.14).verdict is ComparisonVerdict.NOT_RESOLVED
    assert replace(ROW, rig_ci95_hz=None).verdict is ComparisonVerdict.INSUFFICIENT


def test_the_sum_is_blind_to_slip_and_sees_speed() -> None:
    exact = sum_rule("x", "measured", 19, bpfo_hz=81.0, bpfi_hz=109.0, outer_shaft_hz=10.0, inner_shaft_hz=10.0)
    slipped = sum_rule("x", "measured", 19, bpfo_hz=80.0, bpfi_hz=110.0, outer_shaft_hz=10.0, inner_shaft_hz=10.0)
    slower = sum_rule("x", "measured", 19, bpfo_hz=80.19, bpfi_hz=107.91, outer_shaft_hz=10.0, inner_shaft_hz=10.0)
    assert exact.difference_pct == pytest.approx(0.0, abs=1e-12)
    assert slipped.difference_pct == pytest.approx(0.0, abs=1e-12)
    assert slower.implied_rpm == pytest.approx(0.99 * 600)
    assert exact.closed is None


def test_a_sum_closes_within_its_uncertainty() -> None:
    pair = {"bpfo_hz": 81.01, "bpfi_hz": 109.0, "outer_shaft_hz": 10.0, "inner_shaft_hz": 10.0}
    assert sum_rule("x", "measured", 19, **pair, ci95=(0.003, 0.004)).closed is True
    assert sum_rule("x", "measured", 19, **pair, ci95=(0.0003, 0.0004)).closed is False
