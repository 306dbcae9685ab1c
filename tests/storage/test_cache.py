"""One cache folder with a sub-folder for each kind of content; shown with sizes and cleared."""

from __future__ import annotations

from pathlib import Path

import platformdirs
import pytest

from srbval.errors import ConfigurationError
from srbval.storage.cache import KERNEL_VARIABLE, cache_folder, cache_use, clear_cache


@pytest.fixture(autouse=True)
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(platformdirs, "user_cache_dir", lambda name: str(tmp_path / name))
    monkeypatch.delenv(KERNEL_VARIABLE, raising=False)
    return tmp_path / "srbval"


def fill(kind: str, *sizes: int) -> Path:
    folder = cache_folder(kind) / "version"
    folder.mkdir(parents=True)
    for number, size in enumerate(sizes):
        (folder / str(number)).write_bytes(bytes(size))
    return cache_folder(kind)


def used() -> dict[str, tuple[int, int]]:
    return {use.kind: (use.files, use.size_bytes) for use in cache_use()}


def test_an_empty_cache_holds_nothing(root: Path) -> None:
    assert cache_use() == ()
    assert clear_cache() == ()
    assert not root.exists()


def test_kinds_lie_side_by_side_with_their_sizes(root: Path) -> None:
    assert fill("results", 10, 20) == root / "results"
    assert fill("kernels", 5) == root / "kernels"
    assert used() == {"kernels": (1, 5), "results": (2, 30)}


def test_kernels_of_another_place_are_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernels = fill("kernels", 5)
    monkeypatch.setenv(KERNEL_VARIABLE, str(tmp_path / "elsewhere"))
    assert cache_use() == ()
    assert clear_cache() == ()
    assert kernels.is_dir()


def test_kernels_go_where_numba_is_told_to_put_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(KERNEL_VARIABLE, str(tmp_path / "elsewhere"))
    assert fill("kernels", 5) == tmp_path / "elsewhere" / "kernels"
    assert fill("results", 1) == tmp_path / "srbval" / "results"
    assert used() == {"kernels": (1, 5), "results": (1, 1)}
    clear_cache()
    assert (tmp_path / "elsewhere").exists()
    assert used() == {}


def test_one_kind_or_all_of_them_are_cleared(root: Path) -> None:
    fill("results", 10)
    fill("references", 20)
    fill("kernels", 5)
    (deleted,) = clear_cache("references")
    assert (deleted.folder, deleted.size_bytes) == (root / "references", 20)
    assert used() == {"kernels": (1, 5), "results": (1, 10)}
    clear_cache()
    assert used() == {}


def test_a_kind_that_is_not_there_is_refused_and_nothing_is_deleted() -> None:
    fill("results", 10)
    with pytest.raises(ConfigurationError, match=r"no 'kernel'.*results"):
        clear_cache("results", "kernel")
    assert used() == {"results": (1, 10)}
