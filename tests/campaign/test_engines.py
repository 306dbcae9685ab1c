"""Every engine gives the same results, no case takes others with it, failures are one line, no port stands open."""

import contextlib
import errno
import os
import re
import signal
import subprocess
import threading
from concurrent.futures import Future

import pytest

from srbval.campaign.engines import WORKER_CHECK_S, choose_engine, run_tasks
from srbval.campaign.run import run_campaign
from srbval.errors import ConfigurationError, DataError
from tests.campaign.campaigns import MANY, MIXED, content, dask_cluster, run_small, small, stand_in_for_slurm, start
from tests.marked import until

LIMIT = "6 s"  # of a case that takes milliseconds, in a process that must start on a busy machine
TINY = {"model": "kinematic", "duration": "5 ms", "settle": "0 s", "defect": {"kind": "outer"}}
IN_THREADS = {"processes": False, "dashboard_address": "127.0.0.1:0"}  # a cluster within this process


@pytest.mark.parametrize("name", ["local", "dask"])
def test_every_engine_gives_the_same(name, whole, tmp_path):
    with contextlib.ExitStack() as opened:
        engine = choose_engine(jobs=2)
        if name == "dask":
            kind = pytest.importorskip("distributed").LocalCluster
            cluster = opened.enter_context(kind(n_workers=2, threads_per_worker=1, **IN_THREADS))
            cluster.adapt(minimum=1, maximum=2)
            engine = choose_engine(cluster)
        found = run_campaign(small(axes=MIXED), tmp_path, engine=engine)
    assert (found["engine"], found["done"]) == (name, 6)
    assert content(tmp_path) == content(whole)


@pytest.mark.slow
def test_workers_lost_for_good_end_the_campaign_and_keep_what_had_come(tmp_path, monkeypatch):
    """As when all jobs reach their time limit: a client would wait for ever for another worker."""
    campaign = small(scene=TINY, axes=[{"kind": "grid", "values": {"seed": list(range(20))}}])

    monkeypatch.setattr("srbval.campaign.engines.WORKER_CHECK_S", 0.2)
    with dask_cluster({"PYTHONPATH": _at_start(LONG_CASES, tmp_path)}) as cluster:

        def lose_all():
            until(lambda: any(tmp_path.glob("cases/*.h5")))
            cluster.scale(0)

        thread = threading.Thread(target=lose_all, daemon=True)
        thread.start()
        engine = choose_engine(cluster.scheduler_address, wait_s=0.5)
        with pytest.raises(DataError, match=r"no worker of dask at .* for 0\.5 s.*same command runs the rest"):
            run_campaign(campaign, tmp_path, engine=engine)
        thread.join()
    kept = len(list(tmp_path.glob("cases/*.h5")))
    assert 0 < kept < 20
    again = run_small(campaign, tmp_path)
    assert (again["done"], again["ran"], again["failed"]) == (20, 20 - kept, [])


def test_a_result_that_is_lost_with_its_worker_comes_from_another():
    """Dask's future ends, its worker is lost before the result came, and ends again after another run."""
    asked, checks = [], []

    class LostOnce(Future):
        def result(self, timeout=None):
            asked.append(timeout)
            if len(asked) == 1:
                raise TimeoutError
            return super().result(timeout)

    def submit(_, task):
        future = LostOnce()
        future.set_result(task)
        return future

    found = run_tasks(submit, ["first", "second"], check=lambda: checks.append(len(asked)))
    assert sorted(found) == ["first", "second"]
    assert (checks, asked) == ([1], [WORKER_CHECK_S] * 3)


LONG_CASES = """\
import time
import srbval.sweep.pool as pool
def attempt(scene, *, good=pool.attempt, **options):
    time.sleep(0.5)
    return good(scene, **options)
pool.attempt = attempt
"""
BAD_CASES = """\
import os, signal, time
import srbval.campaign.results as results, srbval.sweep.pool as pool
good, good_write = pool.attempt, results.write_result
def attempt(scene, **options):
    if scene.seed == 666:
        os.kill(os.getpid(), signal.SIGKILL)
    if scene.seed == 667:
        sum(iter(int, 1))  # lets no other thread of Python run
    return good(scene, **options)
def write(path, result, run=None, *rest):
    if run is not None and run.scene.seed == 668:
        time.sleep(1e6)
    return good_write(path, result, run, *rest)
pool.attempt, results.write_result = attempt, write
"""


def _at_start(code, folder):
    """The PYTHONPATH with which every process runs `code` when it starts."""
    (folder / "sitecustomize.py").write_text(code)
    return os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")
