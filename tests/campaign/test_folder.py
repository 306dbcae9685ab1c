"""Folders that are damaged, in use, full, read-only or someone else's: all is said, nothing lost, nothing run twice.

`SRBVAL_FLIPS` is the number of flipped bits (2000 take some minutes).
"""

import errno
import json
import os
import random
import shutil
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from srbval.campaign.export import export_campaign
from srbval.campaign.folder import RESULTS, TABLE, campaign_status, folder_lock
from srbval.campaign.quantities import Output, quantities_of
from srbval.campaign.results import CaseResult, Ending, write_result
from srbval.campaign.settings import load_campaign
from srbval.cli import main
from srbval.errors import ConfigurationError, DataError
from srbval.models.simulate import simulate
from srbval.scene import paper_scene
from tests.campaign.campaigns import content, damaged_names, good_results, resume, run_small, small
from tests.campaign.command import MANY, cluster, start
from tests.marked import until

FLIPS = int(os.environ.get("SRBVAL_FLIPS", "30"))
BATCH = 6  # flips of different files that one resumed run repairs
DEVIATION_PCT = 0.1  # of a line from its kinematic frequency, for a bearing without slip in 2 s of record


def test_every_flipped_bit_is_found_and_repaired(whole: Path, folder: Path) -> None:
    """One bit of a result or of the table of cases at a time, and several files at once for the repair."""
    chance = random.Random(FLIPS)
    files = [TABLE, *(f"cases/{path.name}" for path in sorted((whole / "cases").glob("*.h5")))]
    before, outcomes = content(whole), campaign_status(whole)["failed"]
    flips = 0
    while flips < FLIPS:
        flipped = {}
        for name in sorted(set(chance.choices(files, k=BATCH))):
            raw = bytearray((whole / name).read_bytes())
            raw[chance.randrange(100 if name == TABLE else 0, len(raw))] ^= 1 << chance.randrange(8)
            (folder / name).write_bytes(raw)
            assert damaged_names(folder) == {Path(name).name}
            (folder / name).write_bytes((whole / name).read_bytes())
            flipped[name] = bytes(raw)
        flips += len(flipped)
        for name, damaged in flipped.items():
            (folder / name).write_bytes(damaged)
        found, said = resume(folder)
        results = len(flipped.keys() - {TABLE})
        assert (found["done"], found["damaged"], found["failed"]) == (6, results, outcomes)
        assert f"damaged results, which are run again: {results};" in said[0]
        assert content(folder) == before
        assert damaged_names(folder) == set()


def foreign(path: Path) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file["value"] = [1.0, 2.0]


