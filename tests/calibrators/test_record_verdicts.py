"""The study of the verdict's error rates: its simulated records, and what its stored result must show."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from srbval.bearing import Fault
from srbval.storage.stored_result import COMMAND, RECORD_VERDICTS, newest_result
from srbval.validation.compared_quantities import CAGE_RATIO, COMPARED
from tests.calibrators.record_verdicts import MARGIN, NONE, PRIOR, SECONDS, discrepancy, record

VALUES = {"cage ratio": 0.431, "2xBPFI": -3.0, "3xBPFI": -6.0, "BPFI sidebands": -4.0}


def read(seconds: float, count: int = 400) -> dict[str, list[tuple[float, float]]]:
    """Values and stated intervals of many records with the same truth, by the program's own readings."""
    rng, found = np.random.default_rng(1), dict[str, list[tuple[float, float]]]()
    for _ in range(count):
        made = record(Fault.INNER, VALUES, seconds, rng)
        for row in COMPARED:
            value = row.read(made, Fault.INNER)
            if value is not None and row.name_of(Fault.INNER) in VALUES:
                ci95 = np.hypot(value.ci95 or 0.0, value.speed_ci95)
                found.setdefault(row.name_of(Fault.INNER), []).append((value.value, ci95))
    return found


@pytest.mark.parametrize("seconds", SECONDS)
def test_records_are_read_with_the_errors_that_they_state(seconds: float) -> None:
    for name, values in read(seconds).items():
        held = np.mean([abs(value - VALUES[name]) <= ci95 for value, ci95 in values])
        assert 0.92 <= held <= 0.98, name


def test_longer_records_tell_more() -> None:
    short, long = (np.mean([ci95 for _, ci95 in read(s, 50)["2xBPFI"]]) for s in (2.0, 30.0))
    assert short / long == pytest.approx(np.sqrt(15), rel=0.3)


def test_discrepancies_are_the_stated_ones() -> None:
    rng = np.random.default_rng(2)
    assert discrepancy(NONE, "2xBPFI", 3.0, rng) == 0.0
    assert {abs(discrepancy(MARGIN, CAGE_RATIO.name, 3.0, rng)) for _ in range(9)} == {0.001}
    assert {abs(discrepancy(MARGIN, "2xBPFI", 9.0, rng)) for _ in range(9)} == {3.0}
    drawn = [discrepancy(PRIOR, CAGE_RATIO.name, 3.0, rng) for _ in range(2000)]
    assert np.std(drawn) == pytest.approx(0.001, rel=0.1)


def test_the_stored_rates_are_those_that_the_verdict_promises() -> None:
    """False "resolved" no more often than 5 % allows, false "agree" at the margin at most that."""
    kept = newest_result(RECORD_VERDICTS)
    if kept is None:
        pytest.skip(f"no stored result; {COMMAND[RECORD_VERDICTS]} makes one")
    rows = kept.content["rows"]
    rows = [row for row in rows if row["truth"] == "emulated"]  # the others are too few for a rate of 5 %
    assert {(row["seconds"], row["discrepancy"]) for row in rows} == {
        (s, k) for s in SECONDS for k in (NONE, MARGIN, PRIOR)
    }
    for row in rows:
        most = binom.ppf(0.975, row["rigs"], 0.05) / row["rigs"]
        if row["discrepancy"] == NONE:
            assert row["resolved"] <= most, row
        if row["discrepancy"] == MARGIN:
            assert row["agree"] <= most, row
            assert row["cage_agrees"] <= most, row
