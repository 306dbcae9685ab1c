"""Folders that are in use, full, read-only or half-written; nothing is lost and nothing is run twice."""

from __future__ import annotations

import contextlib
import errno
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

from srbval.campaign.campaign_folder import CampaignFolder
from srbval.campaign.case import CaseOutcome, Ending
from srbval.campaign.engines.choose import choose_engine
from srbval.campaign.engines.engine import Job
from srbval.campaign.engines.local import Serial
from srbval.campaign.lock import folder_lock
from srbval.campaign.quantities import Output, quantities_of
from srbval.campaign.run import run_campaign
from srbval.campaign.settings import load_campaign
from srbval.campaign.status import campaign_status
from srbval.errors import ConfigurationError, DataError
from srbval.models.simulate import simulate
from srbval.scene import paper_scene
from tests.campaign.scheduler import running_scheduler
from tests.campaign.small import content, small

FIRST_CASE_S = 120.0  # for a campaign to start its first case, kernels compiled, on a busy machine
DEVIATION_PCT = 0.1  # of a line from its kinematic frequency, for a bearing without slip in 2 s of record
MANY = """\
name = "many"
outputs = ["summary", "statistics", "acceleration"]
[scene]
duration = "60 ms"
settle = "0 s"
[[axes]]
kind = "grid"
values = { shaft_speed = ["300 rpm", "500 rpm", "700 rpm", "900 rpm"], "defect.kind" = ["none", "outer", "inner"] }
"""


def test_what_is_there_is_not_run_again(tmp_path: Path) -> None:
    few = small(axes=[{"kind": "grid", "values": {"shaft_speed": ["400 rpm", "700 rpm"]}}])
    assert run_campaign(few, tmp_path, engine=Serial()).ran == 2
    more = small(axes=[{"kind": "grid", "values": {"shaft_speed": ["400 rpm", "700 rpm", "900 rpm"]}}])
    assert run_campaign(more, tmp_path, engine=Serial()).ran == 1
    assert run_campaign(more, tmp_path, engine=Serial()).ran == 0


def test_a_case_file_is_a_run_file(tmp_path: Path) -> None:
    import xarray

    from srbval.recordings import load_recording

    run_campaign(small(axes=[]), tmp_path, engine=Serial())
    file = next((tmp_path / "cases").glob("*/*.h5"))
    assert load_recording(file).channels["y"].size == round(5e-3 * 20480)
    with xarray.open_dataset(file, engine="h5netcdf") as found:
        assert found["acceleration_y_m_s2"].attrs["units"] == "m s-2"
        assert found["value"].dims == ("quantity",)
        assert "displacement_y_m" not in found
        assert "wall_s" not in found.attrs


def test_two_campaigns_in_one_folder(tmp_path: Path) -> None:
    with folder_lock(tmp_path), pytest.raises(ConfigurationError, match=f"process {os.getpid()} on"):
        run_campaign(small(), tmp_path, engine=Serial())
    assert not (tmp_path / "plan.jsonl").exists()


def test_the_lock_of_a_dead_process_is_recognised(tmp_path: Path) -> None:
    code = (
        "import os, sys; from pathlib import Path; from srbval.campaign.lock import folder_lock\n"
        "with folder_lock(Path(sys.argv[1])): os._exit(9)"
    )
    assert subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=False).returncode == 9
    said: list[str] = []
    run_campaign(small(axes=[]), tmp_path, engine=Serial(), message=said.append)
    assert "was killed (process" in said[0]
    said.clear()
    run_campaign(small(axes=[]), tmp_path, engine=Serial(), message=said.append)
    assert said == []


def test_another_campaigns_folder_is_refused(tmp_path: Path) -> None:
    run_campaign(small(axes=[]), tmp_path, engine=Serial())
    with pytest.raises(ConfigurationError, match="holds campaign 'small', not 'other'"):
        run_campaign(small(name="other"), tmp_path, engine=Serial())


def test_a_folder_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="Not a directory"):
        run_campaign(small(), tmp_path / "file" / "run", engine=Serial())

    def read_only(*_: Any, **__: Any) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(Path, "mkdir", read_only)
    with pytest.raises(DataError, match=r"Read-only file system.*Choose another folder"):
        run_campaign(small(), tmp_path / "run", engine=Serial())


