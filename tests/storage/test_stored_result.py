"""Stored results: the newest one that can be read, wherever it lies; why evidence no longer holds."""

import math
from pathlib import Path
from typing import Any

import pytest

from srbval.storage import stored_result
from srbval.storage.behaviour import changed_parts, differing, fingerprint_of, same
from srbval.storage.json_files import write_json
from srbval.storage.stored_result import ResultKind, StoredResult, newest_result

NAME = "stability"
NOW = {"full": {"outer: cage_ratio": 0.43, "outer: rms_m_s2": 2.0}, "reading": {"H: hz": 97.0}}
CONTENT: dict[str, Any] = {
    "schema_version": 3, "kind": NAME, "made_utc": "2026-01-01T00:00:00+00:00", "git_revision": "abc",
    "command": "srbval evidence", "minutes": 5.5, "machine": {"processor": "P", "usable_cores": 2},
    "code_sha256": "own", "fingerprint": {"full": NOW["full"]},
}  # fmt: skip


@pytest.fixture(autouse=True)
def own_hash(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stored_result, "code_sha256", lambda _: "own")


def result(**changes: Any) -> StoredResult:
    return StoredResult(path=Path(f"{NAME}.json"), content=CONTENT | changes)


def test_the_newest_is_found_with_its_origin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stored_result, "cache_folder", lambda _: tmp_path / "cache")
    monkeypatch.setattr(stored_result, "shipped_folder", lambda _: tmp_path)
    assert newest_result(NAME) is None
    write_json(tmp_path / f"{NAME}.json", CONTENT)
    (tmp_path / "cache").mkdir()
    write_json(tmp_path / "cache" / f"{NAME}.json", CONTENT | {"made_utc": "2026-01-02T00:00:00+00:00"})
    found = newest_result(NAME)
    assert found is not None
    assert found.path.parent.name == "cache"
    assert found.origin == {
        "kind": "evidence", "made_utc": "2026-01-02T00:00:00+00:00", "git_revision": "abc", "minutes": 5.5,
        "command": "srbval evidence", "processor": "P", "usable_cores": 2, "file": f"{NAME}.json",
    }  # fmt: skip
    write_json(tmp_path / "cache" / f"{NAME}.json", CONTENT | {"kind": "another"})
    assert newest_result(NAME).path.parent == tmp_path  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({}, None),
        ({"git_revision": "abc-dirty"}, "changed working tree"),
        ({"code_sha256": "other"}, "computes something else"),
        ({"fingerprint": None}, "does not state the fingerprint"),
        ({"fingerprint": {"full": {**NOW["full"], "outer: rms_m_s2": 2.001}}}, "part full behaves differently"),
        ({"fingerprint": {"full": {**NOW["full"], "gone": 1.0}}}, "gone"),
    ],
)
def test_evidence_is_stale_if_what_it_depends_on_has_changed(changes: dict[str, Any], why: str | None) -> None:
    found = result(**changes).why_stale(NOW)
    assert found is None if why is None else why in (found or "")


@pytest.mark.parametrize(
    ("changes", "kind"), [({"evidence_kind": "recorded"}, "recorded"), ({"computed_once": "blind"}, "document")]
)
def test_other_kinds_are_never_stale(changes: dict[str, Any], kind: str) -> None:
    found = result(**changes, code_sha256="other")
    assert found.kind is ResultKind(kind)
    assert found.why_stale({}) is None


def test_values_agree_within_their_tolerance() -> None:
    assert same("outer: rms_m_s2", 1e-12, 3e-11)  # rounding of a theoretical zero
    assert same("outer: cage_ratio", 0.43, 0.43 * (1 + 1e-7))
    assert not same("outer: cage_ratio", 0.43, 0.43 * (1 + 1e-5))
    assert same("a", math.nan, math.nan)
    assert not same("a", math.nan, 1.0)
    assert not same("a: status", "ok", "skidding")
    assert differing({"a": 1.0, "b": 2.0}, {"b": 2.1, "c": 3.0}) == ["b", "c", "a"]
    assert changed_parts(NOW, NOW | {"reading": {}}, ["full"]) == {}
    assert fingerprint_of({"a": {"b": None}})["a"]["b"] != 0


@pytest.mark.parametrize(
    "content", [b"", b"[" * 200_000, b"9" * 5000, b"\xff\xfe{}", b"null", b'{"kind": "stability"}']
)
def test_a_result_that_cannot_be_read_counts_as_absent(
    content: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stored_result, "cache_folder", lambda _: tmp_path)
    monkeypatch.setattr(stored_result, "shipped_folder", lambda _: tmp_path / "none")
    (tmp_path / f"{NAME}.json").write_bytes(content)
    assert newest_result(NAME) is None
