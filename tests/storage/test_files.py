"""A file is replaced as a whole or stays as it was."""

import os
from pathlib import Path

import pytest

from srbval.errors import DataError
from srbval.storage.files import atomic_write, remove_unfinished


def test_the_old_file_is_there_until_the_new_one_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "x" / "y" / "a.txt"
    with atomic_write(path) as part:  # which makes the folders
        part.write_text("old")
    with atomic_write(path) as part:
        part.write_text("new")
        assert path.read_text() == "old"
        assert part.parent == path.parent  # the same file system, so that renaming is atomic
    assert path.read_text() == "new"
    assert list(path.parent.iterdir()) == [path]


def test_an_interruption_leaves_nothing(tmp_path: Path) -> None:
    def interrupted() -> None:
        with atomic_write(tmp_path / "a.txt") as part:
            part.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_place_of_the_folder_is_a_data_error(tmp_path: Path) -> None:
    (tmp_path / "a").touch()
    with pytest.raises(DataError, match="cannot be written"), atomic_write(tmp_path / "a" / "b.txt"):
        pass


@pytest.mark.parametrize("name", ["pipe", "a\0b", "\ud800"])
def test_what_no_file_can_replace_stays(name: str, tmp_path: Path) -> None:
    """A pipe stands for the devices in /dev, which root could replace, to the harm of every program."""
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(DataError), atomic_write(tmp_path / name) as part:
        part.touch()
    assert [path.is_fifo() for path in tmp_path.iterdir()] == [True]


def test_only_what_this_program_left_unfinished_is_removed(tmp_path: Path) -> None:
    own = tmp_path / ".a.txt.x0_yz9ab.srbval-part"
    kept = [".a.txt.x.part", ".b.txt.x0_yz9ab.srbval-part", ".x.part", "a.txt", ".a.txt.srbval-part"]
    for name in (own.name, *kept):
        (tmp_path / name).write_text("x")
    (tmp_path / ".a.txt.aaaaaaaa.srbval-part").mkdir()
    (tmp_path / ".a.txt.bbbbbbbb.srbval-part").symlink_to(own)
    remove_unfinished(tmp_path, "a.txt".__eq__)
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {*kept, ".a.txt.aaaaaaaa.srbval-part", ".a.txt.bbbbbbbb.srbval-part"}
