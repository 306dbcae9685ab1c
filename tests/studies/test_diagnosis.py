"""The bench of fault naming: which records, by which methods, how they are counted."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbval.bearing import DEFECTS, Bearing, Fault
from srbval.diagnosis.diagnose import known_features
from srbval.diagnosis.fault_posterior import CLASSES, OTHER, KnownFeatures
from srbval.errors import DataError
from srbval.recordings import Recording
from srbval.recordings.registry import FileStatus, RegisteredRecording, listing
from srbval.studies.diagnosis.known_records import KnownRecord, known_records
from srbval.studies.diagnosis.reliability import HeldOut, calls, held_out, reliability, scores, wrongly_read
from srbval.studies.diagnosis.reliability import reliability_by_class as by_class
from srbval.studies.diagnosis.study import ANSWERS, Prediction, confusions, score, strongest_line
from tests.reading.test_shaft_speed import BEARING, record

BAND_HZ = (2000.0, 5000.0)


def plain(recording: Recording) -> Fault | None:
    return strongest_line(recording, BEARING, recording.speed, recording.band_hz or BAND_HZ)


def test_simple_diagnosis_names_the_line_that_is_there_and_nothing_in_noise() -> None:
    assert plain(record(shaft_hz=25.0)) is Fault.INNER
    noise = record(shaft_hz=25.0, fault=False)
    rng = np.random.default_rng(3)
    silent = dataclasses.replace(noise, channels={"x": rng.standard_normal(noise.samples)})
    assert plain(silent) is None


def test_the_threshold_is_over_the_neighbourhood_s_median() -> None:
    """A record whose noise drowns the line names nothing, whatever the line's own amplitude is."""
    shown = record(shaft_hz=25.0)
    rng = np.random.default_rng(4)
    drowned = shown.channels["x"] + 30 * shown.channels["x"].std() * rng.standard_normal(shown.samples)
    assert plain(dataclasses.replace(shown, channels={"x": 1000 * drowned})) is None


def scored(dataset: str, state: Fault, named: Fault | None, called: Fault | None = None) -> dict[str, Any]:
    return {"method": "m", "dataset": dataset, "rig": dataset, "state": state, "named": named, "called": called}


def test_predictions_are_counted_by_state_and_data_set() -> None:
    rows = confusions([
        scored("a", Fault.OUTER, Fault.OUTER, Fault.OUTER),
        scored("a", Fault.INNER, Fault.OUTER),
        scored("b", Fault.ROLLER, None),
        scored("b", Fault.HEALTHY, Fault.INNER),
        scored("b", Fault.HEALTHY, None),
    ])  # fmt: skip
    found = {(row["answer"], row["dataset"]): row for row in rows}
    assert set(found) == {(answer, name) for answer in ANSWERS for name in ("all", "a", "b")}
    whole, called = found["first named", "all"], found["called", "all"]
    assert [whole[n] for n in ("faulty", "right", "wrong", "silent")] == [3, 1, 1, 1]
    assert [whole[n] for n in ("healthy", "alarms", "rigs")] == [2, 1, 2]
    assert whole["counts"][Fault.INNER] == {"nothing": 0, "outer": 1, "inner": 0, "roller": 0}
    assert (called["right"], called["silent"], found["called", "b"]["alarms"]) == (1, 2, 0)
    assert found["called", "a"]["alarms_ci95"] is None


def test_what_a_method_refuses_is_said_nothing_of() -> None:
    class Known(KnownRecord):
        def load(self) -> tuple[Recording, Bearing]:
            return record(shaft_hz=25.0), BEARING

    def refuses(*_: object) -> Prediction:
        raise DataError("too short.")

    entry = dataclasses.replace(entry_like(), dataset="cwru")
    (one,) = score([Known(entry=entry, state=Fault.INNER)], {"refuses": refuses})
    assert (one["named"], one["called"]) == (None, None)
    assert "too short" in one["refused"]


def entry_like() -> RegisteredRecording:
    return RegisteredRecording(file="/x/a.mat", sha256="", size_bytes=1, mtime_ns=1, status=FileStatus.OK)


@pytest.mark.recordings
def test_shared_records_of_known_state(recordings_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SRBVAL_RECORDINGS", str(recordings_dir))
    records = known_records(listing().recordings)
    assert {r.state for r in records} == {Fault.HEALTHY, *DEFECTS}
    assert len({r.rig for r in records}) >= 5
    ims = [r for r in records if r.entry.dataset == "ims"]
    assert all(r.state is Fault.HEALTHY and r.load()[0].channel == r.entry.channel for r in ims[:2])
    assert all(r.load()[0].state is None for r in records[:3])


def test_left_out_rigs_are_named_better_than_by_chance_and_no_healthy_one_is_called() -> None:
    found = held_out(known_features())
    assert sum(f.weight for f in found) == pytest.approx(1)
    result, table = scores(found), {row["state"]: row for row in calls(found)}
    assert result["log_score"] > result["log_score_of_prior"] + 0.5
    assert result["brier_score"] < result["brier_score_of_prior"] / 2
    assert result["calibration_error"] < result["calibration_error_by_chance"]
    assert all(row["low"] <= row["right"] <= row["high"] for row in by_class(found))
    assert table["healthy"]["healthy"] > table["healthy"]["undecided"]
    assert not any(table["healthy"][name] for name in ("outer", "inner", "roller"))
    parts = ("outer", "inner", "roller")
    assert not any(table[state][name] for state in parts for name in parts if state != name)
    races = [(name, said, n) for name in parts[:2] for said, n in table[name].items() if said != "state"]
    assert sum(n for name, said, n in races if name == said) >= 0.9 * sum(n for *_, n in races)


def test_most_wrong_readings_are_something_else_and_few_are_called_a_fault() -> None:
    wrong = wrongly_read(held_out(known_features()))
    assert wrong["most_probably_other"] >= 0.75 * wrong["records"]
    assert wrong["fault_called"] <= 0.05 * wrong["records"]


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
