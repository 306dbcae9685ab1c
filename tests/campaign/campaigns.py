"""Small campaigns in the test's own process, and their folders; the command as a process, and clusters for it."""

import contextlib
import hashlib
import os
import subprocess
import sys
from collections.abc import Generator, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from srbval.campaign.results import CaseResult, CaseTask
from srbval.campaign.run import RESULTS_CSV, run_campaign, verify_campaign
from srbval.campaign.settings import Campaign
from srbval.campaign.worker import ATTEMPTS, prepare, run_case
from srbval.storage.tables import build
from tests.marked import answer_ctrl_c

FAILING = {"model": "planar", "load.radial": "100 MN"}  # the rollers lose the load
# Three good cases with signals, one on which the numerics fail, two that are refused.
MIXED = [
    {
        "kind": "list",
        "cases": [
            {"defect.kind": "outer", "model": "planar"},
            {"defect.kind": "inner", "model": "kinematic"},
            {"model": "planar"},
            FAILING,
            {"load.radial": "-3 kN"},
            {"bearing": "skf-6205", "model": "full"},
        ],
    }
]


def small(**changes: Any) -> Campaign:
    """Six cases of a simple model, 5 ms each."""
    table: dict[str, Any] = {
        "name": "small",
        "outputs": ["summary", "statistics", "acceleration"],
        "scene": {"duration": "5 ms", "settle": "0 s", "model": "planar"},
        "axes": [
            {"kind": "grid", "values": {"shaft_speed": ["400 rpm", "700 rpm", "900 rpm"]}},
            {"kind": "grid", "values": {"defect.kind": ["none", "outer"]}},
        ],
    }
    return build(Campaign, table | changes, "campaign")


class InProcess:
    """An engine that runs one case after the other in this process, without limits."""

    name = "in-process"

    def run(self, tasks: Iterable[CaseTask]) -> Generator[CaseResult]:
        for task in tasks:
            prepare(task.scene)
            yield run_case(task)


def run_small(campaign: Campaign, folder: Path, **options: Any) -> dict[str, Any]:
    return run_campaign(campaign, folder, engine=InProcess(), **options)


def resume(folder: Path, **changes: Any) -> dict[str, Any]:
    """Run the campaign `MIXED` again; returns its summary."""
    return run_small(small(axes=MIXED, **changes), folder)


def content(folder: Path) -> dict[str, str]:
    """Digest of every result, and of the table of results, by name."""
    files = [*(folder / "cases").glob("*.h5"), folder / RESULTS_CSV]
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def good_results(folder: Path) -> list[Path]:
    """The results with signals."""
    return sorted(path for path in (folder / "cases").glob("*.h5") if path.stat().st_size > 20_000)


def damaged_names(folder: Path) -> set[str]:
    return {found["file"].name for found in verify_campaign(folder)["damaged"]}


MANY = """\
name = "many"
outputs = ["summary", "statistics", "acceleration"]
[scene]
duration = "0.4 s"
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
    """Start the command in a process group of its own, in the folder of the file."""
    return subprocess.Popen(
        [sys.executable, "-m", "srbval", "campaign", "run", str(file), "-o", str(folder), *options],
        start_new_session=True,
        cwd=file.parent,
        stdout=subprocess.DEVNULL,
        stderr=stderr,
        env=os.environ | dict(environment or {}),
        preexec_fn=answer_ctrl_c,
    )


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


@contextlib.contextmanager
def dask_cluster(environment: Mapping[str, str] | None = None) -> Iterator[Any]:
    """A cluster of Dask with two worker processes of one thread each, which have that `environment`."""
    distributed = pytest.importorskip("distributed")
    import dask

    options = {"n_workers": 2, "threads_per_worker": 1, "host": "127.0.0.1", "dashboard_address": "127.0.0.1:0"}
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": ATTEMPTS - 1}),
        distributed.LocalCluster(**options, env=dict(environment or {}), silence_logs="CRITICAL") as made,
    ):
        yield made


@contextlib.contextmanager
def cluster(engine: str, folder: Path, environment: dict[str, str]) -> Iterator[tuple[str, ...]]:
    """The cluster that `engine` needs, with `environment`, to which it may add; yields options of the command."""
    if engine == "scheduler":
        with dask_cluster(environment) as made:
            yield "--engine", "dask", "--scheduler", made.scheduler_address
        return
    if engine == "slurm":
        environment |= stand_in_for_slurm(folder)
    yield {
        "local": ("--jobs", "2"),
        "dask": ("--engine", "dask", "--jobs", "2"),
        "slurm": ("--cluster-class", "dask_jobqueue.SLURMCluster", "--jobs", "2"),
    }[engine]
