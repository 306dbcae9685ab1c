"""The study of naming: which records, what each method is given, how calls are counted, and the stored result."""

import dataclasses
from argparse import Namespace

import pytest

from srbval import fault_verdict
from srbval.bearing import DEFECTS, Bearing, Fault
from srbval.diagnosis.fault_posterior import OPEN
from srbval.diagnosis.records import RecordRequest, read_record
from srbval.errors import DataError
from srbval.recordings import Recording, RecordingSettings
from srbval.recordings.manifest import FileStatus, RegisteredRecording
from srbval.recordings.registry import listing
from srbval.storage.files import file_sha256
from srbval.studies.naming import study
from srbval.studies.naming.records import KnownRecord, known_records
from srbval.studies.naming.study import ALONE, MACHINE, call_machines, counted, graded, see
from tests.diagnosis.test_baseline import faulted_analysis, healthy_analysis
from tests.reading.test_shaft_speed import BEARING, record

SHARED_NAMED = 37  # of the 47 faulty records handed


class Made(KnownRecord):
    """A record made for the test in place of its file."""

    def load(self) -> tuple[Recording, Bearing]:
        return dataclasses.replace(record(shaft_hz=25.0), state=None), BEARING


def test_a_record_is_seen_by_every_method_without_its_state():
    """It is named, alone and as a machine, and as what it is not no part is."""
    entry = RegisteredRecording(file="/x/a.mat", sha256="", size_bytes=1, mtime_ns=1, status=FileStatus.OK)
    entry = dataclasses.replace(entry, dataset="cwru")
    seen = see(Made(entry=entry, state=Fault.INNER, rig="r", specimen="s"))
    call_machines([seen])
    assert seen["called"] == {ALONE: Fault.INNER, MACHINE: Fault.INNER}
    assert seen["probability"] > 2 / 3
    assert seen["called_otherwise"] == [None, None, None]


def test_graded_records_are_found_by_their_content_and_counted_by_grade(tmp_path, monkeypatch):
    """Two files of the test's own in place of the benchmark's; a third one of the folder is no record of it."""
    head, rows = "record,sha256,state,load_hp,nominal_rpm,grade,peer_first", ["c,0,outer,0,1797,P1,BPFO"]
    for name, line in (("a", "BPFI"), ("b", "BSF"), ("d", "")):
        (tmp_path / f"{name}.mat").write_bytes(name.encode())
        rows += [f"{name},{file_sha256(tmp_path / f'{name}.mat')},inner,0,1797,Y1,{line}"] if line else []
    (tmp_path / "graded.csv").write_text("\n".join(["# a comment", head, *rows]))
    read = iter((faulted_analysis(), healthy_analysis()))
    monkeypatch.setattr(study, "GRADED", tmp_path / "graded.csv")
    monkeypatch.setattr(study, "read_record", lambda _: Namespace(verdict=fault_verdict(next(read))))
    monkeypatch.setattr(study, "in_processes", lambda one, tasks, **_: ((task, one(task)) for task in tasks))
    found = graded([str(tmp_path)], None, lambda *_: None)
    assert found["missing"] == ["c"]
    every = next(row for row in found["table"] if row["part"] == "all")
    expected = {"records": 2, "right": 1, "wrong": 0, "nothing_found": 1, "undecided": 0, "public_right": 1}
    assert every | expected | {"public_wrong": 1} == every
    assert [row["ranked_first"] for row in found["records"]] == ["inner", OPEN], "no part is first by its prior"
    with pytest.raises(DataError, match="none of the 3 records"):
        graded([str(tmp_path / "none")], None, lambda *_: None)


def test_a_later_run_does_not_replace_the_first_run_of_the_graded_benchmark():
    stored = study.with_graded({}, {"table": "a"})
    assert stored == {study.FIRST_RUN: {"table": "a"}, study.LATER_RUN: None}
    for later in "bc":
        stored = study.with_graded(stored, {"table": later})
        assert stored == {study.FIRST_RUN: {"table": "a"}, study.LATER_RUN: {"table": later}}


def test_calls_are_counted_by_set_and_class():
    calls = [("a", Fault.OUTER, Fault.OUTER), ("a", Fault.INNER, Fault.OUTER), ("b", Fault.ROLLER, None)]
    calls += [("b", Fault.HEALTHY, called) for called in (Fault.INNER, None)]
    rows = counted([{"dataset": name, "state": state, "called": {"m": called}} for name, state, called in calls])
    found = {row["of"]: row for row in rows}
    assert set(found) == {"all", "a", "b", *(state.label for state in (*DEFECTS, Fault.HEALTHY))}
    keys = ("right", "wrong", "none", "faulty", "healthy_called", "healthy")
    for of, expected in (("all", (1, 1, 1, 3, 1, 2)), ("a", (1, 1, 0, 2, 0, 0)), ("b", (0, 0, 1, 1, 1, 2))):
        assert tuple(found[of][key] for key in keys) == expected


@pytest.mark.recordings
def test_shared_records_of_known_state(recordings_dir, monkeypatch):
    monkeypatch.setenv("SRBVAL_RECORDINGS", str(recordings_dir))
    records = known_records(listing().recordings)
    assert {r.state for r in records} == {Fault.HEALTHY, *DEFECTS}
    assert len({r.rig for r in records}) >= 5
    ims = [r for r in records if r.entry.dataset == "ims"]
    assert {r.specimen for r in ims} == {f"bearing {number}" for number in range(1, 5)}
    assert all(r.state is Fault.HEALTHY and r.load()[0].channel == r.entry.channel for r in ims[:2])
    assert all(r.load()[0].state is None for r in records[:3])


@pytest.mark.recordings
@pytest.mark.long_form
@pytest.mark.timeout(3600)
def test_bearing_and_speed_alone_name_as_many_faults_as_with_the_band_of_the_set(recordings_dir, monkeypatch):
    """No data set and no band, so one is chosen on each record; no wrong part is named, and no healthy record."""
    monkeypatch.setenv("SRBVAL_RECORDINGS", str(recordings_dir))
    right = {"set": 0, "alone": 0}
    for known in known_records(listing().recordings):
        own, bearing = known.load()
        for kind, one in (("set", own), ("alone", dataclasses.replace(own, band_hz=None, dataset=None))):
            asked = RecordRequest(recording=one, bearing=bearing.name, settings=RecordingSettings(channel=one.channel))
            part = read_record(asked).verdict.part
            assert part in (None, known.state), (known.entry.file, kind)
            right[kind] += part is not None
    assert right["alone"] >= right["set"] >= SHARED_NAMED
