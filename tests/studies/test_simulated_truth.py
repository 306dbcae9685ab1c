"""Sizes found of simulated truth: what is counted, and paths that are known or drawn."""

from types import SimpleNamespace
from typing import Any

import pytest

from srbval.bearing import Fault
from srbval.studies.simulated_truth.study import WAYS, counted


def found(fault: Fault, true_m: float, size: tuple[float, float | None, float | None]) -> Any:
    extent_m, low_m, high_m = size
    one = SimpleNamespace(extent_m=extent_m, low_m=low_m, high_m=high_m)
    return "known", fault, true_m, SimpleNamespace(sizes=dict.fromkeys(WAYS, one))


def test_sizes_are_counted_by_fault_and_way() -> None:
    rows = list(counted([
        found(Fault.OUTER, 2e-3, (2.2e-3, 1.9e-3, 2.5e-3)),  # near, covered
        found(Fault.OUTER, 2e-3, (2.6e-3, 2.1e-3, 3.2e-3)),  # far, not covered, and does not reject 1.5 times
        found(Fault.INNER, 1e-3, (1.0e-3, None, 1.3e-3)),  # a limit alone: covered, not resolved
        found(Fault.INNER, 1e-3, (1.0e-3, 0.9e-3, 1.1e-3)),
    ]))  # fmt: skip
    assert len(rows) == 3 * len(WAYS)
    outer, every = rows[0], rows[2 * len(WAYS)]
    assert [outer[k] for k in ("fault", "truths", "resolved", "within 20 %", "covered")] == [Fault.OUTER, 2, 2, 1, 1]
    assert outer["1.5 times rejected"] == 1
    assert outer["bias %"] == pytest.approx(100 * ((1.1 * 1.3) ** 0.5 - 1))
    assert [every[k] for k in ("fault", "truths", "resolved", "within 20 %", "covered")] == ["all", 4, 3, 2, 3]
