"""What rots in a campaign's folder is found, said and run again; nobody else's files are written or removed.

`SRBVAL_FLIPS` is the number of flipped bits (2000 take some minutes), `SRBVAL_JOURNALS` that of hostile folders.
"""

import errno
import hashlib
import json
import os
import random
import shutil
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbval.campaign.case import CaseResult, Ending, write_result
from srbval.campaign.export import ExportSettings, export_campaign
from srbval.campaign.folder import PLAN, TABLE, CampaignFolder
from srbval.campaign.status import campaign_status, verify_campaign
from srbval.cli import main
from srbval.errors import ConfigurationError, DataError, SrbvalError
from tests.campaign.campaigns import content, damaged_names, files_of, good_results, lines_of, resume
from tests.plan.test_hostile_json import HOSTILE, TEXTS, mutated

FLIPS = int(os.environ.get("SRBVAL_FLIPS", "40"))
JOURNALS = int(os.environ.get("SRBVAL_JOURNALS", "30"))
BATCH = 20  # flips of different files that one resumed run repairs
HANG_S = 60  # for one command on a folder of six cases, none of which is run; they take a tenth of a second


def test_every_flipped_bit_is_found_and_repaired(whole: Path, folder: Path) -> None:
    """In results, plan, journal and table: one bit each, and several files at once for the repair."""
    chance = random.Random(FLIPS)
    files = sorted(path.relative_to(whole) for path in files_of(whole))
    weights = [(whole / name).stat().st_size ** 0.5 for name in files]
    before, outcomes = content(whole), campaign_status(whole).failed
    flips = 0
    while flips < FLIPS:
        flipped = {}
        for name in sorted(set(chance.choices(files, weights, k=BATCH)[: FLIPS - flips])):
            raw = bytearray((whole / name).read_bytes())
            raw[chance.randrange(len(raw))] ^= 1 << chance.randrange(8)
            (folder / name).write_bytes(raw)
            assert damaged_names(folder) == {name.name}
            (folder / name).write_bytes((whole / name).read_bytes())
            flipped[name] = bytes(raw)
        flips += len(flipped)
        for name, content_ in flipped.items():
            (folder / name).write_bytes(content_)
        found, said = resume(folder)
        results = sum(name.suffix == ".h5" for name in flipped)
        assert (found.done, found.damaged, found.failed) == (6, results, outcomes)
        assert not results or f"damaged results, removed and run again: {results};" in " ".join(said)
        assert content(folder) == before
        assert verify_campaign(folder).ok


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def folder_in_its_place(path: Path) -> None:
    path.unlink()
    path.mkdir()
    (path / "notes.txt").write_text("mine")


def foreign(path: Path) -> None:
    import h5py

    path.unlink()
    with h5py.File(path, "w") as file:
        file["value"] = [1.0, 2.0]


