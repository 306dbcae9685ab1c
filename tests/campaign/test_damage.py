"""What rots in a campaign's folder is found, said and run again; nothing outside the folder is touched.

`SRBVAL_FLIPS` is the number of flipped bits (2000 take some minutes), `SRBVAL_JOURNALS` that of hostile folders.
"""

from __future__ import annotations

import errno
import json
import os
import random
import shutil
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from srbval.campaign.campaign_folder import CampaignFolder
from srbval.campaign.case import CaseOutcome, Ending
from srbval.campaign.case_file import write_failure
from srbval.campaign.export import ExportSettings, export_campaign
from srbval.campaign.run import run_campaign
from srbval.campaign.settings import Campaign
from srbval.campaign.status import campaign_status
from srbval.campaign.verify import verify_campaign
from srbval.cli import main
from srbval.errors import ConfigurationError, DataError, SrbvalError
from srbval.storage.checked_json import checked_line
from tests.campaign.in_process import InProcess
from tests.campaign.small import content, failing_point, small

FLIPS = int(os.environ.get("SRBVAL_FLIPS", "60"))
JOURNALS = int(os.environ.get("SRBVAL_JOURNALS", "60"))
BATCH = 20  # flips of different files that one resumed run repairs
HANG_S = 60  # for one command on a folder of six cases, none of which is run; they take a tenth of a second
POINTS = [{"defect.kind": "outer", "model": "planar"}, {"defect.kind": "inner", "model": "kinematic"},
          {"model": "planar"}, failing_point() | {"model": "full"}, {"load.radial": "-3 kN"},
          {"bearing": "skf-6205"}]  # fmt: skip
AXES = [{"kind": "list", "cases": POINTS}]


def mixed(**changes: Any) -> Campaign:
    """Three good cases with signals, one that the numerics lose, two that are refused."""
    return small(axes=AXES, **changes)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "run"
    found = run_campaign(mixed(), folder, engine=InProcess())
    assert (found.done, len(found.failed)) == (6, 3)
    assert verify_campaign(folder).ok
    return folder


@pytest.fixture
def folder(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "run"))


def resume(folder: Path, **changes: Any) -> tuple[Any, list[str]]:
    said: list[str] = []
    return run_campaign(mixed(**changes), folder, engine=InProcess(), message=said.append), said


def files_of(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file() and path.name != "lock")


def good_results(folder: Path) -> list[Path]:
    return sorted(path for path in (folder / "cases").glob("*/*.h5") if path.stat().st_size > 20_000)


def damaged_names(folder: Path) -> set[str]:
    return {found.file.name for found in verify_campaign(folder).damaged}


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


def flip(content: bytes, chance: random.Random) -> bytes:
    raw = bytearray(content)
    raw[chance.randrange(len(raw))] ^= 1 << chance.randrange(8)
    return bytes(raw)


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def empty(path: Path) -> None:
    path.write_bytes(b"")


def add_zeros(path: Path) -> None:
    path.write_bytes(path.read_bytes() + bytes(100))


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
    assert (found.file, "of no case of this plan: remove it" in found.why) == (left[0], True)
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
        with pytest.raises(DataError, match="no key of a result"):
            folder.result_path(key)
    victim = tmp_path / "victim.h5"
    victim.write_text("mine")
    run_campaign(small(axes=[]), tmp_path / "run", engine=InProcess())
    for number in range(3):
        outcome = CaseOutcome(key="../" * number + "victim", ending=Ending.CRASHED, reason="")
        CampaignFolder(tmp_path / "run").note_end(outcome)
    run_campaign(small(axes=[]), tmp_path / "run", engine=InProcess())
    assert victim.read_text() == "mine"


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


DEEP = "[" * 20_000 + "]" * 20_000
VALUES = [f"1{'0' * 5000}", f"1{'0' * 400}", "1e400", "-1", "0.5", "NaN", DEEP, "[" * 40 + "]" * 40, '"\\ud800"',
          '"\\u0000"', '"../victim"', '"/etc/passwd"', f'"{"a" * 32}"', "null", "true", "[]", "{}",
          '"\\u001b[2J"', '{"a": {"b": 1}}', '"' + "x" * 100_000 + '"']  # fmt: skip
BROKEN = [b"", b"\0" * 100, b"\xff\xfe{}", b"{", b"[]", b"null", b'{"check": "' + b"0" * 32 + b'"}']


def hostile_line(line: bytes, chance: random.Random) -> bytes:
    """A line with another value or key, and mostly the right check value."""
    table = json.loads(line)
    table.pop("check")
    key = chance.choice(list(table))
    marker = "<value>"
    kind = chance.randrange(4)
    if kind == 0:
        return chance.choice(BROKEN)
    if kind == 1:
        del table[key]
        table |= {"other": 1}
    elif kind == 2 and isinstance(table.get("point"), dict):
        table["point"] = {chance.choice(["a", "\0", "../x", "\ud800"]): marker}
    else:
        table[key] = marker
    text = json.dumps(table).replace(f'"{marker}"', chance.choice(VALUES)).removesuffix("}").encode()
    import hashlib

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
    folder = outside / "run"
    shutil.copytree(whole, folder)
    for name in ("victim.h5", "victim", f"{'a' * 32}.h5", "cases/victim.h5"):
        (outside / name).parent.mkdir(exist_ok=True)
        (outside / name).write_text("mine")
    names = ["journal.jsonl", "plan.jsonl", "campaign.json"]
    codes: dict[str, int] = {}
    for _ in range(JOURNALS):
        for name in chance.sample(names, chance.choice([1, 1, 2])):
            lines = (whole / name).read_bytes().splitlines()
            at = chance.randrange(len(lines))
            lines[at] = hostile_line(lines[at], chance)
            (folder / name).write_bytes(b"\n".join(lines) + chance.choice([b"\n", b""]))
        for command in (["status", str(folder)], ["verify", str(folder)], ["verify", str(folder), "--json"]):
            signal.alarm(HANG_S)
            code = main(["campaign", *command])
            assert code in (0, 1, 3), command
            codes[f"{command[0]} {code}"] = codes.get(f"{command[0]} {code}", 0) + 1
        signal.alarm(HANG_S)
        try:
            found, _said = resume(folder)
            assert (found.done, found.ran) == (6, 0)
            assert verify_campaign(folder).ok
            assert content(folder) == content(whole)
            ended = "run 0"
        except SrbvalError as error:
            ended = f"run {error.exit_code}"
            shutil.rmtree(folder)
            shutil.copytree(whole, folder)
        codes[ended] = codes.get(ended, 0) + 1
        signal.alarm(0)
        assert {path.read_text() for path in outside.rglob("*") if path.is_file() and folder not in path.parents} == {
            "mine"
        }
        assert sorted(path.name for path in outside.iterdir()) == sorted(
            ["victim.h5", "victim", f"{'a' * 32}.h5", "cases", "run"]
        )
    capsys.readouterr()
    with capsys.disabled():
        print(f"\n{JOURNALS} hostile folders: {dict(sorted(codes.items()))}")
    assert sum(codes.values()) == 4 * JOURNALS
