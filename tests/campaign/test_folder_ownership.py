"""Whose folder it is, and that nothing which is not the campaign's own is written or removed."""

from __future__ import annotations

from pathlib import Path

import pytest

from srbval.campaign.case import CaseResult, Ending
from srbval.campaign.folder import EARLIER, PLAN, TABLE, CampaignFolder
from srbval.campaign.run import run_campaign
from srbval.campaign.status import campaign_status, verify_campaign
from srbval.errors import ConfigurationError, DataError
from tests.campaign.in_process import InProcess
from tests.campaign.mixed_folder import damaged_names, empty, files_of, good_results, resume
from tests.campaign.small import content, small


@pytest.mark.parametrize(("first", "last"), [(0, 1), (2, 3), (7, 8), (3, 14)])
def test_with_a_damaged_plan_nothing_takes_the_folder_over(first: int, last: int, whole: Path, folder: Path) -> None:
    """Lines lost: the first, a case, the one behind the plan, half of the file."""
    lines = (folder / PLAN).read_bytes().splitlines(keepends=True)
    lines[first:last] = [b"{}\n"]
    (folder / PLAN).write_bytes(b"".join(lines))
    assert damaged_names(folder) == {PLAN}
    kept = {path: path.read_bytes() for path in files_of(folder)}
    if b'"case"' in b"".join(lines[1:7]) and len([line for line in lines if line.startswith(b'{"case"')]) < 6:
        with pytest.raises(DataError, match="results are kept"):
            campaign_status(folder)
    with pytest.raises(ConfigurationError, match="holds campaign 'small', not 'other'"):
        resume(folder, name="other")
    assert {path: path.read_bytes() for path in files_of(folder)} == kept
    found, said = resume(folder)
    assert (found.ran, found.done) == (0, 6)
    assert f"{PLAN} was damaged" in said[0]
    assert content(folder) == content(whole)
    assert verify_campaign(folder).ok


@pytest.mark.parametrize("name", ["small", "other"])
def test_nobodys_folder_is_refused(name: str, whole: Path, folder: Path) -> None:
    empty(folder / PLAN)
    kept = {path: path.read_bytes() for path in files_of(folder)}
    with pytest.raises(DataError, match=r"nothing says whose folder it is.*remove campaign.jsonl and results.csv"):
        resume(folder, name=name)
    assert {path: path.read_bytes() for path in files_of(folder)} == kept
    for path in (PLAN, TABLE):  # what the message says
        (folder / path).unlink()
    assert resume(folder)[0].ran == 0
    assert content(folder) == content(whole)


@pytest.mark.parametrize("name", [PLAN, TABLE, *EARLIER])
def test_a_folder_with_anothers_files_is_left_alone(name: str, tmp_path: Path) -> None:
    """As after ``-o .`` where somebody keeps a table of that name."""
    (tmp_path / name).write_text('{"name": "small", "theirs": 1}\n')
    with pytest.raises(DataError, match="nothing was changed"):
        run_campaign(small(axes=[]), tmp_path, engine=InProcess())
    assert (tmp_path / name).read_text() == '{"name": "small", "theirs": 1}\n'
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([name, "lock"])


def test_a_users_own_files_stay(folder: Path) -> None:
    own = [folder / "notes.h5", folder / "cases" / "ab" / "notes.h5", folder / ".x.part",
           folder / "cases" / "ab" / f".{'a' * 31}.h5.abcdefgh.srbval-part", folder / "cases" / "x.h5"]  # fmt: skip
    for path in own:
        path.parent.mkdir(exist_ok=True)
        path.write_text("mine")
    empty(good_results(folder)[0])
    assert resume(folder)[0].done == 6
    assert [path.read_text() for path in own] == ["mine"] * len(own)
    assert verify_campaign(folder).ok


@pytest.mark.parametrize("place", ["cases", PLAN, TABLE, "lock"])
def test_links_are_not_followed(place: str, folder: Path, tmp_path: Path) -> None:
    """Neither to write nor to remove."""
    outside = tmp_path / "outside"
    (folder / place).rename(outside)
    if place == "lock":
        outside.write_text("mine")
    (folder / place).symlink_to(outside)
    kept = {path: path.read_bytes() for path in [outside, *outside.rglob("*")] if path.is_file()}
    with pytest.raises(DataError, match=r"nothing was changed|cannot be written"):
        resume(folder, seed=1)
    assert {path: path.read_bytes() for path in [outside, *outside.rglob("*")] if path.is_file()} == kept


def test_a_key_is_checked_before_it_becomes_a_path(tmp_path: Path) -> None:
    folder = CampaignFolder(tmp_path)
    for key in ("../victim", "a" * 31, "a" * 33, "A" * 32, "a" * 31 + "\n", "", "a" * 32 + "\0", "٣" * 32):
        with pytest.raises(DataError, match="not the key of a result"):
            folder.result_path(key)
    victim = tmp_path / "victim.h5"
    victim.write_text("mine")
    run_campaign(small(axes=[]), tmp_path / "run", engine=InProcess())
    for number in range(3):
        result = CaseResult(key="../" * number + "victim", ending=Ending.CRASHED, reason="")
        CampaignFolder(tmp_path / "run").note_end(result)
    run_campaign(small(axes=[]), tmp_path / "run", engine=InProcess())
    assert victim.read_text() == "mine"