def test_a_disk_that_is_too_small_is_seen_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = type("usage", (), {"free": 1000})
    monkeypatch.setattr("srbval.campaign.run.shutil.disk_usage", lambda _: usage)
    with pytest.raises(DataError, match=r"6 results will take .* MB are free"):
        run_campaign(small(), tmp_path, engine=Serial())


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
        run_campaign(small(), tmp_path, engine=Serial())
    assert campaign_status(tmp_path).done == 2
    monkeypatch.setattr(work, "write_result", good)
    assert run_campaign(small(), tmp_path, engine=Serial()).ran == 4


@pytest.mark.skipif(sys.platform == "win32", reason="no resource limits here")
def test_one_result_too_large_for_the_disk(tmp_path: Path) -> None:
    """A real refusal to write: the operating system's limit on the size of a file."""
    code = (
        "import resource, signal, sys; from pathlib import Path\n"
        "from srbval.campaign.engines.local import Serial; from srbval.campaign.run import run_campaign\n"
        "from tests.campaign.small import small\n"
        "from srbval.campaign.engines import local; local.prepare = lambda scenes: None\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))\n"
        "cases = [{'model': 'planar', 'duration': '2 s'}, {}, {'model': 'planar'}]\n"
        "c = small(axes=[{'kind': 'list', 'cases': cases}])\n"
        "f = run_campaign(c, Path(sys.argv[1]), engine=Serial())\n"
        "print(f.done, [(e['case'], e['ending'], e['reason']) for e in f.failed])\n"
    )
    tree = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=False, cwd=tree
    )
    assert done.stdout.startswith("2 [(0, 'unwritten', 'the result could not be written:"), done.stderr
    assert not list((tmp_path / "cases").glob("*/.*.part"))


