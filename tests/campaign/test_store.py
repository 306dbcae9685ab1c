"""Folders that are in use, full, read-only or half-written; nothing is lost and nothing is run twice."""

from __future__ import annotations

import csv
import errno
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

from srbval.campaign.case import CaseResult
from srbval.campaign.engines import choose_engine
from srbval.campaign.engines.engine import Job
from srbval.campaign.folder import PLAN, TABLE, CampaignFolder
from srbval.campaign.lock import folder_lock
from srbval.campaign.quantities import Output, quantities_of
from srbval.campaign.run import run_campaign
from srbval.campaign.settings import load_campaign
from srbval.campaign.status import campaign_status
from srbval.errors import ConfigurationError, DataError
from srbval.models.simulate import simulate
from srbval.scene import paper_scene
from tests.campaign.command import MANY, cluster, start
from tests.campaign.in_process import InProcess
from tests.campaign.small import small

FIRST_CASE_S = 120.0  # for a campaign to start its first case, kernels compiled, on a busy machine
DEVIATION_PCT = 0.1  # of a line from its kinematic frequency, for a bearing without slip in 2 s of record


def test_what_is_there_is_not_run_again(tmp_path: Path) -> None:
    few = small(axes=[{"kind": "grid", "values": {"shaft_speed": ["400 rpm", "700 rpm"]}}])
    assert run_campaign(few, tmp_path, engine=InProcess()).ran == 2
    more = small(axes=[{"kind": "grid", "values": {"shaft_speed": ["400 rpm", "700 rpm", "900 rpm"]}}])
    assert run_campaign(more, tmp_path, engine=InProcess()).ran == 1
    assert run_campaign(more, tmp_path, engine=InProcess()).ran == 0


def test_a_case_whose_rollers_are_unloaded_has_a_result_that_says_so(tmp_path: Path) -> None:
    played = small(axes=[{"kind": "grid", "values": {"contact.radial_play": ["0.2 mm"]}}])
    assert run_campaign(played, tmp_path, engine=InProcess()).failed == ()
    rows = list(csv.DictReader((tmp_path / TABLE).read_text(encoding="utf-8").splitlines()))
    assert rows
    assert {row["status"] for row in rows} <= {"rollers-unloaded", "inaccurate"}
    assert all("the housing spring the rest" in row["reason"] for row in rows)
    assert run_campaign(played, tmp_path, engine=InProcess()).ran == 0


def test_a_case_file_is_a_run_file(tmp_path: Path) -> None:
    import xarray

    from srbval.recordings import load_recording

    run_campaign(small(axes=[]), tmp_path, engine=InProcess())
    file = next((tmp_path / "cases").glob("*/*.h5"))
    assert load_recording(file).channels["y"].size == round(5e-3 * 20480)
    with xarray.open_dataset(file, engine="h5netcdf") as found:
        assert found["acceleration_y_m_s2"].attrs["units"] == "m s-2"
        assert found["value"].dims == ("quantity",)
        assert "displacement_y_m" not in found
        assert "wall_s" not in found.attrs


def test_two_campaigns_in_one_folder(tmp_path: Path) -> None:
    with folder_lock(tmp_path), pytest.raises(ConfigurationError, match=f"process {os.getpid()} on"):
        run_campaign(small(), tmp_path, engine=InProcess())
    assert not (tmp_path / PLAN).exists()


def test_the_lock_of_a_dead_process_is_recognised(tmp_path: Path) -> None:
    code = (
        "import os, sys; from pathlib import Path; from srbval.campaign.lock import folder_lock\n"
        "with folder_lock(Path(sys.argv[1])): os._exit(9)"
    )
    assert subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=False).returncode == 9
    said: list[str] = []
    run_campaign(small(axes=[]), tmp_path, engine=InProcess(), message=said.append)
    assert "was killed (process" in said[0]
    said.clear()
    run_campaign(small(axes=[]), tmp_path, engine=InProcess(), message=said.append)
    assert said == []


def test_another_campaigns_folder_is_refused(tmp_path: Path) -> None:
    run_campaign(small(axes=[]), tmp_path, engine=InProcess())
    with pytest.raises(ConfigurationError, match="holds campaign 'small', not 'other'"):
        run_campaign(small(name="other"), tmp_path, engine=InProcess())


def test_a_folder_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="Not a directory"):
        run_campaign(small(), tmp_path / "file" / "run", engine=InProcess())

    def read_only(*_: Any, **__: Any) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(Path, "mkdir", read_only)
    with pytest.raises(DataError, match=r"Read-only file system.*Choose another folder"):
        run_campaign(small(), tmp_path / "run", engine=InProcess())


def test_a_disk_that_is_too_small_is_seen_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = type("usage", (), {"free": 1000})
    monkeypatch.setattr("srbval.campaign.run.shutil.disk_usage", lambda _: usage)
    with pytest.raises(DataError, match=r"6 results will take .* MB are free"):
        run_campaign(small(), tmp_path, engine=InProcess())


def test_a_disk_that_fills_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from srbval.campaign import work

    writes = iter(range(100))
    good = work.write_result

    def full(*arguments: Any) -> None:
        if next(writes) >= 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        good(*arguments)

    monkeypatch.setattr(work, "write_result", full)
    with pytest.raises(DataError, match=r"No space left on device.*2 of 6 cases of this run are safe.*same command"):
        run_campaign(small(), tmp_path, engine=InProcess())
    assert campaign_status(tmp_path).done == 2
    monkeypatch.setattr(work, "write_result", good)
    assert run_campaign(small(), tmp_path, engine=InProcess()).ran == 4