DAMAGES: dict[str, Callable[[Path], object]] = {
    "cut": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "zeros added": lambda path: path.write_bytes(path.read_bytes() + bytes(100)),
    "loop": lambda path: (path.unlink(), path.symlink_to(path.name)),
    "foreign": foreign,
    "another case": lambda path: shutil.copy(next(p for p in good_results(path.parents[1]) if p != path), path),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_result_is_named_and_run_again(
    damage: str, whole: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = good_results(folder)[0]
    DAMAGES[damage](path)
    assert damaged_names(folder) == {path.name}
    status = campaign_status(folder)
    assert (status["done"], [found["file"] for found in status["damaged"]]) == (5, [path])
    with pytest.raises(DataError, match=path.name):
        export_campaign(folder, folder / "set.h5", segment_s=1e-3)
    assert main(["campaign", "verify", str(folder), "--json"]) == 3
    found = json.loads(capsys.readouterr().out)
    assert (found["ok"], found["status"], found["damaged"][0]["file"]) == (False, "damaged", str(path))
    again, said = resume(folder)
    assert (again["done"], again["ran"], again["damaged"]) == (6, 1, 1)
    assert path.name in said[0]
    assert content(folder) == content(whole)


@pytest.mark.parametrize("in_its_place", [Path.mkdir, os.mkfifo])
def test_a_folder_or_pipe_in_a_results_place_stays(in_its_place: Callable[[Path], None], folder: Path) -> None:
    path = good_results(folder)[0]
    path.unlink()
    in_its_place(path)
    assert damaged_names(folder) == {path.name}
    found, _ = resume(folder)
    assert (found["done"], [entry["ending"] for entry in found["failed"] if entry["case"] < 3]) == (5, ["unwritten"])
    assert path.exists()


def test_results_that_are_gone_and_results_to_try_again(whole: Path, folder: Path) -> None:
    gone, late, _ = good_results(folder)
    gone.unlink()
    (folder / RESULTS).unlink()
    write_result(late, CaseResult(key=late.stem, ending=Ending.TIMED_OUT, reason="too long"), None)
    status = campaign_status(folder)
    assert (status["done"], sorted(entry["ending"] for entry in status["failed"])[-1]) == (5, "timed-out")
    found, _ = resume(folder)
    assert (found["ran"], found["damaged"], len(found["failed"])) == (2, 0, 3)
    assert content(folder) == content(whole)


def test_verify_reads_all_and_writes_nothing(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Also results of an earlier form of the campaign, which stay."""
    resume(folder, seed=7)
    before = {path: path.stat().st_mtime_ns for path in [folder, *folder.rglob("*")]}
    assert main(["campaign", "verify", str(folder), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["ok"], found["damaged"]) == (True, [])
    assert found["results"] == len(list((folder / "cases").glob("*.h5"))) > 6
    assert {path: path.stat().st_mtime_ns for path in before} == before
    assert main(["campaign", "verify", str(folder.parent / "none")]) == 3


def test_a_damaged_table_of_cases(whole: Path, folder: Path) -> None:
    raw = (folder / TABLE).read_bytes()
    (folder / TABLE).write_bytes(raw[: len(raw) // 2])
    assert damaged_names(folder) == {TABLE}
    with pytest.raises(DataError, match=r"damaged .*results are kept"):
        campaign_status(folder)
    with pytest.raises(ConfigurationError, match="holds campaign 'small', not 'other'"):
        resume(folder, name="other")
    assert resume(folder)[0]["ran"] == 0
    assert content(folder) == content(whole)
    assert damaged_names(folder) == set()


@pytest.mark.parametrize("name", [TABLE, RESULTS])
def test_a_folder_with_anothers_files_is_left_alone(name: str, tmp_path: Path) -> None:
    """As after ``-o .`` in a folder with a table of that name."""
    (tmp_path / name).write_text('{"name": "small", "theirs": 1}\n')
    with pytest.raises(DataError, match=f"nothing was changed.*remove {TABLE} and {RESULTS}"):
        resume(tmp_path)
    with pytest.raises(DataError, match=r"damaged|no campaign here"):
        campaign_status(tmp_path)
    assert (tmp_path / name).read_text() == '{"name": "small", "theirs": 1}\n'


def test_a_users_own_files_stay(folder: Path) -> None:
    own = [folder / "notes.h5", folder / "cases" / "notes.txt", folder / ".x.part"]
    for path in own:
        path.write_text("mine")
    resume(folder)
    assert [path.read_text() for path in own] == ["mine"] * len(own)


def test_two_campaigns_in_one_folder(folder: Path) -> None:
    with folder_lock(folder):
        with pytest.raises(ConfigurationError, match="another campaign runs in this folder"):
            resume(folder)
        assert campaign_status(folder)["running"]
    assert not campaign_status(folder)["running"]


def test_a_folder_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="Not a directory"):
        run_small(small(), tmp_path / "file" / "run")

    def read_only(*_: Any, **__: Any) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(Path, "mkdir", read_only)
    with pytest.raises(DataError, match=r"Read-only file system.*Choose another folder"):
        run_small(small(), tmp_path / "run")


def test_a_disk_that_is_too_small_is_seen_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = type("usage", (), {"free": 1000})
    monkeypatch.setattr("srbval.campaign.run.shutil.disk_usage", lambda _: usage)
    with pytest.raises(DataError, match=r"6 results will take .* MB are free"):
        run_small(small(), tmp_path)


def test_a_disk_that_fills_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from srbval.campaign import worker

    writes, good = iter(range(100)), worker.write_result

    def full(*arguments: Any) -> None:
        if next(writes) >= 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        good(*arguments)

    monkeypatch.setattr(worker, "write_result", full)
    with pytest.raises(DataError, match=r"No space left on device.*2 of 6 cases of this run are safe.*same command"):
        run_small(small(), tmp_path)
    assert (campaign_status(tmp_path)["done"], campaign_status(tmp_path)["failed"]) == (2, [])
    monkeypatch.setattr(worker, "write_result", good)
    assert run_small(small(), tmp_path)["ran"] == 4


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="no process groups here")
@pytest.mark.parametrize("engine", ["local", pytest.param("dask", marks=pytest.mark.long_form)])
def test_ctrl_c(engine: str, tmp_path: Path) -> None:
    """It reaches all processes of a terminal: one of them answers, in one line, and the same command resumes."""
    file, folder = tmp_path / "many.toml", tmp_path / "run"
    file.write_text(MANY)
    with cluster(engine, tmp_path, {}) as options:
        process = start(file, folder, *options, stderr=subprocess.PIPE)
        until(lambda: process.poll() is not None or any(folder.glob("cases/*.h5")))
        os.killpg(process.pid, signal.SIGINT)
        said = process.communicate()[1].decode()
    assert process.returncode == 130
    assert "KeyboardInterrupt" not in said
    assert "interrupted; nothing half-written was left behind" in said
    assert not list(folder.rglob("*.srbval-part"))
    kept = len(list((folder / "cases").glob("*.h5")))
    found = run_small(load_campaign(str(file)), folder)
    assert (found["done"], found["ran"], found["failed"]) == (12, 12 - kept, [])


def test_fault_lines_are_among_the_numbers_of_a_long_enough_record() -> None:
    def lines(seconds: float) -> dict[str, float]:
        run = simulate(paper_scene(model="impulse", duration_s=seconds, settle_s=0.0, defect={"kind": "outer"}))
        return {name: value for name, (value, _) in quantities_of(run, [Output.LINES]).items()}

    found = lines(2.0)
    assert found["BPFO_detected"] == 1.0
    assert abs(found["BPFO_deviation_pct"]) < DEVIATION_PCT
    assert lines(1.0) == {}  # 11.8 revolutions, 12 are needed
