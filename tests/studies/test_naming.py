"""The study of naming: which records, what each method is given, how calls are counted, and the stored result."""

import dataclasses

import pandas as pd
import pytest

from srbval.bearing import DEFECTS, Bearing, Fault
from srbval.diagnosis.fault_posterior import OTHER, evidence
from srbval.diagnosis.learning import NUMBERS, fit_evidence
from srbval.recordings import Recording
from srbval.recordings.manifest import FileStatus, RegisteredRecording
from srbval.recordings.registry import listing
from srbval.storage.installation import shipped_folder
from srbval.storage.json_files import read_json
from srbval.studies.naming.records import KnownRecord, known_records
from srbval.studies.naming.study import counted, named, see
from tests.reading.test_shaft_speed import BEARING, record

STORED = read_json(shipped_folder("reports") / "naming.json")
FIT_REL = 0.02  # of the numbers in the file, which have three digits, and of the search


class Made(KnownRecord):
    """A record made for the test in place of its file."""

    def load(self) -> tuple[Recording, Bearing]:
        return dataclasses.replace(record(shaft_hz=25.0), state=None), BEARING


def test_a_record_is_seen_by_every_method_without_its_state():
    """No method names another part; in the whole band, prewhitened, a single line is too weak."""
    entry = RegisteredRecording(file="/x/a.mat", sha256="", size_bytes=1, mtime_ns=1, status=FileStatus.OK)
    entry = dataclasses.replace(entry, dataset="cwru")
    seen = see(Made(entry=entry, state=Fault.INNER, rig="r", specimen="s"))
    (found,) = named([seen], {"r": evidence()})
    assert {name for name, part in found["called"].items() if part is None} == {"prewhitening"}
    assert set(found["called"].values()) == {Fault.INNER, None}
    assert found["probability"] > 2 / 3
    assert [known["state"] for known in seen["known"]] == ["inner", OTHER, OTHER, OTHER]
    silent = {"r": dataclasses.replace(evidence(), onset=99.0)}
    assert next(iter(named([seen], silent)))["called"]["record alone"] is None


def test_calls_are_counted_by_set_and_class():
    calls = (
        ("a", Fault.OUTER, Fault.OUTER),
        ("a", Fault.INNER, Fault.OUTER),
        ("b", Fault.ROLLER, None),
        ("b", Fault.HEALTHY, Fault.INNER),
        ("b", Fault.HEALTHY, None),
    )
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


def test_the_evidence_that_ships_is_that_of_the_stored_records():
    fitted, shipped = fit_evidence(pd.DataFrame(STORED["known"])), evidence()
    for name in NUMBERS:
        assert getattr(fitted, name) == pytest.approx(getattr(shipped, name), rel=FIT_REL)
    assert (fitted.rigs, fitted.specimens) == (shipped.rigs, shipped.specimens)
