"""Every engine gives the same results, and no case takes the others with it."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any

import pytest

from srbval.campaign.engines.choose import choose_engine
from srbval.campaign.engines.dask_engine import existing
from srbval.campaign.engines.engine import Job
from srbval.campaign.engines.processes import LocalProcesses
from srbval.campaign.engines.serial import Serial
from srbval.campaign.run import run_campaign
from srbval.campaign.store import Store
from srbval.errors import ConfigurationError, DataError
from tests.campaign.small import content, failing_point, small

RESULTS = "cases/*/*.h5"
MIXED: list[dict[str, Any]] = [
    {"kind": "list", "cases": [{"defect.kind": "none"}, {"defect.kind": "inner"}, failing_point(),
                               {"load.radial": "-3 kN"}, {"model": "planar"}, {"bearing": "skf-6205"}]},
]  # fmt: skip


@pytest.fixture(scope="module")
def serial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign with good and bad cases, run in this process."""
    folder = tmp_path_factory.mktemp("serial")
    found = run_campaign(small(axes=MIXED), folder, engine=Serial())
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
    assert reasons[3] == ("refused", "radial_n = -3000.0 must not be negative.")
    assert reasons[5][0] == "refused"
    assert "has no [geometry]" in reasons[5][1]
    return folder


def test_local_processes_give_the_same(serial: Path, tmp_path: Path) -> None:
    run_campaign(small(axes=MIXED), tmp_path, engine=LocalProcesses(2))
    assert content(tmp_path) == content(serial)


