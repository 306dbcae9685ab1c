"""`srbval check` on one quick group: what it prints, writes and returns."""

import json
from pathlib import Path

import pytest

from srbval.check.quantities import GROUPS
from srbval.cli import main
from srbval.studies.harness import store_result

ORDERS = {"order_bpfo": 8.1772, "order_bpfi": 10.8228, "order_bsf": 3.4678, "order_ftf": 0.4304}


@pytest.fixture
def reference(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A reference of the kinematic orders; nothing else is checked."""
    monkeypatch.setattr("srbval.check.check.GROUPS", {"kinematics": GROUPS["kinematics"]})
    rows = [{"name": n, "value": v, "tolerance": 1e-3, "unit": "1", "reason": "rounded"} for n, v in ORDERS.items()]
    path = tmp_path / "reference.json"
    path.write_text(json.dumps({"kind": "reference", "schema_version": 1, "quantities": rows}))
    return path


def drift(path: Path) -> None:
    document = json.loads(path.read_text())
    document["quantities"][0]["value"] = 8.5
    path.write_text(json.dumps(document))


def test_json(reference: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "--json", "--reference", str(reference)]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["status"] == "ok"
    assert {check["name"] for check in document["checks"]} == set(ORDERS)
    for check in document["checks"]:
        assert {"name", "value", "low", "high", "unit", "ok"} <= set(check)
        assert check["ok"] is (check["low"] <= check["value"] <= check["high"]) is True


def test_stale_results_are_named_and_are_no_failure(
    reference: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One result whose sources are as they were, one whose sources are not, one of before sources were stored."""
    monkeypatch.setattr("srbval.check.check.shipped_folder", lambda _: tmp_path / "reports")
    origin = {"computed_by": "srbval.errors", "command": "x", "revision": "abc"}
    for name in ("fresh", "changed"):
        store_result(name, {}, path=tmp_path / "reports" / f"{name}.json", **origin)
    changed = tmp_path / "reports" / "changed.json"
    changed.write_text(changed.read_text().replace('"sources_sha256": "', '"sources_sha256": "0'))
    (tmp_path / "reports" / "old.json").write_text('{"kind": "old"}')
    assert main(["check", "--json", "--reference", str(reference)]) == 0
    stale = json.loads(capsys.readouterr().out)["stale"]
    assert [one["file"] for one in stale] == ["changed.json", "old.json"]
    assert "sources of srbval.errors have changed" in stale[0]["why"]
    assert main(["check", "--reference", str(reference)]) == 0
    assert "note: reports/changed.json is stale" in capsys.readouterr().out


def test_drift_is_said_and_replaced_only_when_agreed(reference: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drift(reference)
    before = reference.read_bytes()
    assert main(["check", "--reference", str(reference)]) == 1
    assert "order_bpfo: 8.17723534 is not within 8.499 to 8.501 1; its tolerance: rounded" in capsys.readouterr().out
    assert main(["check", "--update", "--reference", str(reference)]) == 1
    shown = capsys.readouterr().out
    assert all(text in shown for text in ("order_bpfo", "-322", "left as it was; give --yes to replace it"))
    assert reference.read_bytes() == before
    assert main(["check", "--update", "--yes", "--reference", str(reference)]) == 0
    assert main(["check", "--reference", str(reference)]) == 0
    assert main(["check", "--reference", str(reference.with_name("none.json"))]) == 3
    assert "no such file" in capsys.readouterr().err
