"""Small campaigns in the test's own process, and their folders; the command as a process, and clusters for it."""

import contextlib
import hashlib
import os
import subprocess
import sys

import pytest

from srbval.campaign.cases import Campaign
from srbval.campaign.engines import Engine
from srbval.campaign.run import RESULTS_CSV, run_campaign, verify_campaign
from srbval.campaign.worker import ATTEMPTS, run_case
from srbval.errors import DataError
from srbval.storage.tables import build
from tests.marked import answer_ctrl_c

FAILING = {"model": "planar", "load.radial": "100 MN"}  # the rollers lose the load
# Three good cases with signals, one on which the numerics fail, two that are refused.
LISTED = [{"defect.kind": "outer", "model": "planar"}, {"defect.kind": "inner", "model": "kinematic"}]
LISTED += [{"model": "planar"}, FAILING, {"load.radial": "-3 kN"}, {"bearing": "skf-6205", "model": "full"}]
MIXED = [{"kind": "list", "cases": LISTED}]


def small(**changes):
    """Six cases of a simple model, 5 ms each."""
    speeds, kinds = {"shaft_speed": ["400 rpm", "700 rpm", "900 rpm"]}, {"defect.kind": ["none", "outer"]}
    table = {"name": "small", "outputs": ["summary", "statistics", "acceleration"]}
    table["scene"] = {"duration": "5 ms", "settle": "0 s", "model": "planar"}
    table["axes"] = [{"kind": "grid", "values": values} for values in (speeds, kinds)]
    return build(Campaign, table | changes, "campaign")


def one_after_the_other(tasks):
    for result in map(run_case, tasks):
        if isinstance(result, DataError):
            raise result
        yield result


def run_small(campaign, folder):
    """Run a campaign in this process, without limits."""
    return run_campaign(campaign, folder, engine=Engine("in-process", one_after_the_other))


def resume(folder, **changes):
    """Run the campaign `MIXED` again; returns its summary."""
    return run_small(small(axes=MIXED, **changes), folder)


def content(folder):
    """Digest of every result, and of the table of results, by name."""
    files = [*(folder / "cases").glob("*.h5"), folder / RESULTS_CSV]
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def good_results(folder):
    """The results with signals."""
    return sorted(path for path in (folder / "cases").glob("*.h5") if path.stat().st_size > 20_000)


def damaged_names(folder):
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


def start(file, folder, *options, stderr=subprocess.DEVNULL, environment=()):
    """Start the command in a process group of its own, in the folder of the file."""
    command = [sys.executable, "-m", "srbval", "campaign", "run", str(file), "-o", str(folder), *options]
    own = {"cwd": file.parent, "env": os.environ | dict(environment), "preexec_fn": answer_ctrl_c}
    return subprocess.Popen(command, start_new_session=True, stdout=subprocess.DEVNULL, stderr=stderr, **own)


def stand_in_for_slurm(folder, **changes):
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
def dask_cluster(environment):
    """A cluster of Dask with two worker processes of one thread each, which have that `environment`."""
    distributed = pytest.importorskip("distributed")
    import dask

    options = {"n_workers": 2, "threads_per_worker": 1, "host": "127.0.0.1", "dashboard_address": "127.0.0.1:0"}
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": ATTEMPTS - 1}),
        distributed.LocalCluster(**options, env=environment, silence_logs="CRITICAL") as made,
    ):
        yield made


@contextlib.contextmanager
def cluster(engine, folder, environment):
    """The cluster that `engine` needs, with `environment`, to which it may add; yields options of the command."""
    if engine == "scheduler":
        with dask_cluster(environment) as made:
            yield "--engine", "dask", "--scheduler", made.scheduler_address
        return
    if engine == "slurm":
        environment |= stand_in_for_slurm(folder)
    kinds = {"local": (), "dask": ("--engine", "dask"), "slurm": ("--cluster-class", "dask_jobqueue.SLURMCluster")}
    yield (*kinds[engine], "--jobs", "2")
