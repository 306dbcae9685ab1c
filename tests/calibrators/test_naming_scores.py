"""Scores of the probabilities of naming a fault, and what they must not fall short of."""

from __future__ import annotations

import dataclasses

import pytest

from srbval.validation.fault_naming import known_features
from srbval.validation.fault_posterior import CLASSES
from tests.calibrators.naming_alarms import alarms, white
from tests.calibrators.naming_scores import HeldOut, calls, held_out, reliability, scores


def test_left_out_rigs_are_named_better_than_by_chance_and_no_healthy_one_is_called() -> None:
    found = held_out(known_features())
    assert sum(f.weight for f in found) == pytest.approx(1)
    result, table = scores(found), {row["state"]: row for row in calls(found)}
    assert result["log score"] > result["equal probabilities"] + 0.4
    assert result["Brier score"] < result["of equal ones"]
    assert not any(table["healthy"][name] for name in ("outer", "inner", "roller"))
    wrong = sum(table[state][name] for state in ("outer", "inner", "roller") for name in ("outer", "inner", "roller")
                if state != name)  # fmt: skip
    assert wrong == 0


def test_probabilities_that_are_right_have_no_calibration_error() -> None:
    """Nine of ten right at 0.9; the same said with certainty has an error of a tenth."""
    one = next(k for k in known_features() if k.state == "outer")
    other = dataclasses.replace(one, state="inner")
    share = dict.fromkeys(CLASSES, 0.025) | {"outer": 0.9}
    sure = dict.fromkeys(CLASSES, 1e-9) | {"outer": 1.0}
    for said, error in ((share, 0.0), (sure, 0.1)):
        found = [HeldOut(record=r, probabilities=said, weight=0.1) for r in (*[one] * 9, other)]
        assert scores(found)["expected calibration error"] == pytest.approx(error, abs=1e-6)
        assert [row["records"] for row in reliability(found)] == [10]


def test_alarms_on_noise_are_counted() -> None:
    found = alarms(white, 2)
    assert (found["records"], found["chances"], found["fault called"]) == (2, 6, 0)
