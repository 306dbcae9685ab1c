"""What rots in a campaign's folder is found, said and run again.

`SRBVAL_FLIPS` is the number of flipped bits (2000 take some minutes).
"""

from __future__ import annotations

import errno
import json
import os
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from srbval.campaign.campaign_folder import CampaignFolder
from srbval.campaign.case import Ending
from srbval.campaign.case_file import write_failure
from srbval.campaign.export import ExportSettings, export_campaign
from srbval.campaign.status import campaign_status
from srbval.campaign.verify import verify_campaign
from srbval.cli import main
from srbval.errors import DataError
from srbval.storage.json_files import checked_line
from tests.campaign.mixed_folder import add_zeros, cut, damaged_names, empty, files_of, flip, good_results, resume
from tests.campaign.small import content

FLIPS = int(os.environ.get("SRBVAL_FLIPS", "60"))
BATCH = 20  # flips of different files that one resumed run repairs


def test_every_flipped_bit_is_found_and_repaired(whole: Path, folder: Path) -> None:
    """In results, plan, journal, campaign file and table: one bit each, and several files at once for the repair."""
    chance = random.Random(FLIPS)
    files = [path.relative_to(whole) for path in files_of(whole)]
    weights = [(whole / name).stat().st_size ** 0.5 for name in files]
    before, outcomes = content(whole), campaign_status(whole).failed
    flips = 0
    while flips < FLIPS:
        hit = set(chance.choices(files, weights, k=BATCH)[: FLIPS - flips])
        if Path("plan.jsonl") in hit:
            hit.discard(Path("campaign.json"))  # with the names in both damaged nobody may go on, see below
        flipped = {name: flip((whole / name).read_bytes(), chance) for name in sorted(hit)}
        for name, raw in flipped.items():
            (folder / name).write_bytes(raw)
            assert damaged_names(folder) == {name.name}
            (folder / name).write_bytes((whole / name).read_bytes())
            flips += 1
        for name, raw in flipped.items():
            (folder / name).write_bytes(raw)
        found, said = resume(folder)
        results = sum(name.suffix == ".h5" for name in hit)
        assert (found.done, found.damaged) == (6, results)
        assert found.failed == outcomes
        assert not results or f"damaged results, removed and run again: {results};" in " ".join(said)
        assert content(folder) == before
        assert verify_campaign(folder).ok
    assert flips >= FLIPS
    print(f"{flips} flips found and repaired")


def loop(path: Path) -> None:
    path.unlink()
    path.symlink_to(path.name)


def folder_in_its_place(path: Path) -> None:
    path.unlink()
    path.mkdir()
    (path / "notes.txt").write_text("mine")


def pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def foreign(path: Path) -> None:
    import h5py

    path.unlink()
    with h5py.File(path, "w") as file:
        file["value"] = [1.0, 2.0]


def another_case(path: Path) -> None:
    others = [other for other in good_results(path.parents[2]) if other != path]
    shutil.copy(others[0], path)


DAMAGES = [
    cut,
    empty,
    add_zeros,
    loop,
    folder_in_its_place,
    foreign,
    another_case,
    *([pipe] if hasattr(os, "mkfifo") else []),
]


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: damage.__name__)
def test_a_damaged_result_is_named_and_run_again(damage: Callable[[Path], None], whole: Path, folder: Path) -> None:
    path = good_results(folder)[0]
    damage(path)
    assert damaged_names(folder) == {path.name}
    status = campaign_status(folder)
    assert (status.done, [found.file for found in status.damaged]) == (5, [path])
    with pytest.raises(DataError, match=path.name):
        export_campaign(folder, folder / "set.h5", ExportSettings(segment_s=1e-3))
    found, said = resume(folder)
    assert (found.done, found.ran, found.damaged) == (6, 1, 1)
    assert "damaged results, removed and run again: 1;" in said[0]
    assert content(folder) == content(whole)
    assert verify_campaign(folder).ok
    if damage is folder_in_its_place:
        assert [note.read_text() for note in path.parent.glob("*.aside/notes.txt")] == ["mine"]


