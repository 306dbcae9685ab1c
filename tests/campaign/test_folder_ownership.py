"""Whose folder it is, and that nothing which is not the campaign's own is written or removed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from srbval.campaign.campaign_folder import CampaignFolder
from srbval.campaign.case import CaseOutcome, Ending
from srbval.campaign.run import run_campaign
from srbval.campaign.status import campaign_status
from srbval.campaign.verify import verify_campaign
from srbval.errors import ConfigurationError, DataError
from tests.campaign.in_process import InProcess
from tests.campaign.mixed_folder import add_zeros, cut, damaged_names, empty, files_of, good_results, resume
from tests.campaign.small import content, small


@pytest.mark.parametrize("name", ["campaign.json", "plan.jsonl"])
@pytest.mark.parametrize("damage", [cut, empty, add_zeros, Path.unlink, "flip"])
def test_with_a_damaged_plan_nothing_takes_the_folder_over(name: str, damage: Any, whole: Path, folder: Path) -> None:
    if damage == "flip":
        raw = bytearray((folder / name).read_bytes())
        raw[raw.index(b"small")] ^= 1
        (folder / name).write_bytes(raw)
    else:
        damage(folder / name)
    assert name in damaged_names(folder)
    kept = {path: path.read_bytes() for path in files_of(folder)}
    with pytest.raises(DataError, match="results are kept"):
        campaign_status(folder)
    with pytest.raises(ConfigurationError, match="holds campaign 'small', not 'other'"):
        resume(folder, name="other")
    assert {path: path.read_bytes() for path in files_of(folder)} == kept
    found, said = resume(folder)
    assert (found.ran, found.done) == (0, 6)
    assert f"{name} was damaged" in said[0]
    assert content(folder) == content(whole)
    assert verify_campaign(folder).ok


@pytest.mark.parametrize("name", ["small", "other"])
def test_nobodys_folder_is_refused(name: str, whole: Path, folder: Path) -> None:
    for damaged in ("campaign.json", "plan.jsonl"):
        empty(folder / damaged)
    kept = {path: path.read_bytes() for path in files_of(folder)}
    with pytest.raises(DataError, match=r"nothing says whose folder it is.*remove those two"):
        resume(folder, name=name)
    assert {path: path.read_bytes() for path in files_of(folder)} == kept
    for path in ("campaign.json", "plan.jsonl", "journal.jsonl", "results.csv"):  # what the message says
        (folder / path).unlink()
    assert resume(folder)[0].ran == 0
    assert content(folder) == content(whole)


@pytest.mark.parametrize("name", ["campaign.json", "results.csv", "journal.jsonl", "plan.jsonl"])
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


@pytest.mark.parametrize("place", ["cases", "journal.jsonl", "results.csv", "plan.jsonl", "lock"])
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
        outcome = CaseOutcome(key="../" * number + "victim", ending=Ending.CRASHED, reason="")
        CampaignFolder(tmp_path / "run").note_end(outcome)
    run_campaign(small(axes=[]), tmp_path / "run", engine=InProcess())
    assert victim.read_text() == "mine"
