"""Every engine gives the same results, and no case takes the others with it."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from srbval.campaign.engines.choose import choose_engine
from srbval.campaign.engines.dask_cluster import cluster_at
from srbval.campaign.engines.engine import Job
from srbval.campaign.engines.local import LocalProcesses
from srbval.campaign.run import run_campaign
from srbval.errors import ConfigurationError, DataError
from tests.campaign.command import stand_in_for_slurm
from tests.campaign.in_process import InProcess
from tests.campaign.scheduler import Scheduler, running_scheduler
from tests.campaign.small import content, failing_point, small

RESULTS = "cases/*/*.h5"
MIXED: list[dict[str, Any]] = [
    {"kind": "list", "cases": [{"defect.kind": "none"}, {"defect.kind": "inner"}, failing_point(),
                               {"load.radial": "-3 kN"}, {"model": "planar"},
                               {"bearing": "skf-6205", "model": "full"}]},
]  # fmt: skip


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign with good and bad cases, run in this process."""
    folder = tmp_path_factory.mktemp("reference")
    found = run_campaign(small(axes=MIXED), folder, engine=InProcess())
    assert (found.cases, found.done, found.ran) == (6, 6, 5)
    reasons = {entry["case"]: (entry["ending"], entry["reason"]) for entry in found.failed}
    assert set(reasons) == {2, 3, 5}
    assert reasons[2][0] == "failed"  # the numerics, with the run's own status
    assert reasons[2][1].split(":")[0] in {
        "not-finite",
        "too-deep",
        "cage-lost",
        "load-lost",
        "energy-open",
        "step-too-long",
    }
    assert reasons[3] == ("refused", "load radial_n = -3000 must not be negative.")
    assert reasons[5][0] == "refused"
    assert "has no [geometry]" in reasons[5][1]
    return folder


@pytest.mark.parametrize("name", ["serial", "local"])
def test_processes_of_this_machine_give_the_same(name: str, reference: Path, tmp_path: Path) -> None:
    found = run_campaign(small(axes=MIXED), tmp_path, engine=choose_engine(name, jobs=2))
    assert (found.engine, found.workers) == (name, 1 if name == "serial" else 2)
    assert content(tmp_path) == content(reference)


@pytest.fixture
def scheduler(tmp_path: Path) -> Iterator[Scheduler]:
    with running_scheduler(tmp_path) as running:
        yield running


def test_a_scheduler_with_two_workers_gives_the_same(reference: Path, tmp_path: Path, scheduler: Scheduler) -> None:
    found = run_campaign(small(axes=MIXED), tmp_path, engine=choose_engine(address=scheduler.address))
    assert found.engine == f"dask at {scheduler.address}"
    assert content(tmp_path) == content(reference)


def test_workers_lost_for_good_end_the_campaign_and_keep_what_had_come(tmp_path: Path, scheduler: Scheduler) -> None:
    """As when all jobs reach their time limit: a client would wait for ever for another worker."""
    campaign = small(axes=[{"kind": "grid", "values": {"seed": list(range(60))}}])

    def lose_all() -> None:
        while not any(tmp_path.glob(RESULTS)):
            time.sleep(0.01)
        for worker in scheduler.workers:
            worker.kill()

    thread = threading.Thread(target=lose_all, daemon=True)
    thread.start()
    with pytest.raises(DataError, match=r"all workers .* were lost, and no other came within 2 s"):
        run_campaign(campaign, tmp_path, engine=cluster_at(scheduler.address, wait_s=2.0))
    thread.join()
    kept = len(list(tmp_path.glob(RESULTS)))
    assert 0 < kept < 60
    again = run_campaign(campaign, tmp_path, engine=InProcess())
    assert (again.done, again.ran, again.failed) == (60, 60 - kept, ())


