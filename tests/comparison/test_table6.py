"""Table 6 of the paper: printed values and sum rule."""

from typing import Any

import pytest

from srbval.comparison.comparison import deviation_pct
from srbval.comparison.table6 import check_race_sum, table6

PRINTED_PCT = 0.01  # the paper prints its deviations with one or two digits, and 0.226 as 0.22
ROUNDING_PCT = 1e-12  # sums of exact numbers


def test_printed_deviations_are_those_of_the_printed_frequencies() -> None:
    for row in table6().values():
        assert deviation_pct(row.model_hz, row.kinematic_hz) == pytest.approx(row.model_printed_pct, abs=PRINTED_PCT)
        assert deviation_pct(row.rig_hz, row.kinematic_hz) == pytest.approx(row.rig_printed_pct, abs=PRINTED_PCT)


def test_the_sum_is_blind_to_slip_sees_speed_and_closes_within_its_uncertainty() -> None:
    def pair(bpfo_hz: float, bpfi_hz: float, ci95: float | None = None) -> dict[str, Any]:
        """Both race lines of 19 rollers, read at 600 rpm."""
        return check_race_sum("made", "simulated", 19, (bpfo_hz / 10, bpfi_hz / 10), ci95, 600.0)

    exact, slipped, slower = pair(81.0, 109.0), pair(80.0, 110.0), pair(80.19, 107.91)
    assert (exact["difference_pct"], slipped["difference_pct"]) == pytest.approx((0.0, 0.0), abs=ROUNDING_PCT)
    assert slower["implied_rpm"] == pytest.approx(0.99 * 600)
    orders = [row.rig_hz / (row.rpm / 60) for row in table6().values()]  # -1 % of the inner race is speed, not slip
    of_paper = check_race_sum("paper's rig", "published", 19, orders, None, 710.0)
    assert of_paper["implied_rpm"] == pytest.approx(706.6, abs=0.05)
    assert exact["closed"] is None
    assert [pair(81.01, 109.0, ci95)["closed"] for ci95 in (0.005, 0.0005)] == [True, False]
