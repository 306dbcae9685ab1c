"""Scores of the probabilities of naming a fault, and what they must not fall short of."""

from __future__ import annotations

import dataclasses

import pytest

from srbval.diagnosis.diagnose import known_features
from srbval.diagnosis.fault_posterior import CLASSES, OTHER, KnownFeatures
from srbval.studies.naming_alarms.study import alarms, white
from srbval.studies.naming_scores import HeldOut, calls, held_out, reliability, scores, wrongly_read


def test_left_out_rigs_are_named_better_than_by_chance_and_no_healthy_one_is_called() -> None:
    found = held_out(known_features())
    assert sum(f.weight for f in found) == pytest.approx(1)
    result, table = scores(found), {row["state"]: row for row in calls(found)}
    assert result["log_score"] > result["log_score_of_equal"] + 0.9
    assert result["brier_score"] < result["brier_score_of_equal"] / 2
    assert result["calibration_error"] < result["calibration_error_by_chance"] / 2
    # One second of a healthy IMS bearing shows its rollers weakly; none is called, see below.
    assert sum(f.record.state == "healthy" and not f.right for f in found) <= 1
    assert wrongly_read(found)["fault_called"] == 0
    # At a wrong speed a rolling element's group is no comb that could stand out as unexplained.
    combs = wrongly_read([f for f in found if f.record.specimen != "Roller"])
    assert combs["most_probably_other"] >= 0.9 * combs["records"]
    assert not any(table["healthy"][name] for name in ("outer", "inner", "roller"))
    parts = ("outer", "inner", "roller")
    assert not any(table[state][name] for state in parts for name in parts if state != name)


def test_probabilities_that_are_right_have_no_calibration_error() -> None:
    """Nine of ten right at 0.9; the same said with certainty has an error of a tenth."""
    one = next(k for k in known_features() if k.state == "outer")
    other = dataclasses.replace(one, state="inner")
    share = dict.fromkeys(CLASSES, 0.025) | {"outer": 0.9}
    sure = dict.fromkeys(CLASSES, 1e-9) | {"outer": 1.0}
    for said, error in ((share, 0.0), (sure, 0.1)):
        found = [HeldOut(record=r, probabilities=said, weight=0.1) for r in (*[one] * 9, other)]
        assert scores(found)["calibration_error"] == pytest.approx(error, abs=1e-6)
        assert [row["records"] for row in reliability(found)] == [10]


def test_the_band_of_a_bin_is_that_of_so_many_bearings() -> None:
    """Of 400 bearings, right with 0.9: sd of the share 0.015; records of one bearing add nothing."""
    one = next(k for k in known_features() if k.state == "outer")
    share = dict.fromkeys(CLASSES, 0.025) | {"outer": 0.9}
    known = [dataclasses.replace(one, specimen=str(number // 5)) for number in range(2000)]
    (row,) = reliability([HeldOut(record=k, probabilities=share, weight=1 / 2000) for k in known])
    assert (row["low"], row["high"]) == pytest.approx((0.9 - 1.96 * 0.015, 0.9 + 1.96 * 0.015), abs=0.006)


def test_wrong_readings_are_counted_where_the_right_one_shows_the_fault() -> None:
    def known(state: str, outer: float) -> KnownFeatures:
        return KnownFeatures(rig="r", specimen="s", state=state, families=(outer, -1.0, -1.0), unexplained=0.0)

    records = [known("outer", 9.0), known(OTHER, 0), known(OTHER, 0), known("outer", 0.5), known(OTHER, 0)]
    said = [{"outer": 0.9}, {OTHER: 0.5, "outer": 0.4}, {"outer": 0.8, OTHER: 0.2}, {"outer": 1.0}, {OTHER: 1.0}]
    of = [HeldOut(record=r, probabilities=p, weight=0.2) for r, p in zip(records, said, strict=True)]
    assert wrongly_read(of) == {"records": 2, "called_other": 0, "most_probably_other": 1, "fault_called": 1}


def test_alarms_on_noise_are_counted() -> None:
    found = alarms(white, 2)
    assert (found["records"], found["chances"], found["fault called"]) == (2, 6, 0)
