"""The bench of fault naming: which records, by which methods, how they are counted; the evidence that ships."""

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbval.bearing import DEFECTS, Bearing, Fault
from srbval.diagnosis.fault_posterior import CLASSES, OTHER, evidence
from srbval.recordings import Recording
from srbval.recordings.registry import FileStatus, RegisteredRecording, listing
from srbval.storage.installation import shipped_folder
from srbval.storage.json_files import read_json
from srbval.studies.known_records import KnownFeatures, KnownRecord, known_records
from srbval.studies.naming import study
from srbval.studies.naming.learnt import MACHINES, RECORDS, gain, ships, without_each
from srbval.studies.naming.reliability import HeldOut, called, fit_evidence, held_out, reliability, scores, wrongly_read
from srbval.studies.naming.reliability import reliability_by_class as by_class
from srbval.studies.naming.study import ALL, RACES, by_excess, counted, see, strongest_line
from tests.reading.test_shaft_speed import BEARING, record

BAND_HZ = (2000.0, 5000.0)
STORED = read_json(shipped_folder("reports") / "naming.json")
KNOWN = [KnownFeatures(**row | {"features": tuple(row["features"])}) for row in STORED["known"]]
BY = without_each(KNOWN, list(dict.fromkeys(known.rig for known in KNOWN)))


def plain(recording: Recording) -> Fault | None:
    return strongest_line(recording.channels["x"], recording.fs_hz, BEARING, recording.speed, [BAND_HZ])


def test_simple_diagnosis_names_the_line_that_is_there_and_nothing_in_noise() -> None:
    assert plain(record(shaft_hz=25.0)) is Fault.INNER
    noise = record(shaft_hz=25.0, fault=False)
    silent = dataclasses.replace(noise, channels={"x": np.random.default_rng(3).standard_normal(noise.samples)})
    assert plain(silent) is None


@pytest.mark.parametrize(
    ("views", "named"),
    [([(9, 2, 1)], Fault.OUTER), ([(1, 1, 1), (2, 1, 11)], Fault.ROLLER), ([(7.9, 1, 1)], None),
     ([(20, 17.5, 1)], None), ([(-1, 8, -1)], Fault.INNER)],
)  # fmt: skip
def test_the_rule_without_learning_asks_for_excess_and_margin(views: list[tuple], named: Fault | None) -> None:
    assert by_excess(views) is named


def scored(dataset: str, state: Fault, called: Fault | None) -> dict[str, Any]:
    return {"dataset": dataset, "bearing": "b", "state": state, "called": {"m": called}}


def test_calls_are_counted_by_set_class_and_bearing() -> None:
    rows = counted([
        scored("a", Fault.OUTER, Fault.OUTER), scored("a", Fault.INNER, Fault.OUTER), scored("b", Fault.ROLLER, None),
        scored("b", Fault.HEALTHY, Fault.INNER), scored("b", Fault.HEALTHY, None),
    ])  # fmt: skip
    found = {row["of"]: row for row in rows}
    assert set(found) == {ALL, "a", "b", RACES, *(fault.label for fault in DEFECTS)}
    for of, expected in (
        (ALL, (1, 1, 1, 1, 2)), ("a", (1, 1, 0, 0, 0)), (RACES, (1, 1, 0, 0, 0)), ("b", (0, 0, 1, 1, 2)),
    ):  # fmt: skip
        keys = "right", "wrong", "none", "healthy_called", "healthy"
        assert tuple(found[of][key] for key in keys) == expected
    assert found["a"]["called_ci95"] is None