DAMAGES: dict[str, Callable[[Path], object]] = {
    "cut": cut,
    "zeros added": lambda path: path.write_bytes(path.read_bytes() + bytes(100)),
    "loop": lambda path: (path.unlink(), path.symlink_to(path.name)),
    "folder": folder_in_its_place,
    "foreign": foreign,
    "another case": lambda path: shutil.copy(next(p for p in good_results(path.parents[2]) if p != path), path),
    "pipe": lambda path: (path.unlink(), os.mkfifo(path)),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_result_is_named_and_run_again(damage: str, whole: Path, folder: Path) -> None:
    path = good_results(folder)[0]
    DAMAGES[damage](path)
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
    if damage == "folder":
        assert [note.read_text() for note in path.parent.glob("*.aside/notes.txt")] == ["mine"]


def test_results_that_are_gone(whole: Path, folder: Path) -> None:
    gone = good_results(folder)[0]
    gone.unlink()
    (folder / TABLE).unlink()
    assert damaged_names(folder) == {gone.name}
    resume(folder)
    assert content(folder) == content(whole)
    (folder / TABLE).unlink()
    assert damaged_names(folder) == {TABLE}
    assert campaign_status(folder).table is not None
    assert verify_campaign(folder).ok


def test_a_case_is_tried_again_by_what_its_result_says(whole: Path, folder: Path) -> None:
    """The journal may be cut off."""
    path = good_results(folder)[0]
    path.unlink()
    write_result(path, CaseResult(key=path.stem, ending=Ending.TIMED_OUT, reason="too long"), None)
    (folder / PLAN).write_bytes(b"".join(lines_of(folder)[:-6]))
    found, _ = resume(folder)
    assert (found.ran, found.damaged, len(found.failed)) == (1, 0, 3)
    assert content(folder) == content(whole)


def test_results_of_another_plan_and_of_none_yet(folder: Path) -> None:
    """A damaged one of another plan is named and left; a case that has not ended is no damage."""
    resume(folder, seed=7)  # new cases; the six are of no plan now, but for those that were refused
    kept = {path: path.read_bytes() for path in good_results(folder)}
    planned = {case.key for case in CampaignFolder(folder).journal().cases}
    left = next(path for path in kept if path.stem not in planned)
    cut(left)
    (found,) = verify_campaign(folder).damaged
    assert (found.file, "not in this plan: remove it" in found.why) == (left, True)
    assert resume(folder, seed=7)[0].damaged == 0
    left.unlink()
    missing = next(path for path in kept if path.stem in planned)
    ended = [line for line in lines_of(folder) if not line.startswith(b'{"ended"') or missing.stem.encode() not in line]
    (folder / PLAN).write_bytes(b"".join(ended))
    missing.unlink()
    assert verify_campaign(folder).ok


def test_a_full_disk_while_refused_cases_are_written(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    (folder / "lock-holder.json").mkdir()
    assert resume(folder)[0].done == 6
    shutil.rmtree(folder / "cases")
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(DataError, match=r"cannot be written \(No space left on device\)"):
        resume(folder)


def test_verify_command(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def ask(*arguments: str) -> tuple[int, Any]:
        code = main(["campaign", *arguments, "--json"])
        return code, json.loads(capsys.readouterr().out)

    before = {path: path.stat().st_mtime_ns for path in [folder, *folder.rglob("*")]}
    code, found = ask("verify", str(folder))
    assert (code, found["ok"], found["damaged"], found["results"]) == (0, True, [], 6)
    assert {path: path.stat().st_mtime_ns for path in before} == before
    path = good_results(folder)[0]
    DAMAGES["zeros added"](path)
    code, found = ask("verify", str(folder))
    assert (code, found["ok"], found["status"]) == (3, False, "damaged")
    assert found["damaged"][0]["file"] == str(path)
    assert "checksum" in found["damaged"][0]["why"]
    assert main(["campaign", "verify", str(folder)]) == 3
    assert path.name in capsys.readouterr().out
    code, found = ask("status", str(folder))
    assert (code, found["done"], len(found["damaged"])) == (3, 5, 1)
    assert ask("verify", str(folder.parent / "none"))[0] == 3


@pytest.mark.parametrize(
    ("first", "last", "known"),
    [(0, 1, True), (7, 8, True), (2, 3, False), (3, 14, False)],
    ids=["the first line", "the one behind the plan", "a case", "half of the file"],
)
def test_lost_lines_of_the_plan(first: int, last: int, known: bool, whole: Path, folder: Path) -> None:
    """Where a case is lost, status stops; nobody takes the folder over; the next run repairs it."""
    lines = lines_of(folder)
    (folder / PLAN).write_bytes(b"".join([*lines[:first], b"{}\n", *lines[last:]]))
    assert damaged_names(folder) == {PLAN}
    kept = files_of(folder)
    with pytest.raises(ConfigurationError, match="holds campaign 'small', not 'other'"):
        resume(folder, name="other")
    assert files_of(folder) == kept
    if known:
        assert [found.file.name for found in campaign_status(folder).damaged] == [PLAN]
    else:
        with pytest.raises(DataError, match=r"damaged .*results are kept"):
            campaign_status(folder)
    found, said = resume(folder)
    assert (found.ran, found.done) == (0, 6)
    assert f"{PLAN} was damaged" in said[0]
    assert content(folder) == content(whole)
    assert verify_campaign(folder).ok


@pytest.mark.parametrize("name", ["small", "other"])
def test_nobodys_folder_is_refused(name: str, whole: Path, folder: Path) -> None:
    (folder / PLAN).write_bytes(b"")
    kept = files_of(folder)
    with pytest.raises(DataError, match=f"nothing says whose folder it is.*remove {PLAN} and {TABLE}"):
        resume(folder, name=name)
    assert files_of(folder) == kept
    for path in (PLAN, TABLE):  # what the message says
        (folder / path).unlink()
    assert resume(folder)[0].ran == 0
    assert content(folder) == content(whole)


@pytest.mark.parametrize("name", [PLAN, TABLE])
def test_a_folder_with_anothers_files_is_left_alone(name: str, tmp_path: Path) -> None:
    """As after ``-o .`` where somebody keeps a table of that name."""
    (tmp_path / name).write_text('{"name": "small", "theirs": 1}\n')
    with pytest.raises(DataError, match="nothing was changed"):
        resume(tmp_path)
    with pytest.raises(DataError, match="damaged"):
        campaign_status(tmp_path)
    assert (tmp_path / name).read_text() == '{"name": "small", "theirs": 1}\n'
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([name, "lock"])


def test_a_users_own_files_stay(folder: Path) -> None:
    own = [folder / "notes.h5", folder / "cases" / "ab" / "notes.h5", folder / ".x.part",
           folder / "cases" / "ab" / f".{'a' * 31}.h5.abcdefgh.srbval-part", folder / "cases" / "x.h5"]  # fmt: skip
    for path in own:
        path.parent.mkdir(exist_ok=True)
        path.write_text("mine")
    good_results(folder)[0].write_bytes(b"")
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
    for key in ("../victim", "a" * 31, "a" * 33, "A" * 32, "a" * 31 + "\n", "", "a" * 32 + "\0", "٣" * 32):
        with pytest.raises(DataError, match="not the key of a result"):
            CampaignFolder(tmp_path).result_path(key)


PATHS = ["../victim", "/etc/passwd", "a" * 32, "\u0000", "\u001b[2J", float("inf"), 10**4000]


def hostile_line(line: bytes, chance: random.Random) -> bytes:
    """A line with another value or key, and mostly the right check value."""
    document = json.loads(line)
    document.pop("check")
    changed = mutated(np.random.default_rng(chance.randrange(2**32)), document, [*HOSTILE, *PATHS])
    text = chance.choice([*TEXTS, *[json.dumps(changed).encode()] * 30]).removesuffix(b"}")
    check = hashlib.sha256(text).hexdigest()[:32].encode() if chance.random() < 0.9 else b"0" * 32
    return text + b', "check": "' + check + b'"}'


@pytest.fixture
def _no_hang() -> Iterator[None]:
    """End the test where one command takes longer than `HANG_S`."""

    def hang(*_: object) -> None:
        raise AssertionError(f"longer than {HANG_S} s")

    before = signal.signal(signal.SIGALRM, hang)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.usefixtures("_no_hang")
@pytest.mark.skipif(not hasattr(signal, "alarm"), reason="no alarm here")
def test_hostile_plans_and_journals(whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Whatever stands in them: an answer or an error of ours, and nothing outside the folder is touched."""
    chance = random.Random(JOURNALS)
    outside = tmp_path / "outside"
    folder = Path(shutil.copytree(whole, outside / "run"))
    names = ("victim.h5", "victim", f"{'a' * 32}.h5", "cases/victim.h5")
    for name in names:
        (outside / name).parent.mkdir(exist_ok=True)
        (outside / name).write_text("mine")
    repaired = 0
    for _ in range(JOURNALS):
        lines = (whole / PLAN).read_bytes().splitlines()
        for at in chance.sample(range(len(lines)), chance.choice([1, 1, 2])):
            lines[at] = hostile_line(lines[at], chance)
        (folder / PLAN).write_bytes(b"\n".join(lines) + chance.choice([b"\n", b""]))
        for command in (["status", str(folder)], ["verify", str(folder)], ["verify", str(folder), "--json"]):
            signal.alarm(HANG_S)
            assert main(["campaign", *command]) in (0, 1, 3), command
        signal.alarm(HANG_S)
        try:
            found, _said = resume(folder)
            assert (found.done, found.ran) == (6, 0)
            assert verify_campaign(folder).ok
            assert content(folder) == content(whole)
            repaired += 1
        except SrbvalError:
            shutil.rmtree(folder)
            shutil.copytree(whole, folder)
        signal.alarm(0)
        found_outside = {path for path in outside.rglob("*") if path.is_file() and folder not in path.parents}
        assert found_outside == {outside / name for name in names}
        assert {path.read_text() for path in found_outside} == {"mine"}
    capsys.readouterr()
    assert repaired > JOURNALS // 2  # one of the two lines that name the campaign is mostly left