@pytest.mark.parametrize("name", ["local", pytest.param("dask", marks=pytest.mark.long_form)])
def test_cases_that_kill_their_process_or_never_end(name, tmp_path, monkeypatch):
    """Each fails with its reason, the others run, and the next start tries those again and nothing else."""
    paths = _at_start(BAD_CASES, tmp_path)
    axes = [{"kind": "grid", "values": {"seed": [1, 666, 2, 667, 668]}}]
    campaign = small(axes=axes, scene=TINY, outputs=["summary"], limit_factor=1.0, least_limit=LIMIT)
    if name == "local":
        with monkeypatch.context() as patched:
            patched.setenv("PYTHONPATH", paths)
            found = run_campaign(campaign, tmp_path / "run", engine=choose_engine(jobs=2))
    else:
        with dask_cluster({"PYTHONPATH": paths}) as cluster:
            found = run_campaign(campaign, tmp_path / "run", engine=choose_engine(cluster))
    assert (found["cases"], found["done"]) == (5, 5)
    ends = [(1, "crashed"), (3, "timed-out"), (4, "timed-out")]
    assert [(entry["case"], entry["status"]) for entry in found["failed"]] == ends
    crash, timeout, *_ = (entry["reason"] for entry in found["failed"])
    assert "its process died 3 times (signal SIGKILL)" in crash
    assert f"longer than its limit of {LIMIT}" in timeout
    assert "--least-limit" in timeout
    again = run_small(campaign, tmp_path / "run")
    assert (again["ran"], again["failed"]) == (3, [])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"engine": "slurm"}, "'slurm' is not a class of Dask clusters, such as dask_jobqueue.SLURMCluster"),
        ({"adapt": True}, "engine 'local' with --cluster-option or --adapt"),
        ({"engine": "tcp://x:1", "cluster_options": {"cores": 4}}, "engine 'tcp://x:1' with --cluster-option"),
        ({"engine": "distributed.Nothing"}, "is not a class of Dask clusters"),
        ({"engine": "queue.Queue"}, "is not a class of Dask clusters"),
        ({"engine": "no_such.Cluster"}, "needs dask.*-m pip install .*dask-jobqueue"),
    ],
)
def test_engines_that_cannot_be(options, message):
    pytest.importorskip("distributed")
    with pytest.raises(ConfigurationError, match=message):
        choose_engine(**options)


def test_no_scheduler_there(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("srbval.campaign.engines.CONNECT_S", "0.2 s")
    with pytest.raises(DataError, match=r"dask at tcp://127.0.0.1:9 failed \(.*0 of 6 cases"):
        run_campaign(small(), tmp_path, engine=choose_engine("tcp://127.0.0.1:9"))


@pytest.mark.parametrize(
    ("sbatch", "said"),
    [
        pytest.param("echo Submitted batch job 1", r"no worker of dask SLURMCluster", marks=pytest.mark.long_form),
        ("echo no such queue >&2\nexit 1", r"dask SLURMCluster failed \(RuntimeError: .* no such queue\)"),
    ],
    ids=["whose jobs never come", "that refuses jobs"],
)
def test_slurm(sbatch, said, tmp_path):
    """Cores and memory as stated; the user's own settings are kept."""
    environment = stand_in_for_slurm(tmp_path, sbatch=f'#!/bin/sh\ncp "$1" job.sh\n{sbatch}\n') | {
        "DASK_JOBQUEUE__SLURM__QUEUE": "long",
        "DASK_JOBQUEUE__SLURM__JOB_SCRIPT_PROLOGUE": "['module load python']",
        "DASK_JOBQUEUE__SLURM__WORKER_EXTRA_ARGS": "['--lifetime', '1h']",
    }
    file, options = tmp_path / "many.toml", ["--cluster-class", "dask_jobqueue.SLURMCluster", "--jobs", "1"]
    options += ["--cluster-option", "cores=4", "--cluster-option", "memory=8GB", "--wait", "0.5"]
    file.write_text(MANY)
    process = start(file, tmp_path / "run", *options, stderr=subprocess.PIPE, environment=environment)
    text = process.communicate()[1].decode()
    assert "Traceback" not in text
    (line,) = (line for line in text.splitlines() if not line.startswith("campaign many"))
    assert process.returncode == 3
    assert re.search(said + r".*the same command runs the rest\.", line)
    script = (tmp_path / "job.sh").read_text()
    wanted = ["#SBATCH -p long\n", "#SBATCH --cpus-per-task=4\n", "#SBATCH --mem=8G\n", "\nmodule load python\n"]
    wanted += ["--no-dashboard --dashboard-address 127.0.0.1:0", "--lifetime 1h"]
    assert [text for text in (*wanted, "--nthreads 4") if text not in script] == []


def test_processes_that_the_system_refuses(tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise OSError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    monkeypatch.setattr("srbval.processes.worker.WorkerProcess.start", refuse)
    with pytest.raises(DataError, match=r"refused to start a process .*unavailable.* --jobs"):
        run_campaign(small(), tmp_path, engine=choose_engine(jobs=2))
