"""Sizes found of simulated truth: what is counted, and that intervals cover it wherever the defect lies."""

from types import SimpleNamespace
from typing import Any

import pytest

from srbval.bearing import Fault
from srbval.path.defect_size import LEVEL_U_DB
from srbval.progress import silent
from srbval.studies.simulated_truth.study import EXTENTS_MM, PLACES, counted, sizes

LEAST_COVERED = 0.9


def found(fault: Fault, true_mm: float, size: tuple[float, float | None, float | None]) -> Any:
    extent_m, low_m, high_m = size
    one = SimpleNamespace(extent_m=extent_m, low_m=low_m, high_m=high_m)
    return fault, true_mm, SimpleNamespace(sizes=dict.fromkeys(LEVEL_U_DB, one))


def test_sizes_are_counted_by_fault_size_and_way() -> None:
    rows = list(counted([
        found(Fault.OUTER, 2.0, (2.2e-3, 1.9e-3, 2.5e-3)),  # near, covered
        found(Fault.OUTER, 2.0, (2.6e-3, 2.1e-3, 3.2e-3)),  # far, not covered
        found(Fault.INNER, 1.0, (1.0e-3, None, 1.3e-3)),  # a limit alone: covered, not resolved
        found(Fault.INNER, 1.0, (1.0e-3, 0.9e-3, 1.1e-3)),
    ]))  # fmt: skip
    assert len(rows) == 3 * len(LEVEL_U_DB)
    names = ("fault", "true mm", "truths", "covered", "resolved", "within 20 %")
    assert [rows[0][name] for name in names] == [Fault.OUTER, 2.0, 2, 1, 2, 1]
    assert [rows[2][name] for name in names] == ["all", "all", 4, 3, 3, 3]
    assert rows[1]["to mm"] == pytest.approx(1.2)


@pytest.mark.long_form
def test_intervals_of_three_sizes_at_five_places_cover_them() -> None:
    rows = [row for row in sizes(silent)["rows"] if row["fault"] == "all"]
    assert {row["truths"] for row in rows} == {2 * len(EXTENTS_MM) * len(PLACES)}
    assert min(row["covered"] / row["truths"] for row in rows) >= LEAST_COVERED
