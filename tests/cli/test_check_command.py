"""`srbval check` and `srbval evidence` on a made-up fingerprint: what they print and return."""

import json

import pytest

from srbval.check import check
from srbval.storage.behaviour import reference_fingerprint
from srbval.storage.json_files import write_json
from srbval.studies import evidence
from srbval.studies.harness import Study, StudyResult, study_names

NOW = {"full": {"outer: cage_ratio": 0.43, "outer: status": "ok"}}


@pytest.fixture
def reports(tmp_path, monkeypatch):
    """A folder of reports with the reference of `NOW`, and a user's cache of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = tmp_path / "reports"
    folder.mkdir()
    for module in (check, evidence):
        monkeypatch.setattr(module, "fingerprint", lambda *_, **__: NOW)
        monkeypatch.setattr(module, "shipped_folder", lambda _: folder)
    monkeypatch.setattr("srbval.cli.study_commands.fingerprint", lambda **_: NOW)
    for module in ("behaviour", "stored_result"):
        monkeypatch.setattr(f"srbval.storage.{module}.shipped_folder", lambda _: folder)
    write_json(folder / "fingerprint.json", {"schema_version": 1, "kind": "fingerprint", "parts": NOW})
    reference_fingerprint.cache_clear()
    return folder


@pytest.mark.usefixtures("reports")
def test_within_tolerance(srbval_json, srbval_text):
    document = srbval_json("check")
    assert (document["status"], document["stale"]) == ("ok", [])
    for one in document["checks"]:
        assert {"name", "value", "low", "high", "unit", "ok"} <= set(one)
        assert one["ok"] is (one["low"] <= one["value"] <= one["high"]) is True
    assert "no stored evidence is stale" in srbval_text("check").out


def test_drift_is_named_and_replaced_only_when_agreed(reports, srbval_json, srbval_text):
    path = reports / "fingerprint.json"
    write_json(path, json.loads(path.read_text()) | {"parts": {"full": {"outer: cage_ratio": 0.5}}})
    reference_fingerprint.cache_clear()
    before = path.read_bytes()
    said = srbval_text("check", code=1).out
    assert "full: outer: cage_ratio: 0.43 is not within 0.4999995 to 0.5000005" in said
    assert "give --yes to replace it; 2 quantities differ" in srbval_text("check", "--update", code=1).out
    assert path.read_bytes() == before
    assert "replaced" in srbval_text("check", "--update", "--yes").out
    assert srbval_json("check")["status"] == "ok"


def test_stale_evidence_fails_the_check_and_is_computed_again(reports, monkeypatch, srbval_json):
    name = next(one for one in study_names() if one != "naming")
    old = {"schema_version": 3, "kind": name, "made_utc": "2026-01-01T00:00:00+00:00", "git_revision": "abc"}
    write_json(reports / f"{name}.json", old)
    document = srbval_json("check", code=1)
    assert document["status"] == "stale"
    assert document["stale"][0]["file"] == f"{name}.json"
    found = StudyResult(name=name, content={"rows": [1]}, text="")
    monkeypatch.setattr(Study, "run", property(lambda _: lambda *_: found))
    monkeypatch.setattr("srbval.studies.harness.load_study", lambda _: study)
    study = Study(name=name, question="?", minutes=0.1, parts=("full",))
    monkeypatch.setattr(evidence, "load_study", lambda _: study)
    monkeypatch.setattr(evidence, "study_names", lambda: (name,))
    monkeypatch.setattr(evidence, "git_revision", lambda: "def")
    monkeypatch.setattr(evidence, "is_source_tree", lambda: True)
    document = srbval_json("evidence", name)
    (result,) = document["results"]
    assert document["status"] == "ok"
    assert {"name", "kind", "fresh", "why", "made_utc", "machine", "minutes"} <= set(result)
    assert (result["name"], result["kind"], result["fresh"]) == (name, "evidence", True)
    assert json.loads((reports / f"{name}.json").read_text())["rows"] == [1]
    srbval_json("check")
    assert srbval_json("evidence", "--list")["results"][0]["fresh"] is True


@pytest.mark.usefixtures("reports")
def test_a_result_on_recordings_that_do_not_ship_is_not_computed(monkeypatch, srbval_text):
    study = Study(name="naming", question="?", minutes=1, kind=evidence.ResultKind.RECORDED)
    monkeypatch.setattr(evidence, "load_study", lambda _: study)
    assert "rests on recordings that do not come with srbval" in srbval_text("evidence", "naming", code=2).err
