"""The command `srbval campaign run` as a process of its own, and clusters on this machine for it."""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from srbval.campaign.local import ATTEMPTS

MANY = """\
name = "many"
outputs = ["summary", "statistics", "acceleration"]
[scene]
duration = "1 s"
settle = "0 s"
model = "planar"
[[axes]]
kind = "grid"
values = { shaft_speed = ["300 rpm", "500 rpm", "700 rpm", "900 rpm"], "defect.kind" = ["none", "outer", "inner"] }
"""
DEATH_TIMEOUT_S = 10  # after which a SLURM job without its scheduler gives up; a minute where nothing is configured
# The script is removed as soon as `sbatch` returns.
SLURM = {
    "sbatch": '#!/bin/sh\njob=$(cat "$1")\nbash -c "$job" >/dev/null 2>&1 &\necho "Submitted batch job $!"\n',
    "scancel": '#!/bin/sh\nkill "$@" 2>/dev/null\nexit 0\n',
}


def start(
    file: Path,
    folder: Path,
    *options: str,
    stderr: int = subprocess.DEVNULL,
    environment: Mapping[str, str] | None = None,
) -> subprocess.Popen[bytes]:
    """Start the command in a process group of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "srbval", "campaign", "run", str(file), "-o", str(folder), *options],
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=stderr,
        env=os.environ | dict(environment or {}),
        preexec_fn=_answer_ctrl_c,
    )


def _answer_ctrl_c() -> None:
    """Tests that a shell runs in the background ignore Ctrl-C, and what they start would inherit that."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def stand_in_for_slurm(folder: Path, **changes: str) -> dict[str, str]:
    """The environment in which the commands of `SLURM`, but for `changes`, come before all others."""
    pytest.importorskip("dask_jobqueue")
    commands = folder / "bin"
    commands.mkdir()
    for name, script in (SLURM | changes).items():
        (commands / name).write_text(script)
        (commands / name).chmod(0o755)
    path = f"{commands}{os.pathsep}{os.environ['PATH']}"
    return {"PATH": path, "DASK_JOBQUEUE__SLURM__DEATH_TIMEOUT": str(DEATH_TIMEOUT_S)}


START_S = 60  # for the scheduler and its workers to start on a busy machine
END_S = 10  # for one of them to end by itself
DEATHS = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": str(ATTEMPTS - 1)}


@dataclass(frozen=True)
class Scheduler:
    """Where the scheduler is and its worker processes; with nannies, the workers' parents."""

    address: str
    workers: list[subprocess.Popen[bytes]]


@contextlib.contextmanager
def running_scheduler(
    folder: Path,
    *,
    nannies: bool = False,
    environment: Mapping[str, str] | None = None,
    scheduler_environment: Mapping[str, str] | None = None,
) -> Iterator[Scheduler]:
    """A scheduler and two workers of one thread each; `environment` is the workers', `nannies` replace dead ones."""
    distributed = pytest.importorskip("distributed")
    file = folder / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    common = ["--scheduler-file", str(file), "--no-dashboard"]
    one_thread = ["--nthreads", "1", "--nanny" if nannies else "--no-nanny"]
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder}
    own, theirs = os.environ | DEATHS | dict(scheduler_environment or {}), os.environ | dict(environment or {})
    started = [
        subprocess.Popen([*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", *common], env=own, **quiet),
        *(subprocess.Popen([*dask, "worker", *one_thread, *common], env=theirs, **quiet) for _ in range(2)),
    ]
    try:
        with distributed.Client(scheduler_file=str(file), timeout=f"{START_S} s") as client:
            client.wait_for_workers(2, timeout=START_S)
            address = str(client.scheduler.address)
        yield Scheduler(address, started[1:])
    finally:
        for process in reversed(started):
            process.terminate()
        for process in started:
            try:
                process.wait(timeout=END_S)
            except subprocess.TimeoutExpired:  # a worker may hang where its scheduler goes while it says goodbye
                process.kill()
                process.wait()


@contextlib.contextmanager
def cluster(engine: str, folder: Path, environment: dict[str, str]) -> Iterator[tuple[str, ...]]:
    """What `engine` needs, with `environment`, to which it may add; the options of the command."""
    if engine == "dask":
        with running_scheduler(folder, nannies=True, environment=environment) as scheduler:
            yield "--engine", engine, "--address", scheduler.address
        return
    if engine == "slurm":
        environment |= stand_in_for_slurm(folder)
    yield "--engine", engine, "--jobs", "2"