def test_a_record_is_seen_by_every_method() -> None:
    """Without its state, and none names another part; in the whole band, prewhitened, a single line is too weak."""

    class Known(KnownRecord):
        def load(self) -> tuple[Recording, Bearing]:
            return dataclasses.replace(record(shaft_hz=25.0), state=None), BEARING

    entry = RegisteredRecording(file="/x/a.mat", sha256="", size_bytes=1, mtime_ns=1, status=FileStatus.OK)
    entry = dataclasses.replace(entry, dataset="cwru")
    seen = see(Known(entry=entry, state=Fault.INNER))
    by = {seen.record.rig: evidence()}
    nothing = {seen.record.rig: dataclasses.replace(evidence(), onset=99.0)}
    (row,) = study.scored([seen], {RECORDS: by, MACHINES: nothing}, RECORDS)
    none = {name for name, called in row["called"].items() if called is None}
    assert none == {"prewhitening", f"learnt from {MACHINES}"}
    assert set(row["called"].values()) == {Fault.INNER, None}
    assert [known.state for known in seen.known] == ["inner", OTHER, OTHER, OTHER]


@pytest.mark.recordings
def test_shared_records_of_known_state(recordings_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SRBVAL_RECORDINGS", str(recordings_dir))
    records = known_records(listing().recordings)
    assert {r.state for r in records} == {Fault.HEALTHY, *DEFECTS}
    assert len({r.rig for r in records}) >= 5
    ims = [r for r in records if r.entry.dataset == "ims"]
    assert all(r.state is Fault.HEALTHY and r.load()[0].channel == r.entry.channel for r in ims[:2])
    assert all(r.load()[0].state is None for r in records[:3])


def test_the_evidence_that_ships_is_that_of_the_stored_records() -> None:
    fitted, shipped = fit_evidence(KNOWN), evidence()
    for name in study.NUMBERS:
        assert getattr(fitted, name) == pytest.approx(getattr(shipped, name), rel=0.02)
    assert (fitted.rigs, fitted.specimens) == (shipped.rigs, shipped.specimens)


def test_the_fit_finds_the_tail_of_the_healthy_and_the_share_that_hides() -> None:
    """Healthy features have an exponential tail of scale 0.7; a third of the faults hide, the others spread to 20."""
    rng, known = np.random.default_rng(1), []
    for state in CLASSES:
        for number in range(400):
            values = rng.exponential(0.7, 4) - 1
            if state != CLASSES[0] and rng.random() > 1 / 3:
                values[CLASSES.index(state) - 1] = rng.uniform(0, 20)
            known.append(KnownFeatures(rig="r", specimen=str(number), state=state, features=tuple(values)))
    found = fit_evidence(known)
    assert found.slope == pytest.approx(1 / 0.7, rel=0.1)
    # The densities at x: exp(-(x + 1) / 0.7) / 0.7 and 1 / 20.
    assert found.onset == pytest.approx(math.log(20 / 0.7) - 1 / 0.7, abs=0.5)
    assert (found.hidden, found.roller_hidden) == pytest.approx((1 / 3, 1 / 3), abs=0.06)


def test_left_out_rigs_are_named_better_than_by_chance_and_no_healthy_one_is_called() -> None:
    found = held_out(KNOWN, BY)
    assert sum(f.weight for f in found) == pytest.approx(1)
    result, said = scores(found), called(found)
    assert result["log_score"] > result["log_score_of_prior"] + 0.7
    assert result["brier_score"] < result["brier_score_of_prior"] / 2
    assert result["calibration_error"] < result["calibration_error_by_chance"]
    assert all(row["low"] <= row["right"] <= row["high"] for row in by_class(found))
    assert (said["wrong"], said["healthy_called"]) == (0, 0)
    assert said["races_right"] >= 0.9 * said["races"]


def test_most_wrong_readings_are_something_else_and_few_are_called_a_fault() -> None:
    wrong = wrongly_read(held_out(KNOWN, BY))
    assert wrong["most_probably_other"] >= 0.75 * wrong["records"]
    assert wrong["fault_called"] <= 0.05 * wrong["records"]


def one(state: str = "outer", specimen: str = "s", **features: float) -> KnownFeatures:
    values = tuple(features.get(name, -1.0) for name in CLASSES[1:])
    return KnownFeatures(rig="r", specimen=specimen, state=state, features=values)


def test_probabilities_that_are_right_have_no_calibration_error() -> None:
    """Nine of ten right at 0.9; the same said with certainty has an error of a tenth."""
    share = dict.fromkeys(CLASSES, 0.025) | {"outer": 0.9}
    sure = dict.fromkeys(CLASSES, 1e-9) | {"outer": 1.0}
    for said, error in ((share, 0.0), (sure, 0.1)):
        found = [HeldOut(record=r, probabilities=said, weight=0.1) for r in (*[one()] * 9, one("inner"))]
        assert scores(found)["calibration_error"] == pytest.approx(error, abs=1e-6)
        assert [row["records"] for row in reliability(found)] == [10]


def test_the_band_of_a_bin_is_that_of_so_many_bearings() -> None:
    """Of 400 bearings, right with 0.9: sd of the share 0.015; records of one bearing add nothing."""
    share = dict.fromkeys(CLASSES, 0.025) | {"outer": 0.9}
    known = [one(specimen=str(number // 5)) for number in range(2000)]
    (row,) = reliability([HeldOut(record=k, probabilities=share, weight=1 / 2000) for k in known])
    assert (row["low"], row["high"]) == pytest.approx((0.9 - 1.96 * 0.015, 0.9 + 1.96 * 0.015), abs=0.006)


def test_wrong_readings_are_counted_where_the_right_one_shows_the_fault() -> None:
    records = [one(outer=9.0), one(OTHER), one(OTHER), one(outer=0.5), one(OTHER)]
    said = [{"outer": 0.9}, {OTHER: 0.5, "outer": 0.4}, {"outer": 0.8, OTHER: 0.2}, {"outer": 1.0}, {OTHER: 1.0}]
    of = [HeldOut(record=r, probabilities=p, weight=0.2) for r, p in zip(records, said, strict=True)]
    assert wrongly_read(of) == {"records": 2, "called_other": 0, "most_probably_other": 1, "fault_called": 1}


def test_what_is_learnt_for_a_rig_has_nothing_of_it() -> None:
    """Neither its records nor, of simulated machines, its backgrounds: what only rig b knows does not count there."""
    known = [KnownFeatures(rig=rig, specimen="s", state=state, features=(value, -1.0, -1.0, -1.0))
             for rig in "ac" for state, value in (("healthy", -1.0), ("outer", 9.0))]  # fmt: skip
    upset = [dataclasses.replace(k, rig="b", state="healthy" if k.state == "outer" else "outer") for k in known]
    by = without_each([*known, *upset, *upset], ["a", "b"])
    assert by["b"] == fit_evidence(known)
    assert by["a"].slope < by["b"].slope


def test_records_ship_only_where_they_are_better_beyond_chance() -> None:
    """Rigs drawn again: a gain that one of two rigs takes back is chance, one that both show is not."""

    def found(*said: float) -> list[HeldOut]:
        return [HeldOut(record=dataclasses.replace(one(), rig=str(rig)), probabilities={"outer": p}, weight=0.5)
                for rig, p in enumerate(said)]  # fmt: skip

    for machines, best in (((0.4, 0.5), RECORDS), ((0.4, 0.9), MACHINES), ((0.7, 0.7), MACHINES)):
        by = gain(found(*machines), found(0.7, 0.7))
        assert by["gain"] == pytest.approx(sum(math.log(p / 0.7) for p in machines) / 2)
        assert ships([{"learnt_from": RECORDS}, {"learnt_from": MACHINES} | by]) == best


def test_simulated_machines_name_within_three_points_of_records_of_known_state() -> None:
    rows = {row["learnt_from"]: row for row in STORED["learnt"]}
    records, machines = rows[RECORDS], rows[MACHINES]
    assert abs(records["right"] - machines["right"]) <= 0.03 * sum(records[key] for key in ("right", "wrong", "none"))
    assert (machines["wrong"], machines["healthy_called"]) == (0, 0)
    assert rows["machines, labels permuted"]["right"] < machines["right"] / 2
    assert STORED["ships"] == ships(STORED["learnt"])
