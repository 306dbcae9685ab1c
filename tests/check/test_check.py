"""The behaviour of now against its reference; what `srbval check` and `srbval evidence` print of it and return."""

import json
import subprocess
import sys
from dataclasses import replace
from typing import Any

import pytest

from srbval import Scene, check, load_scene
from srbval.storage.json_files import write_json
from srbval.storage.stored_result import Fingerprint, compare_part, reference_fingerprint
from srbval.studies import evidence
from srbval.studies.harness import Study, StudyResult, study_names

NOW: Fingerprint = {"full": {"outer: cage_ratio": 0.43, "outer: status": "ok"}}


@pytest.fixture(autouse=True)
def forget_recordings():
    yield
    reference_fingerprint.cache_clear()


def failed(part: str) -> set[str]:
    now, known = check.fingerprint(part)[part], reference_fingerprint()[part]
    return {one["name"] for one in compare_part(now, known) if not one["ok"]}


@pytest.mark.slow
def test_an_input_off_by_a_tenth_of_a_per_mille_is_noticed(monkeypatch):
    def spoilt(base: str, changes: dict[str, Any]) -> Scene:
        scene = load_scene(base, changes)
        return replace(scene, contact=replace(scene.contact, stiffness_n_m=1.0001 * scene.contact.stiffness_n_m))

    monkeypatch.setattr(check, "load_scene", spoilt)
    assert {"paper printed outer: cage_ratio", "paper printed outer: drive_power_w"} & failed("full")


@pytest.mark.slow
def test_a_changed_error_of_a_level_a_removed_question_and_another_scene_of_solvers_are_noticed(monkeypatch):
    def asked(*given: Any) -> dict[Any, Any]:
        return {question: answer for question, answer in answers(*given).items() if question != "depth"}

    answers = check.answer_questions
    monkeypatch.setattr(sys.modules["srbval.plan.questions"], "pct_of", lambda db: 100 * (10 ** (db / 10) - 1))
    monkeypatch.setattr(check, "answer_questions", asked)
    monkeypatch.setitem(check.FITS, "interference", {})
    changed = failed("plan")
    assert {"outer levels: error_pct", "inner sideband-levels: error_pct", "outer depth: 0"} <= changed
    assert "interference-outer imex2: step limit 0_s" in changed
    assert not {"outer levels: 0", "inner power: 0", "rig-outer imex2: step limit 0_s"} & changed


@pytest.mark.long_form
def test_a_processor_without_vector_instructions_has_the_same_fingerprint(monkeypatch):
    """Rounding differs between processors: no quantity of the fingerprint may amplify it."""
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")
    program = "import json; from srbval.check import fingerprint as f; "
    program += "print(json.dumps(f('full', 'slices', 'plan')))"
    done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    for part, values in json.loads(done.stdout).items():
        assert not [one for one in compare_part(values, reference_fingerprint()[part]) if not one["ok"]]


@pytest.fixture
def reports(tmp_path, monkeypatch):
    """A folder of reports with the reference `NOW`, and a user's cache of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (folder := tmp_path / "reports").mkdir()
    for module in (check, evidence):
        monkeypatch.setattr(module, "fingerprint", lambda *_, **__: NOW)
        monkeypatch.setattr(module, "shipped_folder", lambda _: folder)
    monkeypatch.setattr("srbval.cli.study_commands.fingerprint", lambda **_: NOW)
    monkeypatch.setattr("srbval.storage.stored_result.shipped_folder", lambda _: folder)
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
    assert "full: outer: cage_ratio: 0.43 is not within 0.4999995 to 0.5000005" in srbval_text("check", code=1).out
    assert "unchanged; --yes replaces it; 2 quantities differ" in srbval_text("check", "--update", code=1).out
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
    study = Study(name=name, question="?", parts=("full",))
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
    study = Study(name="naming", question="?", kind=evidence.ResultKind.RECORDED)
    monkeypatch.setattr(evidence, "load_study", lambda _: study)
    assert "needs recordings that are not part of srbval" in srbval_text("evidence", "naming", code=2).err