BAD_CASES = """\
import os, signal, time
import srbval.campaign.work as work
good = work._simulate
def simulate(scene):
    if scene.seed == 666:
        os.kill(os.getpid(), signal.SIGKILL)
    if scene.seed == 667:
        time.sleep(1e6)
    if scene.seed == 668:
        sum(iter(int, 1))  # lets no other thread of Python run
    return good(scene)
def write(path, run, *rest):
    if run.scene.seed == 669:
        time.sleep(1e6)
    return good_write(path, run, *rest)
good_write = work.write_result
work._simulate, work.write_result = simulate, write
"""
LIMIT = "4 s"  # of a case that takes milliseconds: on a busy machine its process may wait for a second or two


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")
@pytest.mark.parametrize("name", ["serial", "local", pytest.param("dask", marks=pytest.mark.slow)])
def test_cases_that_kill_their_process_or_never_end(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each fails with its reason, the others run, and the next start tries those two again and nothing else."""
    (tmp_path / "sitecustomize.py").write_text(BAD_CASES)
    paths = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    scene = {"model": "kinematic", "duration": "5 ms", "settle": "0 s", "defect": {"kind": "outer"}}
    axes = [{"kind": "grid", "values": {"seed": [1, 666, 2, 667, 668, 669]}}]
    campaign = small(axes=axes, scene=scene, outputs=["summary"], limit_factor=1.0, least_limit=LIMIT)
    if name != "dask":
        with monkeypatch.context() as patched:
            patched.setenv("PYTHONPATH", paths)
            found = run_campaign(campaign, tmp_path / "run", engine=choose_engine(name, jobs=2))
    else:
        with running_scheduler(tmp_path, nannies=True, environment={"PYTHONPATH": paths}) as scheduler:
            found = run_campaign(campaign, tmp_path / "run", engine=cluster_at(scheduler.address))
    assert (found.cases, found.done) == (6, 6)
    endings = ["crashed", "timed-out", "timed-out", "timed-out"]
    assert [(entry["case"], entry["ending"]) for entry in found.failed] == list(zip((1, 3, 4, 5), endings, strict=True))
    crash, timeout, *_ = (entry["reason"] for entry in found.failed)
    assert "its process died 3 times (signal SIGKILL)" in crash
    assert f"longer than its limit of {LIMIT}" in timeout
    assert "--least-limit" in timeout
    again = run_campaign(campaign, tmp_path / "run", engine=InProcess())
    assert (again.ran, again.failed) == (4, ())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"name": "threads"}, "'threads' is not known"),
        ({"jobs": 0}, "at least 1"),
        ({"name": "local", "address": "tcp://x:1"}, "needs --engine dask"),
    ],
)
def test_engines_that_cannot_be(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        choose_engine(**options)


@pytest.mark.parametrize("name", ["auto", "dask", "local"])
def test_without_a_scheduler_processes_of_this_machine_are_used(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    engine = choose_engine(name, jobs=3)
    assert isinstance(engine, LocalProcesses)
    assert (engine.name, engine.workers) == ("local", 3)


@pytest.mark.parametrize(
    ("options", "package"),
    [({"name": "slurm"}, "dask-jobqueue"), ({"name": "dask", "address": "tcp://x:1"}, "distributed")],
)
def test_a_missing_package_is_named(options: dict[str, Any], package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    with pytest.raises(ConfigurationError, match=f"{package}: pip install"):
        choose_engine(**options)


def test_no_scheduler_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("srbval.campaign.engines.dask_cluster.CONNECT_S", "1 s")
    with pytest.raises(DataError, match="no Dask scheduler answers"):
        run_campaign(small(), tmp_path, engine=choose_engine(address="tcp://127.0.0.1:9"))


def _use_stand_in(folder: Path, monkeypatch: pytest.MonkeyPatch, **changes: str) -> None:
    for name, value in stand_in_for_slurm(folder, **changes).items():
        monkeypatch.setenv(name, value)
    monkeypatch.chdir(folder)


def test_workers_that_never_come(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker that cannot reach its scheduler gives up after a while, unseen by dask-jobqueue."""
    pytest.importorskip("dask_jobqueue")
    _use_stand_in(tmp_path, monkeypatch, sbatch='#!/bin/sh\necho "Submitted batch job 1"\n')
    with pytest.raises(DataError, match=r"no worker of slurm came within 0\.5 s.*--wait"):
        run_campaign(small(), tmp_path / "run", engine=choose_engine("slurm", jobs=1, wait_s=0.5))


def test_slurm_jobs_give_the_same(reference: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Through dask-jobqueue, with a stand-in for SLURM that starts its jobs at once on this machine."""
    pytest.importorskip("dask_jobqueue")
    _use_stand_in(tmp_path, monkeypatch)
    found = run_campaign(small(axes=MIXED), tmp_path / "run", engine=choose_engine("slurm", jobs=2))
    assert found.engine == "slurm"
    assert content(tmp_path / "run") == content(reference)


def test_the_script_of_a_slurm_job(monkeypatch: pytest.MonkeyPatch) -> None:
    """What dask-jobqueue would hand to sbatch: one core and one thread a job, the user's own settings kept."""
    pytest.importorskip("dask_jobqueue")
    import dask
    from dask_jobqueue import SLURMCluster

    made: list[tuple[str, int]] = []

    def record(cluster: SLURMCluster, *_: int, jobs: int = 0) -> None:
        made.append((cluster.job_script(), jobs))
        if jobs:
            assert cluster.scheduler_address.startswith("tcp://127.0.0.1:")
            raise InterruptedError("here")

    monkeypatch.setattr(SLURMCluster, "scale", record)
    own: dict[str, Any] = {"queue": "long", "account": "bearings", "walltime": "02:00:00"}
    own |= {"job-script-prologue": ["module load python"]}
    job = Job(folder=Path(), precompiled=(), tasks=[], count=0)
    own |= {"worker-extra-args": ["--lifetime", "1h"], "scheduler-options": {"host": "127.0.0.1"}}
    with (
        dask.config.set({f"jobqueue.slurm.{k}": v for k, v in own.items()}),
        pytest.raises(DataError, match="InterruptedError: here"),
    ):
        list(choose_engine("slurm", jobs=3).run(job))
    script, jobs = made[0]
    assert jobs == 3
    lines = script.splitlines()
    assert lines[0].startswith("#!")
    for wanted in ("-p long", "-A bearings", "-t 02:00:00", "--cpus-per-task=1", "-n 1"):
        assert f"#SBATCH {wanted}" in lines, script
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        assert f"export {variable}=1" in lines
    assert lines.index("module load python") < lines.index("export OMP_NUM_THREADS=1")
    for option in ("dask", "--nthreads 1", "--no-dashboard --dashboard-address 127.0.0.1:0", "--lifetime 1h"):
        assert option in lines[-1]
