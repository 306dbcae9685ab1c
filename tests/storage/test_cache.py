"""One cache folder with a sub-folder for each kind of content; stored results, whole or not at all."""

import os
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import platformdirs
import pytest

from srbval.errors import ConfigurationError
from srbval.storage import content_store
from srbval.storage.content_store import ABANDONED_S, FRESH, ContentStore, make_room, stored_results
from srbval.storage.installation import KERNEL_VARIABLE, cache_folder, cache_use, clear_cache


@pytest.fixture(autouse=True)
def root(tmp_path, monkeypatch):
    monkeypatch.setattr(platformdirs, "user_cache_dir", lambda name: str(tmp_path / name))
    monkeypatch.delenv(KERNEL_VARIABLE, raising=False)
    return tmp_path / "srbval"


def fill(kind: str, *sizes: int) -> Path:
    folder = cache_folder(kind) / "version"
    folder.mkdir(parents=True)
    for number, size in enumerate(sizes):
        (folder / f"{number}.json").write_bytes(bytes(size))
    return cache_folder(kind)


def used() -> dict[str, tuple[int, int]]:
    return {use["kind"]: (use["files"], use["size_bytes"]) for use in cache_use()}


def test_one_kind_or_all_of_them_are_cleared(root):
    assert fill("results", 10, 20) == root / "results"
    fill("references", 20)
    fill("kernels", 5)
    with pytest.raises(ConfigurationError, match=r"no 'kernel'.*results"):
        clear_cache("results", "kernel")
    assert used() == {"kernels": (1, 5), "references": (1, 20), "results": (2, 30)}
    (deleted,) = clear_cache("references")
    assert (deleted["folder"], deleted["size_bytes"]) == (root / "references", 20)
    assert used() == {"kernels": (1, 5), "results": (2, 30)}
    clear_cache()
    assert used() == {}


def test_kernels_go_where_numba_is_told_to_put_them(tmp_path, monkeypatch):
    """Clearing the cache leaves kernels of another place, and other files in that folder, alone."""
    before = fill("kernels", 5)
    monkeypatch.setenv(KERNEL_VARIABLE, str(tmp_path / "elsewhere"))
    assert clear_cache() == []
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere/thesis.txt").write_text("mine")
    assert fill("kernels", 6) == tmp_path / "elsewhere/srbval/kernels"
    assert used() == {"kernels": (1, 6)}
    clear_cache()
    assert used() == {}
    assert before.is_dir()
    assert (tmp_path / "elsewhere/thesis.txt").is_file()


def store_in(folder: Path) -> ContentStore:
    return ContentStore(kind="scene", computed_by="srbval.errors", folder=folder)


def test_what_was_saved_is_loaded_until_the_code_changes(tmp_path, monkeypatch):
    store = store_in(tmp_path / "store")
    assert store.load("a scene", dict) is None
    store.save("a scene", {"x": 1.5, "y": float("inf")})
    assert store.load("a scene", dict) == {"x": 1.5, "y": float("inf")}
    assert store.load("another", dict) is None
    assert store.load("a scene", lambda table: table["missing"]) is None
    store.path("another").write_bytes(store.path("a scene").read_bytes()[:-1])  # bytes: `test_every_byte_counts`
    assert store.load("another", dict) is None
    monkeypatch.setattr(content_store, "content_version", lambda _, **__: "newer")
    assert store.load("a scene", dict) is None


def test_whoever_wants_fresh_results_reads_none(tmp_path):
    store = store_in(tmp_path)
    store.save("a scene", {"x": 1.5})
    with stored_results(fresh=True) as read_utc:
        assert store.load("a scene", dict) is None
        assert (os.environ[FRESH], read_utc) == ("1", [])
    with stored_results() as read_utc:
        assert store.load("a scene", dict) == {"x": 1.5}
        assert len(read_utc) == 1


def test_what_was_not_used_for_longest_goes(tmp_path):
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


def test_a_cache_that_cannot_be_written_stores_nothing(tmp_path):
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


def test_processes_do_not_disturb_each_other(tmp_path):
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        assert all(pool.map(write_and_read, [tmp_path, tmp_path]))