@pytest.mark.skipif(sys.platform == "win32", reason="no resource limits here")
def test_one_result_too_large_for_the_disk(tmp_path: Path) -> None:
    """A real refusal to write: the operating system's limit on the size of a file."""
    code = (
        "import resource, signal, sys; from pathlib import Path\n"
        "from tests.campaign.in_process import InProcess; from srbval.campaign.run import run_campaign\n"
        "from tests.campaign.small import small\n"
        "from tests.campaign import in_process; in_process.prepare = lambda scenes: None\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))\n"
        "cases = [{'model': 'planar', 'duration': '2 s'}, {}, {'model': 'planar'}]\n"
        "c = small(axes=[{'kind': 'list', 'cases': cases}])\n"
        "f = run_campaign(c, Path(sys.argv[1]), engine=InProcess())\n"
        "print(f.done, [(e['case'], e['ending'], e['reason']) for e in f.failed])\n"
    )
    tree = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=False, cwd=tree
    )
    assert done.stdout.startswith("2 [(0, 'unwritten', 'the result could not be written:"), done.stderr
    assert not list((tmp_path / "cases").glob("*/.*.srbval-part"))


def test_a_journal_that_was_cut_off(tmp_path: Path) -> None:
    run_campaign(small(), tmp_path, engine=InProcess())
    journal = tmp_path / PLAN
    journal.write_bytes(journal.read_bytes()[:-1000])
    status = campaign_status(tmp_path)
    assert (status.done, status.cases, status.failed) == (6, 6, ())
    assert run_campaign(small(), tmp_path, engine=InProcess()).ran == 0


def test_status_says_what_is_there(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no campaign here"):
        campaign_status(tmp_path)
    run_campaign(small(), tmp_path, engine=InProcess())
    next((tmp_path / "cases").glob("*/*.h5")).unlink()
    found = campaign_status(tmp_path)
    assert (found.done, found.cases, found.running) == (5, 6, None)
    rows = (tmp_path / "results.csv").read_text().splitlines()
    assert rows[0] == "case,key,shaft_speed,defect.kind,model,status,reason,quantity,value,unit"
    assert len(rows) == 1 + 5 * 11


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="no process groups here")
@pytest.mark.parametrize("engine", ["serial", "local", "dask"])
def test_ctrl_c(engine: str, tmp_path: Path) -> None:
    """It reaches all processes of a terminal: one of them answers, in one line, and the same command resumes."""
    file, folder = tmp_path / "many.toml", tmp_path / "run"
    file.write_text(MANY)
    with cluster(engine, tmp_path, {}) as options:
        process = start(file, folder, *options, stderr=subprocess.PIPE)
        _wait_for_cases(folder, process)
        os.killpg(process.pid, signal.SIGINT)
        said = process.communicate()[1].decode()
    assert process.returncode == 130
    assert "KeyboardInterrupt" not in said
    assert "interrupted; nothing half-written was left behind" in said
    assert not list(folder.rglob("*.srbval-part"))
    kept = len(list((folder / "cases").glob("*/*.h5")))
    found = run_campaign(load_campaign(str(file)), folder, engine=InProcess())
    assert (found.done, found.ran, found.failed) == (12, 12 - kept, ())
    _assert_nothing_ran_twice(folder)


def test_what_an_ended_process_was_writing_is_cleared(tmp_path: Path) -> None:
    class Interrupted:
        name, workers = "interrupted", 1

        def run(self, job: Job) -> Generator[CaseResult]:
            part = job.folder / "cases" / "00" / f".{'0' * 32}.h5.abcd1234.srbval-part"
            part.parent.mkdir(parents=True)
            part.touch()
            raise KeyboardInterrupt
            yield

    with pytest.raises(KeyboardInterrupt):
        run_campaign(small(), tmp_path, engine=Interrupted())
    assert not list(tmp_path.rglob("*.srbval-part"))


def _wait_for_cases(folder: Path, process: subprocess.Popen[bytes]) -> None:
    """Wait until this start has finished a case: before that there is nothing to lose."""
    before = _ended_cases(folder)
    give_up_at = time.monotonic() + FIRST_CASE_S
    while process.poll() is None and _ended_cases(folder) == before:
        assert time.monotonic() < give_up_at, "no case ended"
        time.sleep(0.05)


def _ended_cases(folder: Path) -> int:
    return (folder / PLAN).read_bytes().count(b'{"ended": ') if (folder / PLAN).exists() else 0


def _assert_nothing_ran_twice(folder: Path) -> None:
    """No case was run again whose result had landed."""
    runs = Counter(entry.key for entry in CampaignFolder(folder).journal().ended if not entry.found)
    assert max(runs.values()) == 1


def test_engines_say_who_they_are(tmp_path: Path) -> None:
    found = run_campaign(small(axes=[]), tmp_path, engine=choose_engine("local", jobs=3))
    assert (found.engine, found.workers, found.cases) == ("local", 3, 1)
    assert found.case_s >= found.simulation_s > 0


def test_fault_lines_are_among_the_numbers_of_a_long_enough_record() -> None:
    def lines(seconds: float) -> dict[str, float]:
        run = simulate(paper_scene(model="impulse", duration_s=seconds, settle_s=0.0, defect={"kind": "outer"}))
        return {q.name: q.value for q in quantities_of(run, [Output.LINES])}

    found = lines(2.0)
    assert found["BPFO_detected"] == 1.0
    assert abs(found["BPFO_deviation_pct"]) < DEVIATION_PCT
    assert lines(1.0) == {}  # 11.8 revolutions, 12 are needed