def test_results_that_are_gone(whole: Path, folder: Path) -> None:
    gone = good_results(folder)[0]
    gone.unlink()
    (folder / "results.csv").unlink()
    assert damaged_names(folder) == {gone.name}
    resume(folder)
    assert content(folder) == content(whole)
    (folder / "results.csv").unlink()
    assert damaged_names(folder) == {"results.csv"}
    assert campaign_status(folder).table is not None
    assert verify_campaign(folder).ok


def test_a_case_is_tried_again_by_what_its_result_says(whole: Path, folder: Path) -> None:
    """The journal's line may be damaged."""
    path = good_results(folder)[0]
    path.unlink()
    write_failure(path, None, Ending.TIMED_OUT, "too long")
    empty(folder / "journal.jsonl")
    found, _ = resume(folder)
    assert (found.ran, found.damaged, len(found.failed)) == (1, 0, 3)
    assert content(folder) == content(whole)


def test_damaged_lines_of_the_journal_are_dropped_and_said(folder: Path) -> None:
    journal = folder / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(lines[0] + b"{rotten}\n" + b"".join(lines[1:]))
    assert [found.file.name for found in campaign_status(folder).damaged] == ["journal.jsonl"]
    _, said = resume(folder)
    assert "journal.jsonl was damaged" in said[0]
    assert journal.read_bytes() == b"".join(lines)
    journal.write_bytes(b"".join(lines)[:-7])  # its writer was killed
    assert verify_campaign(folder).ok
    assert resume(folder)[1] == []
    assert journal.read_bytes() == b"".join(lines[:-1])


def test_a_damaged_result_of_another_plan_is_named_and_left(folder: Path) -> None:
    resume(folder, seed=7)  # new cases; the six are of no plan now, but for those that were refused
    assert verify_campaign(folder).ok
    kept = {path: path.read_bytes() for path in good_results(folder)}
    left = [path for path in kept if path.stem not in {case.key for case in CampaignFolder(folder).planned()}]
    assert left
    cut(left[0])
    (found,) = verify_campaign(folder).damaged
    assert (found.file, "not in this plan: remove it" in found.why) == (left[0], True)
    assert resume(folder, seed=7)[0].damaged == 0
    left[0].unlink()
    assert verify_campaign(folder).ok


def test_what_a_campaign_has_not_done_yet_is_no_damage(folder: Path) -> None:
    folder_ = CampaignFolder(folder)
    missing = good_results(folder)[0]
    entries = [entry for entry in folder_.journal() if entry.key != missing.stem]
    (folder / "journal.jsonl").write_bytes(b"".join(map(checked_line, entries)))
    missing.unlink()
    assert verify_campaign(folder).ok


def test_what_is_strange_ends_in_one_line(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder in the place of the note who runs; a full disk while refused cases are written."""
    (folder / "lock-holder.json").mkdir()
    assert resume(folder)[0].done == 6

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    for path in (folder / "cases").glob("*/*.h5"):
        path.unlink()
    monkeypatch.setattr("srbval.campaign.run.write_failure", full)
    with pytest.raises(DataError, match=r"No space left on device.*Free some space"):
        resume(folder)


def test_verify_command(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def ask(*arguments: str) -> tuple[int, Any]:
        code = main(["campaign", *arguments, "--json"])
        return code, json.loads(capsys.readouterr().out)

    before = {path: path.stat().st_mtime_ns for path in [folder, *folder.rglob("*")]}
    code, found = ask("verify", str(folder))
    assert (code, found["ok"], found["damaged"], found["results"]) == (0, True, [], 6)
    path = good_results(folder)[0]
    raw = bytearray(path.read_bytes())
    raw[5000] ^= 1
    path.write_bytes(raw)
    code, found = ask("verify", str(folder))
    assert (code, found["ok"], found["status"]) == (3, False, "damaged")
    assert found["damaged"][0]["file"] == str(path)
    assert "checksum" in found["damaged"][0]["why"]
    assert {path: path.stat().st_mtime_ns for path in before if path.suffix != ".h5"} == {
        path: at for path, at in before.items() if path.suffix != ".h5"
    }
    assert main(["campaign", "verify", str(folder)]) == 3
    assert path.name in capsys.readouterr().out
    code, found = ask("status", str(folder))
    assert (code, found["done"], len(found["damaged"])) == (3, 5, 1)
    assert ask("verify", str(folder.parent / "none"))[0] == 3
