"""Results stored under what they were computed from."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from srbval.storage import content_store
from srbval.storage.content_store import ContentStore


@pytest.fixture
def store(tmp_path: Path) -> ContentStore:
    return ContentStore(kind="answer", computed_by="srbval.errors", folder=tmp_path)


def test_what_was_saved_is_loaded(store: ContentStore) -> None:
    assert store.load("a scene", dict) is None
    store.save("a scene", {"value": 1.5, "missing": math.nan})
    assert store.load("a scene", dict) == {"value": 1.5, "missing": None}
    assert store.load("another scene", dict) is None


def test_another_version_of_the_code_finds_nothing(store: ContentStore, monkeypatch: pytest.MonkeyPatch) -> None:
    store.save("a scene", {"value": 1})
    monkeypatch.setattr(content_store, "content_version", lambda _: "another")
    assert store.load("a scene", dict) is None


def test_a_damaged_file_is_no_result(store: ContentStore) -> None:
    store.save("a scene", {"value": 1})
    (path,) = store.folder.iterdir()
    path.write_text("{", encoding="utf-8")
    assert store.load("a scene", dict) is None


@pytest.mark.parametrize(
    "text", ["[]", "5", "[" * 100_000, '{"value": 1' + "0" * 5000 + "}", '{"value": NaN}', "null", "\xff"]
)
def test_a_hostile_file_is_no_result(store: ContentStore, text: str) -> None:
    """Nor is one that its reader makes nothing of."""
    store.save("a scene", {"value": 1})
    (path,) = store.folder.iterdir()
    path.write_bytes(text.encode("latin-1"))
    assert store.load("a scene", lambda table: table["value"] + 1) is None
    store.save("a scene", {"other": 1})
    assert store.load("a scene", lambda table: table["value"] + 1) is None
