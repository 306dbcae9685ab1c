"""Clusters and machines that fail a campaign: one line, exit code 3 or 4, and the same command resumes."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
from pathlib import Path
from typing import Any

import pytest

from srbval.campaign.engines import case_process
from srbval.campaign.engines.local import LocalProcesses
from srbval.campaign.run import run_campaign
from srbval.errors import DataError, NumericsError
from tests.campaign.command import MANY, cluster, stand_in_for_slurm, start
from tests.campaign.scheduler import running_scheduler
from tests.campaign.small import small
from tests.marked import marked, until

DIES = "import os, sys\nif 'srbval.campaign.engines.worker' in sys.orig_argv:\n    os.kill(os.getpid(), 9)\n"
HANGS = """\
import sys, time
if "srbval.campaign.engines.worker" in sys.orig_argv:
    import srbval.campaign.work as work
    work.prepare = lambda scenes: time.sleep(1e6)
"""


def _said(process: subprocess.Popen[bytes]) -> list[str]:
    """What the command said besides its progress."""
    text = process.communicate()[1].decode()
    assert "Traceback" not in text, text
    return [line for line in text.splitlines() if not line.startswith("campaign many")]


def _many(folder: Path, seconds: str = "60 ms") -> Path:
    (folder / "many.toml").write_text(MANY.replace("60 ms", seconds))
    return folder / "many.toml"


@pytest.mark.slow
def test_a_scheduler_that_goes_away(tmp_path: Path) -> None:
    mark = {"SRBVAL_TEST": str(tmp_path)}
    file = _many(tmp_path, "1 s")
    with running_scheduler(tmp_path, environment=mark, scheduler_environment=mark) as scheduler:
        options = ("--engine", "dask", "--address", scheduler.address)
        process = start(file, tmp_path / "run", *options, stderr=subprocess.PIPE)
        until(lambda: any((tmp_path / "run").glob("cases/*/*.h5")) or process.poll() is not None)
        for pid, command in marked(mark).items():
            if "scheduler --host" in command:
                os.kill(pid, signal.SIGKILL)
        (line,) = _said(process)
    assert process.returncode == 3
    assert "is gone" in line or "failed (" in line
    assert "the same command resumes" in line
    until(lambda: not marked(mark))


@pytest.mark.slow
def test_dask_workers_killed_while_they_start_their_processes(tmp_path: Path) -> None:
    """They are replaced, and the campaign does not end for it."""
    mark = {"SRBVAL_TEST": str(tmp_path)}
    environment = dict(mark)
    file = _many(tmp_path)
    with cluster("dask", tmp_path, environment) as options:
        process = start(file, tmp_path / "run", *options, stderr=subprocess.PIPE)
        until(lambda: any("engines.worker" in command for command in marked(mark).values()))
        workers = [pid for pid, command in marked(mark).items() if "spawn_main" in command]
        os.kill(workers[0], signal.SIGKILL)
        assert _said(process) == []
        assert process.returncode == 0
    until(lambda: not marked(mark))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"sbatch": "#!/bin/sh\necho refused >&2\nexit 1\n"}, "slurm"),
        ({"sbatch": "nothing\n"}, "slurm failed ("),
    ],
)
def test_slurm_that_takes_no_jobs(changes: dict[str, str], said: str, tmp_path: Path) -> None:
    environment = stand_in_for_slurm(tmp_path, **changes)
    options = ("--engine", "slurm", "--jobs", "1", "--wait", "5")
    process = start(_many(tmp_path), tmp_path / "run", *options, stderr=subprocess.PIPE, environment=environment)
    (line,) = _said(process)
    assert process.returncode == 3
    assert said in line


def test_processes_that_the_system_refuses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise OSError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    monkeypatch.setattr(case_process, "WorkerProcess", refuse)
    with pytest.raises(DataError, match=r"refused to start a process .*unavailable.* --jobs"):
        run_campaign(small(), tmp_path, engine=LocalProcesses(2))


@pytest.mark.parametrize(("code", "said"), [(DIES, "died 3 times"), (HANGS, "within 3 s")])
def test_processes_that_never_get_ready(
    code: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "sitecustomize.py").write_text(code)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])]))
    monkeypatch.setattr(case_process, "PREPARE_LIMIT_S", 3.0)
    with pytest.raises(NumericsError, match=said):
        run_campaign(small(), tmp_path / "run", engine=LocalProcesses(2))
    assert "Traceback" not in capfd.readouterr().err
