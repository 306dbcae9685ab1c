"""A tall peak of an envelope spectrum that nothing names is told; what the shaft or a line explains is not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from srbval.validation.shown_record import ShownRecord

SHAFT_HZ, LINE_HZ = 14.0, 117.3


def record(*peaks: tuple[float, float]) -> ShownRecord:
    """A spectrum of the line, one standard deviation high, and `peaks` (frequency [Hz], height)."""
    frequency = np.arange(1200) * 0.5
    amplitude = np.full(1200, 0.01)
    for hz, height in ((LINE_HZ, 1.0), *peaks):
        amplitude[round(hz / 0.5)] = height
    analysis: Any = SimpleNamespace(speed=SimpleNamespace(value_hz=SHAFT_HZ))
    nothing = np.zeros(1)
    return ShownRecord(
        analysis=analysis, time_s=nothing, acceleration=nothing, envelope=nothing, frequency_hz=frequency,
        amplitude=amplitude, peaks=(("BPFO", LINE_HZ, 1.0),), power_hz=nothing, power_db=nothing,
    )  # fmt: skip


def test_a_tall_peak_without_a_name_is_told() -> None:
    assert record((7.8, 0.5)).tall_without_name(600.0) == (pytest.approx(8.0), 0.5)


NAMED = {
    "line": LINE_HZ, "shaft": 3 * SHAFT_HZ, "sideband": LINE_HZ - 2 * SHAFT_HZ, "slip": LINE_HZ + 0.5, "trend": 0.5,
}  # fmt: skip


@pytest.mark.parametrize("hz", NAMED.values(), ids=NAMED)
def test_what_has_a_name_is_not(hz: float) -> None:
    assert record((hz, 2.0)).tall_without_name(600.0) is None


def test_nor_a_low_one_or_one_beyond_the_figure() -> None:
    assert record((7.8, 0.3)).tall_without_name(600.0) is None
    assert record((585.0, 0.5)).tall_without_name(580.0) is None
