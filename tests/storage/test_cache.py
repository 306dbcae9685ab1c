"""One cache folder with a sub-folder for each kind of content; shown with sizes and cleared."""

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
        name = f"step.{number}.nbc" if kind == "kernels" else f"scene-{number:032x}.json"
        (folder / name).write_bytes(bytes(size))
    return cache_folder(kind)


def used() -> dict[str, tuple[int, int]]:
    return {use.kind: (use.files, use.size_bytes) for use in cache_use()}


def test_one_kind_or_all_of_them_are_cleared(root: Path) -> None:
    assert fill("results", 10, 20) == root / "results"
    fill("references", 20)
    fill("kernels", 5)
    with pytest.raises(ConfigurationError, match=r"no 'kernel'.*results"):
        clear_cache("results", "kernel")
    assert used() == {"kernels": (1, 5), "references": (1, 20), "results": (2, 30)}
    (deleted,) = clear_cache("references")
    assert (deleted.folder, deleted.size_bytes) == (root / "references", 20)
    assert used() == {"kernels": (1, 5), "results": (2, 30)}
    clear_cache()
    assert used() == {}


def test_kernels_go_where_numba_is_told_to_put_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of another place are left alone."""
    before = fill("kernels", 5)
    monkeypatch.setenv(KERNEL_VARIABLE, str(tmp_path / "elsewhere"))
    assert clear_cache() == ()
    assert fill("kernels", 6) == tmp_path / "elsewhere" / "kernels"
    assert used() == {"kernels": (1, 6)}
    clear_cache()
    assert used() == {}
    assert before.is_dir()


def test_what_is_not_ours_stays(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The user's own files beside ours, and whatever links lead to, in the cache and in numba's folder."""
    monkeypatch.setenv(KERNEL_VARIABLE, str(tmp_path / "mine"))
    fill("kernels", 5)
    fill("results", 5)
    precious = tmp_path / "precious"
    precious.mkdir()
    kept = [
        tmp_path / "mine/kernels/thesis.txt",
        tmp_path / "mine/kernels/version/compiled-notes.txt",
        root / "results/notes.json",
        root / "photos/summer.jpg",
        precious / "other.nbc",
    ]
    for path in kept:
        path.parent.mkdir(exist_ok=True)
        path.write_text("mine")
    (tmp_path / "mine/kernels/version/away").symlink_to(precious, target_is_directory=True)
    (tmp_path / "mine/kernels/version/linked.nbc").symlink_to(precious / "other.nbc")
    (root / "elsewhere").symlink_to(precious, target_is_directory=True)
    cleared = {use.kind: (use.files, use.left) for use in clear_cache()}
    assert cleared == {"kernels": (1, 4), "photos": (0, 1), "results": (1, 1)}
    assert all(path.read_text() == "mine" for path in kept)
    assert {use.kind: use.files for use in cache_use()} == {"kernels": 0, "photos": 0, "results": 0}
    assert not (root / "results/version").exists(), "an empty folder of ours goes"