def test_embedded_dask_gives_the_same(serial: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Even where its cluster fails on closing: the results are there by then."""
    cluster = pytest.importorskip("distributed").LocalCluster
    close = cluster.close

    def fail(self: Any) -> None:
        close(self)
        raise AssertionError("can only join a started process")

    monkeypatch.setattr(cluster, "close", fail)
    run_campaign(small(axes=MIXED), tmp_path, engine=choose_engine("dask", jobs=2))
    assert content(tmp_path) == content(serial)


def test_a_scheduler_with_two_workers_gives_the_same(serial: Path, tmp_path: Path, scheduler: Scheduler) -> None:
    found = run_campaign(small(axes=MIXED), tmp_path, engine=choose_engine(address=scheduler.address))
    assert found.engine == f"dask at {scheduler.address}"
    assert content(tmp_path) == content(serial)


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
        run_campaign(campaign, tmp_path, engine=existing(scheduler.address, wait_s=2.0))
    thread.join()
    kept = len(list(tmp_path.glob(RESULTS)))
    assert 0 < kept < 60
    again = run_campaign(campaign, tmp_path, engine=Serial())
    assert (again.done, again.ran, again.failed) == (60, 60 - kept, ())


@dataclass(frozen=True)
class Scheduler:
    """A Dask scheduler and its workers."""

    address: str
    workers: list[subprocess.Popen[bytes]]


@pytest.fixture
def scheduler(tmp_path: Path) -> Iterator[Scheduler]:
    """A Dask scheduler with two worker processes of its own."""
    pytest.importorskip("distributed")
    file = tmp_path / "scheduler.json"
    common = ["--scheduler-file", str(file), "--no-dashboard"]
    dask = [sys.executable, "-m", "dask"]
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path}
    started = [
        subprocess.Popen([*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", *common], **quiet),
        *(subprocess.Popen([*dask, "worker", "--nthreads", "1", "--no-nanny", *common], **quiet) for _ in range(2)),
    ]
    try:
        from distributed import Client

        with Client(scheduler_file=str(file), timeout="60 s") as client:
            client.wait_for_workers(2, timeout=60)
            address = str(client.scheduler.address)
        yield Scheduler(address, started[1:])
    finally:
        for process in reversed(started):
            process.terminate()
        for process in started:
            try:
                process.wait(timeout=10)
            except subprocess.TimeoutExpired:  # a worker may hang where its scheduler goes while it says goodbye
                process.kill()
                process.wait()


def killer(folder: Path) -> None:
    """Make the case at 700 rpm without defect kill its process, in every process of this engine."""
    (folder / "sitecustomize.py").write_text(
        "import os, signal, srbval.campaign.work as work\n"
        "good = work._simulate\n"
        "def bad(scene):\n"
        "    if scene.seed == 666:\n"
        "        os.kill(os.getpid(), signal.SIGKILL)\n"
        "    return good(scene)\n"
        "work._simulate = bad\n"
    )


def busy_machine(monkeypatch: pytest.MonkeyPatch, workers: int) -> None:
    """Dask as on a busy machine: workers after the first `workers` start late, nannies look seldom, closing is slow.

    A worker whose case kills it is then dead before its nanny saw it start, and its successor is not there when the
    cluster is closed.
    """
    from distributed import Client
    from distributed.nanny import WorkerProcess

    start, close, begun = SpawnProcess.start, Client.close, itertools.count()

    def start_late(process: SpawnProcess) -> None:
        if next(begun) >= workers:
            time.sleep(0.6)
        start(process)

    def close_late(client: Client, *options: Any) -> Any:
        time.sleep(0.4)
        return close(client, *options)

    monkeypatch.setattr(SpawnProcess, "start", start_late)
    monkeypatch.setattr(Client, "close", close_late)
    monkeypatch.setattr(WorkerProcess, "_init_msg_interval", 0.2, raising=False)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")
@pytest.mark.parametrize("name", ["local", "dask"])
def test_a_case_that_kills_its_process(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if name == "dask":
        pytest.importorskip("distributed")
        busy_machine(monkeypatch, workers=2)
    killer(tmp_path)
    paths = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    monkeypatch.setenv("PYTHONPATH", paths)
    campaign = small(axes=[{"kind": "grid", "values": {"seed": [1, 666, 2, 3]}}])
    found = run_campaign(campaign, tmp_path / "run", engine=choose_engine(name, jobs=2))
    assert (found.cases, found.done) == (4, 4)
    assert [(entry["case"], entry["ending"]) for entry in found.failed] == [(1, "crashed")]
    assert "its process died 3 times" in found.failed[0]["reason"]
    # the next start tries it again, and nothing else
    monkeypatch.setenv("PYTHONPATH", os.environ["PYTHONPATH"].removeprefix(str(tmp_path) + os.pathsep))
    (tmp_path / "sitecustomize.py").unlink()
    again = run_campaign(campaign, tmp_path / "run", engine=choose_engine("local", jobs=1))
    assert (again.ran, again.failed) == (1, ())


def test_serial_runs_what_may_have_killed_it_last_and_apart(tmp_path: Path) -> None:
    campaign = small()
    store = Store(tmp_path)
    run_campaign(small(axes=[]), tmp_path, engine=Serial())
    from srbval.campaign.planning import plan_cases

    suspect = plan_cases(campaign)[0].key
    store.begun(suspect)  # as a killed process leaves it
    run_campaign(campaign, tmp_path, engine=Serial())
    begun = [entry["key"] for entry in store.journal() if entry["event"] == "begun"]
    assert begun[-1] == suspect
    assert store.path_of(suspect).exists()


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


def test_without_dask_processes_are_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("srbval.campaign.engines.choose._installed", lambda _: False)
    assert choose_engine().name == "local"
    with pytest.raises(ConfigurationError, match="pip install"):
        choose_engine("dask")
    with pytest.raises(ConfigurationError, match="dask-jobqueue"):
        choose_engine("slurm")


def test_no_scheduler_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("srbval.campaign.engines.dask_engine.CONNECT_S", "1 s")
    with pytest.raises(DataError, match="no Dask scheduler answers"):
        run_campaign(small(), tmp_path, engine=choose_engine(address="tcp://127.0.0.1:9"))


FAKE = {
    "sbatch": '#!/bin/sh\nbash "$1" >/dev/null 2>&1 &\necho "Submitted batch job $!"\n',
    "scancel": '#!/bin/sh\nkill "$@" 2>/dev/null\nexit 0\n',
}


def stand_in_for_slurm(folder: Path, monkeypatch: pytest.MonkeyPatch, **changes: str) -> None:
    """Put the commands of `FAKE`, but for `changes`, before all others."""
    commands = folder / "bin"
    commands.mkdir()
    for name, script in (FAKE | changes).items():
        (commands / name).write_text(script)
        (commands / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{commands}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.chdir(folder)


def test_workers_that_never_come(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker that cannot reach its scheduler gives up after a while, unseen by dask-jobqueue."""
    pytest.importorskip("dask_jobqueue")
    stand_in_for_slurm(tmp_path, monkeypatch, sbatch='#!/bin/sh\necho "Submitted batch job 1"\n')
    with pytest.raises(DataError, match=r"no worker of slurm came within 0\.5 s.*--wait"):
        run_campaign(small(), tmp_path / "run", engine=choose_engine("slurm", jobs=1, wait_s=0.5))


def test_slurm_jobs_give_the_same(serial: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Through dask-jobqueue, with a stand-in for SLURM that starts its jobs at once on this machine."""
    pytest.importorskip("dask_jobqueue")
    stand_in_for_slurm(tmp_path, monkeypatch)
    found = run_campaign(small(axes=MIXED), tmp_path / "run", engine=choose_engine("slurm", jobs=2))
    assert found.engine == "slurm"
    assert content(tmp_path / "run") == content(serial)


@pytest.mark.parametrize("name", ["local", pytest.param("dask", marks=pytest.mark.slow)])
def test_a_case_that_never_ends(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its process is ended, once; it fails with the reason, the others go on, and the next start tries it again."""
    if name == "dask":
        pytest.importorskip("distributed")
    (tmp_path / "sitecustomize.py").write_text(
        "import time, srbval.campaign.work as work\n"
        "good = work._simulate\n"
        "work._simulate = lambda scene: time.sleep(1e6) if scene.seed == 666 else good(scene)\n"
    )
    paths = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    monkeypatch.setenv("PYTHONPATH", paths)
    axes = [{"kind": "grid", "values": {"seed": [1, 666, 2, 3]}}]
    scene = {"model": "kinematic", "duration": "5 ms", "settle": "0 s", "defect": {"kind": "outer"}}
    campaign = small(axes=axes, scene=scene, outputs=["summary"], limit_factor=1.0, least_limit="6 s")
    found = run_campaign(campaign, tmp_path / "run", engine=choose_engine(name, jobs=2))
    assert (found.cases, found.done) == (4, 4)
    assert [(entry["case"], entry["ending"]) for entry in found.failed] == [(1, "timed-out")]
    assert "longer than its limit of 6 s" in found.failed[0]["reason"]
    assert "--least-limit" in found.failed[0]["reason"]
    (tmp_path / "sitecustomize.py").unlink()
    again = run_campaign(campaign, tmp_path / "run", engine=choose_engine("local", jobs=1))
    assert (again.ran, again.failed) == (1, ())


def test_what_holds_the_interpreter_is_ended_too(tmp_path: Path) -> None:
    """A loop in a library lets no thread of Python strike; the process is then ended from outside the interpreter."""
    code = (
        "import sys; from pathlib import Path; from srbval.campaign import watch\n"
        "from srbval.campaign.task import Task; from srbval.scene import paper_scene\n"
        "watch.GRACE_S = 0.2; watch.run_task = lambda task: sum(iter(int, 1))\n"
        "task = Task(key='a', scene=paper_scene(), outputs=(), path=Path(sys.argv[1]), limit_s=0.2)\n"
        "watch._strike = lambda task: None\n"
        "watch.run_watched(task)\n"
    )
    tree = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path / "a.h5")], check=False, cwd=tree, timeout=60)
    assert done.returncode == 1


def test_the_script_of_a_slurm_job(monkeypatch: pytest.MonkeyPatch) -> None:
    """What dask-jobqueue would hand to sbatch: one core and one thread a job, the user's own settings kept."""
    pytest.importorskip("dask_jobqueue")
    import dask
    from dask_jobqueue import SLURMCluster

    made: list[tuple[str, int]] = []

    def record(cluster: SLURMCluster, *_: int, jobs: int = 0) -> None:
        made.append((cluster.job_script(), jobs))
        if jobs:
            raise InterruptedError

    monkeypatch.setattr(SLURMCluster, "scale", record)
    own: dict[str, Any] = {"queue": "long", "account": "bearings", "walltime": "02:00:00"}
    own |= {"job-script-prologue": ["module load python"]}
    job = Job(folder=Path(), first=(), tasks=[], begun=lambda _: None)
    with dask.config.set({f"jobqueue.slurm.{k}": v for k, v in own.items()}), pytest.raises(InterruptedError):
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
    assert "--nthreads 1" in lines[-1]
    assert "dask" in lines[-1]
