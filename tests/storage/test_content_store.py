"""Stored results: found by what they follow from, whole or not at all, and no more of them than there is room for."""

import os
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest

from srbval.storage import content_store
from srbval.storage.content_store import ABANDONED_S, FRESH, ContentStore, make_room, stored_results


def store_in(folder: Path) -> ContentStore:
    return ContentStore(kind="scene", computed_by="srbval.errors", folder=folder)


def test_what_was_saved_is_loaded_until_the_code_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = store_in(tmp_path / "store")
    assert store.load("a scene", dict) is None
    store.save("a scene", {"x": 1.5, "y": float("inf")})
    assert store.load("a scene", dict) == {"x": 1.5, "y": float("inf")}
    assert store.load("another", dict) is None
    assert store.load("a scene", lambda table: table["missing"]) is None
    monkeypatch.setattr(content_store, "content_version", lambda _, **__: "newer")
    assert store.load("a scene", dict) is None


def test_whoever_wants_fresh_results_reads_none(tmp_path: Path) -> None:
    store = store_in(tmp_path)
    store.save("a scene", {"x": 1.5})
    with stored_results(fresh=True) as read_utc:
        assert store.load("a scene", dict) is None
        assert (os.environ[FRESH], read_utc) == ("1", [])
    with stored_results() as read_utc:
        assert store.load("a scene", dict) == {"x": 1.5}
        assert len(read_utc) == 1


def test_a_damaged_file_is_as_good_as_none(tmp_path: Path) -> None:
    """Whichever byte is another, and wherever the file ends."""
    store = store_in(tmp_path)
    store.save("a scene", {"x": 1.5})
    path = store.path("a scene")
    whole = path.read_bytes()
    for place in range(len(whole)):
        for damaged in (whole[:place], whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :]):
            path.write_bytes(damaged)
            assert store.load("a scene", dict) is None, damaged
    path.write_bytes(whole)
    assert store.load("a scene", dict) == {"x": 1.5}


def test_what_was_not_used_for_longest_goes(tmp_path: Path) -> None:
    store, names = store_in(tmp_path), ("first", "second", "third")
    for number, name in enumerate(names):
        store.save(name, {"x": 1})
        os.utime(store.path(name), (1000 + number, 1000))
    assert store.load("first", dict), "which is used then"
    (tmp_path / "thesis.txt").write_text("mine")
    (tmp_path / ".scene.h5.abcdefgh.srbval-part").write_text("of a process that was killed")
    os.utime(tmp_path / ".scene.h5.abcdefgh.srbval-part", (0, time.time() - 2 * ABANDONED_S))
    make_room(tmp_path, 2.5 * store.path("first").stat().st_size)
    assert {name for name in names if store.path(name).exists()} == {"first", "third"}
    assert [path.name for path in tmp_path.iterdir() if not path.name.startswith("scene-")] == ["thesis.txt"]


def test_a_cache_that_cannot_be_written_stores_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the folder's place")
    store = store_in(tmp_path / "file")
    store.save("a scene", {"x": 1})
    assert store.load("a scene", dict) is None


WRITES = 40  # of each process, of the same few results


def write_and_read(folder: Path) -> bool:
    store, found = store_in(folder), []
    for number in range(WRITES):
        store.save(str(number % 3), {"x": [number % 3] * 1000})
        make_room(folder, 10_000)
        found.append(store.load(str(number % 3), lambda table: table["x"]) in (None, [number % 3] * 1000))
    return all(found)


def test_processes_do_not_disturb_each_other(tmp_path: Path) -> None:
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        assert all(pool.map(write_and_read, [tmp_path, tmp_path]))
