"""Stored results: the newest one that can be read, wherever it lies."""

from __future__ import annotations

from pathlib import Path

import pytest

from srbval.storage import stored_result
from srbval.storage.stored_result import STABILITY, StoredResult, newest_result, stamped, store_result


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's cache, and no repository beside the package."""
    monkeypatch.setattr(stored_result, "cache_folder", lambda kind: tmp_path / "cache" / kind)
    monkeypatch.setattr(stored_result, "shipped_folder", lambda name: tmp_path / "repository" / name)
    return tmp_path


def result(made_utc: str, value: int) -> dict[str, object]:
    content = stamped(STABILITY, {"cells": [value], "machine": {}}, command="srbval stability", revision="abc")
    return content | {"made_utc": made_utc}


def test_a_result_says_where_it_comes_from() -> None:
    content = stamped(STABILITY, {"machine": {"processor": "P", "usable_cores": 2}}, command="c", revision="abc")
    origin = StoredResult(path=Path("s.json"), content=content).origin
    assert origin == {
        "made_utc": content["made_utc"], "git_revision": "abc", "command": "c", "processor": "P", "usable_cores": 2,
        "file": "s.json",
    }  # fmt: skip


@pytest.mark.usefixtures("cache")
def test_nothing_is_there_at_first() -> None:
    assert newest_result(STABILITY) is None


def test_the_newest_is_found(cache: Path) -> None:
    path = store_result(result("2026-01-01T00:00:00+00:00", 1))
    assert path == cache / "cache" / "results" / "stability.json"
    assert newest_result(STABILITY).content["cells"] == [1]  # type: ignore[union-attr]
    store_result(result("2026-01-02T00:00:00+00:00", 2), cache / "repository" / "reports" / "stability.json")
    assert newest_result(STABILITY).content["cells"] == [2]  # type: ignore[union-attr]


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"kind": "stability", "schema_version": 99, "made_utc": "x"}'])
def test_what_cannot_be_read_is_none(text: str, cache: Path) -> None:
    path = cache / "cache" / "results" / "stability.json"
    path.parent.mkdir(parents=True)
    path.write_text(text, encoding="utf-8")
    assert newest_result(STABILITY) is None
