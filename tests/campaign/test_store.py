"""Folders that are in use, full, read-only or half-written; nothing is lost and nothing is run twice."""

import errno
import os
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

from srbval.campaign.case import CaseResult
from srbval.campaign.engines.local import Job
from srbval.campaign.folder import PLAN, CampaignFolder, folder_lock
from srbval.campaign.quantities import Output, quantities_of
from srbval.campaign.run import run_campaign
from srbval.campaign.settings import load_campaign
from srbval.campaign.status import campaign_status
from srbval.errors import ConfigurationError, DataError
from srbval.models.simulate import simulate
from srbval.scene import paper_scene
from tests.campaign.campaigns import run_small, six
from tests.campaign.command import MANY, cluster, start
from tests.marked import until

DEVIATION_PCT = 0.1  # of a line from its kinematic frequency, for a bearing without slip in 2 s of record


def test_a_case_file_is_a_run_file(whole: Path) -> None:
    import xarray

    from srbval.recordings import load_recording

    file = next(path for path in (whole / "cases").glob("*/*.h5") if path.stat().st_size > 20_000)
    assert load_recording(file).channels["y"].size == round(5e-3 * 20480)
    with xarray.open_dataset(file, engine="h5netcdf") as found:
        assert found["acceleration_y_m_s2"].attrs["units"] == "m s-2"
        assert found["value"].dims == ("quantity",)
        assert "displacement_y_m" not in found
        assert "wall_s" not in found.attrs


def test_two_campaigns_in_one_folder(tmp_path: Path) -> None:
    with folder_lock(tmp_path), pytest.raises(ConfigurationError, match=f"process {os.getpid()} on"):
        run_small(six(), tmp_path)
    assert not (tmp_path / PLAN).exists()


def test_the_lock_of_a_dead_process_is_recognised(tmp_path: Path) -> None:
    code = (
        "import os, sys; from pathlib import Path; from srbval.campaign.folder import folder_lock\n"
        "with folder_lock(Path(sys.argv[1])): os._exit(9)"
    )
    assert subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=False).returncode == 9
    said: list[str] = []
    run_small(six(), tmp_path, message=said.append)
    assert "was killed (process" in said[0]
    said.clear()
    run_small(six(), tmp_path, message=said.append)
    assert said == []


def test_a_folder_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="Not a directory"):
        run_small(six(), tmp_path / "file" / "run")

    def read_only(*_: Any, **__: Any) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(Path, "mkdir", read_only)
    with pytest.raises(DataError, match=r"Read-only file system.*Choose another folder"):
        run_small(six(), tmp_path / "run")


def test_a_disk_that_is_too_small_is_seen_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = type("usage", (), {"free": 1000})
    monkeypatch.setattr("srbval.campaign.run.shutil.disk_usage", lambda _: usage)
    with pytest.raises(DataError, match=r"6 results will take .* MB are free"):
        run_small(six(), tmp_path)


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
        run_small(six(), tmp_path)
    status = campaign_status(tmp_path)
    assert status.done == 2
    assert [entry["ending"] for entry in status.failed] == ["unwritten"] * 3
    monkeypatch.setattr(work, "write_result", good)
    assert run_small(six(), tmp_path).ran == 4


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="no process groups here")
@pytest.mark.parametrize("engine", ["local", pytest.param("dask", marks=pytest.mark.long_form)])
def test_ctrl_c(engine: str, tmp_path: Path) -> None:
    """It reaches all processes of a terminal: one of them answers, in one line, and the same command resumes."""
    file, folder = tmp_path / "many.toml", tmp_path / "run"
    file.write_text(MANY)
    with cluster(engine, tmp_path, {}) as options:
        process = start(file, folder, *options, stderr=subprocess.PIPE)
        until(lambda: process.poll() is not None or any(folder.glob("cases/*/*.h5")))
        os.killpg(process.pid, signal.SIGINT)
        said = process.communicate()[1].decode()
    assert process.returncode == 130
    assert "KeyboardInterrupt" not in said
    assert "interrupted; nothing half-written was left behind" in said
    assert not list(folder.rglob("*.srbval-part"))
    kept = len(list((folder / "cases").glob("*/*.h5")))
    found = run_small(load_campaign(str(file)), folder)
    assert (found.done, found.ran, found.failed) == (12, 12 - kept, ())
    runs = Counter(result.key for result in CampaignFolder(folder).journal().ended if not result.found)
    assert max(runs.values()) == 1  # no case was run again whose result had landed


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
        run_campaign(six(), tmp_path, engine=Interrupted())
    assert not list(tmp_path.rglob("*.srbval-part"))


def test_fault_lines_are_among_the_numbers_of_a_long_enough_record() -> None:
    def lines(seconds: float) -> dict[str, float]:
        run = simulate(paper_scene(model="impulse", duration_s=seconds, settle_s=0.0, defect={"kind": "outer"}))
        return {q.name: q.value for q in quantities_of(run, [Output.LINES])}

    found = lines(2.0)
    assert found["BPFO_detected"] == 1.0
    assert abs(found["BPFO_deviation_pct"]) < DEVIATION_PCT
    assert lines(1.0) == {}  # 11.8 revolutions, 12 are needed
