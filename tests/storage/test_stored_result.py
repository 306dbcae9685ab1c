"""Stored results: the newest one that can be read, wherever it lies; why one no longer holds."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from srbval.errors import DataError
from srbval.storage import stored_result
from srbval.storage.files import file_sha256
from srbval.storage.stored_result import StoredResult, newest_result
from srbval.studies import harness
from srbval.studies.harness import store_result

ORIGIN: dict[str, Any] = {"computed_by": "srbval.errors", "command": "srbval study run waves", "revision": "abc"}


@pytest.fixture(autouse=True)
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's cache, and a repository with an input."""
    for module in (stored_result, harness):
        monkeypatch.setattr(module, "cache_folder", lambda kind: tmp_path / "cache" / kind)
        monkeypatch.setattr(module, "shipped_folder", lambda name: tmp_path / "repository" / name)
    for name in ("reports", "data_manifest"):
        (tmp_path / "repository" / name).mkdir(parents=True)
    (tmp_path / "repository/data_manifest/a.csv").write_text("1")
    return tmp_path


def stored(**changes: Any) -> StoredResult:
    origin = {key: changes.pop(key, value) for key, value in ORIGIN.items()}
    path, inputs = changes.pop("path", None), changes.pop("inputs", {})
    return store_result("waves", {"cells": [1]} | changes, inputs=inputs, path=path, **origin)


def test_the_newest_is_found_with_its_origin(root: Path) -> None:
    assert newest_result("waves") is None
    machine = {"processor": "P", "usable_cores": 2}
    assert stored(made_utc="2026-01-01T00:00:00+00:00", machine=machine).path == root / "cache/results/waves.json"
    found = newest_result("waves")
    assert found.content["cells"] == [1]
    assert found.origin == {
        "made_utc": "2026-01-01T00:00:00+00:00", "git_revision": "abc", "command": "srbval study run waves",
        "processor": "P", "usable_cores": 2, "file": "waves.json",
    }  # fmt: skip
    stored(made_utc="2026-01-02T00:00:00+00:00", cells=[2], path=root / "repository/reports/waves.json")
    assert newest_result("waves").content["cells"] == [2]  # type: ignore[union-attr]


def test_a_result_holds_until_its_sources_or_inputs_change(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shipped = root / "repository/data_manifest/a.csv"
    stored(inputs={"data_manifest/a.csv": file_sha256(shipped), "X_709rpm": "f00"})
    result = newest_result("waves")
    assert result.stale is None
    shipped.write_text("2")
    assert "data_manifest/a.csv" in (replace(result).stale or "")
    once = StoredResult(path=result.path, content=result.content | {"computed_once": "blind"})
    assert "data_manifest/a.csv" in (once.stale or "")  # what it is of must stay
    shipped.write_text("1")
    monkeypatch.setattr(stored_result, "sources_sha256", lambda _: "other")
    assert "sources of srbval.errors" in (replace(result).stale or "")
    assert replace(once).stale is None  # it documents one revision: the sources of a later one do not matter


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"sources_sha256": None}, "by which sources"), ({"inputs_sha256": []}, "by which sources"),
        ({"git_revision": "abc-dirty"}, "changed working tree"), ({"computed_by": "srbval.nowhere"}, "no more"),
    ],
)  # fmt: skip
def test_a_result_of_unknown_origin_does_not_hold(change: dict[str, Any], why: str) -> None:
    result = stored()
    assert why in (replace(result, content=result.content | change).stale or "")


def test_a_changed_working_tree_keeps_its_results_to_itself(root: Path) -> None:
    path = root / "repository/reports/waves.json"
    with pytest.raises(DataError, match=r"reports/waves\.json.*abc-dirty.*cache/results/waves\.json"):
        stored(revision="abc-dirty", path=path)
    assert not path.exists()
    assert newest_result("waves").path == root / "cache/results/waves.json"  # type: ignore[union-attr]
    assert stored(revision="abc-dirty", path=root / "elsewhere.json").path.exists()