def test_a_journal_that_was_cut_off(tmp_path: Path) -> None:
    run_campaign(small(), tmp_path, engine=Serial())
    journal = tmp_path / "journal.jsonl"
    whole = journal.read_bytes()
    journal.write_bytes(whole[: len(whole) // 2])
    status = campaign_status(tmp_path)
    assert (status.done, status.cases, status.failed) == (6, 6, ())
    assert run_campaign(small(), tmp_path, engine=Serial()).ran == 0


def test_status_says_what_is_there(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no campaign here"):
        campaign_status(tmp_path)
    run_campaign(small(), tmp_path, engine=Serial())
    next((tmp_path / "cases").glob("*/*.h5")).unlink()
    found = campaign_status(tmp_path)
    assert (found.done, found.cases, found.running) == (5, 6, None)
    rows = (tmp_path / "results.csv").read_text().splitlines()
    assert rows[0] == "case,key,shaft_speed,defect.kind,model,status,reason,quantity,value,unit"
    assert len(rows) == 1 + 5 * 11


@pytest.mark.slow
@pytest.mark.parametrize("kills", [4, pytest.param(20, marks=pytest.mark.skipif(
    "SRBVAL_LONG_TESTS" not in os.environ, reason="20 kills take minutes; set SRBVAL_LONG_TESTS"))])  # fmt: skip
@pytest.mark.skipif(not hasattr(os, "killpg"), reason="no process groups here")
def test_killed_at_random_moments(kills: int, tmp_path: Path) -> None:
    """SIGKILL to the whole group, to the campaign's process or to a worker; at the end nothing differs."""
    file = tmp_path / "many.toml"
    file.write_text(MANY)
    undisturbed = tmp_path / "undisturbed"
    assert _start(file, undisturbed).wait() == 0
    whole = content(undisturbed)
    span_s = _span_s(undisturbed)

    chance = random.Random(kills)
    folder = tmp_path / "killed"
    done = 0
    for number in range(kills):
        process = _start(file, folder)
        _wait_for_cases(folder, process)
        time.sleep(chance.uniform(0, min(1.0, 2 * span_s / kills)))
        workers = _children(process.pid)
        if number % 3 == 0 and workers:
            _kill(os.kill, chance.choice(workers))
            time.sleep(0.1)
        if number % 3 == 1:
            _kill(os.kill, process.pid)
        _kill(os.killpg, process.pid)
        process.wait()
        now = len(list((folder / "cases").glob("*/*.h5")))
        assert now >= done
        done = now
    assert _start(file, folder).wait() == 0
    assert content(folder) == whole
    assert not list(folder.rglob("*.part"))
    _assert_nothing_ran_twice(folder)


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="no process groups here")
@pytest.mark.parametrize("engine", ["serial", "local", "dask"])
def test_ctrl_c(engine: str, tmp_path: Path) -> None:
    """It reaches all processes of a terminal: one of them answers, in one line, and the same command goes on."""
    file, folder = tmp_path / "many.toml", tmp_path / "run"
    file.write_text(MANY)
    with contextlib.ExitStack() as stack:
        address = stack.enter_context(running_scheduler(tmp_path)).address if engine == "dask" else None
        process = _start(file, folder, engine=engine, address=address, stderr=subprocess.PIPE)
        _wait_for_cases(folder, process)
        os.killpg(process.pid, signal.SIGINT)
        said = process.communicate()[1].decode()
    assert process.returncode == 130
    assert "KeyboardInterrupt" not in said
    assert "interrupted; nothing half-written was left behind" in said
    assert not list(folder.rglob("*.part"))
    kept = len(list((folder / "cases").glob("*/*.h5")))
    found = run_campaign(load_campaign(str(file)), folder, engine=Serial())
    assert (found.done, found.ran, found.failed) == (12, 12 - kept, ())
    _assert_nothing_ran_twice(folder)


def test_what_an_ended_process_was_writing_is_cleared(tmp_path: Path) -> None:
    class Interrupted:
        name, workers = "interrupted", 1

        def run(self, job: Job) -> Generator[CaseOutcome]:
            part = job.folder / "cases" / "00" / ".00a.h5.x.part"
            part.parent.mkdir(parents=True)
            part.touch()
            raise KeyboardInterrupt
            yield

    with pytest.raises(KeyboardInterrupt):
        run_campaign(small(), tmp_path, engine=Interrupted())
    assert not list(tmp_path.rglob("*.part"))


def _start(
    file: Path, folder: Path, *, engine: str = "local", address: str | None = None, stderr: int = subprocess.DEVNULL
) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "srbval", "campaign", "run", str(file), "-o", str(folder), "--engine", engine]
    options = ["--address", address] if address else ["--jobs", "1" if engine == "serial" else "2"]
    return subprocess.Popen(
        [*command, *options],
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=stderr,
        preexec_fn=_answer_ctrl_c,
    )


def _answer_ctrl_c() -> None:
    """Tests that a shell runs in the background ignore Ctrl-C, and what they start would inherit that."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _wait_for_cases(folder: Path, process: subprocess.Popen[bytes]) -> None:
    """Wait until this start has handed out a case: before that there is nothing to lose."""
    before = _started_cases(folder)
    give_up_at = time.monotonic() + FIRST_CASE_S
    while process.poll() is None and _started_cases(folder) == before:
        assert time.monotonic() < give_up_at, "no case was started"
        time.sleep(0.05)


def _started_cases(folder: Path) -> int:
    return sum(1 for entry in CampaignFolder(folder).journal() if entry["event"] == "begun")


def _span_s(folder: Path) -> float:
    """Wall time of the cases of an undisturbed run with two workers [s]."""
    return sum(float(e["wall_s"]) for e in CampaignFolder(folder).journal() if e["event"] == "ended") / 2


def _children(pid: int) -> list[int]:
    found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True, check=False)
    return [int(text) for text in found.stdout.split()]


def _kill(how: Any, pid: int) -> None:
    try:
        how(pid, signal.SIGKILL)
    except ProcessLookupError:
        return


def _assert_nothing_ran_twice(folder: Path) -> None:
    """No case is handed out after its result had landed, and none has two results."""
    landed: set[str] = set()
    runs: Counter[str] = Counter()
    for entry in CampaignFolder(folder).journal():
        if entry["event"] == "begun":
            assert entry["key"] not in landed
        elif entry["ending"] == Ending.OK.value:
            landed.add(entry["key"])
            runs[entry["key"]] += not entry["found"]
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
