"""A Dask scheduler with two worker processes on this machine."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from srbval.campaign.engines.local import ATTEMPTS

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
