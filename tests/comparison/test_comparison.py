from __future__ import annotations

import pytest

from srbval.bearing import Fault
from srbval.comparison.comparison import ComparisonVerdict, QuantityValue
from srbval.comparison.table6 import RigSource, Table6Row, line_comparison
from srbval.reading.lines import Line
from srbval.reading.sum_rule import SumRule

ROUNDING_PCT = 1e-12  # sums of exact numbers

LINE = Line(name="BPFO", harmonic=1, kinematic_hz=100.0, found_hz=100.1)


def row(model_hz: float = 100.3, rig_ci95_hz: float | None = 0.02) -> Table6Row:
    made = line_comparison(
        Fault.OUTER,
        "record",
        QuantityValue(value=model_hz, ci95=0.01),
        QuantityValue(value=100.1, ci95=rig_ci95_hz, line=LINE),
        {"a": 0.03, "b": 0.04},
    )
    return Table6Row(comparison=made, rig_source=RigSource.MEASURED, shaft_rpm=858.0, model_cage_hz=model_hz)


def test_error_is_model_minus_rig() -> None:
    assert row().comparison.error == pytest.approx(100 * 0.2 / 100.1)
    assert row().model_deviation_pct == pytest.approx(0.3)
    assert row().rig_deviation_pct == pytest.approx(0.1)


def test_uncertainty_is_the_root_sum_of_squares() -> None:
    assert row().comparison.uncertainty == pytest.approx(0.05)


def test_verdicts() -> None:
    assert row().comparison.verdict is ComparisonVerdict.RESOLVED
    assert row(model_hz=100.14).comparison.verdict is ComparisonVerdict.UNDECIDED
    assert row(rig_ci95_hz=None).comparison.verdict is ComparisonVerdict.INSUFFICIENT


def pair(bpfo_hz: float, bpfi_hz: float, ci95: float | None = None) -> SumRule:
    """Both race lines of 19 rollers, read at 600 rpm."""
    return SumRule(
        source="x", origin="measured", rolling_elements=19, bpfo_order=bpfo_hz / 10, bpfi_order=bpfi_hz / 10,
        ci95=ci95, stated_rpm=600.0,
    )  # fmt: skip


def test_the_sum_is_blind_to_slip_and_sees_speed() -> None:
    exact = pair(81.0, 109.0)
    slipped = pair(80.0, 110.0)
    slower = pair(80.19, 107.91)
    assert exact.difference_pct == pytest.approx(0.0, abs=ROUNDING_PCT)
    assert slipped.difference_pct == pytest.approx(0.0, abs=ROUNDING_PCT)
    assert slower.implied_rpm == pytest.approx(0.99 * 600)
    assert exact.closed is None


def test_a_sum_closes_within_its_uncertainty() -> None:
    assert pair(81.01, 109.0, ci95=0.005).closed is True
    assert pair(81.01, 109.0, ci95=0.0005).closed is False
