"""Dask clusters: one that runs already, or one whose workers are SLURM jobs."""

import contextlib
import itertools
import logging
import platform
import threading
import time
from collections.abc import Callable, Collection, Generator, Iterator
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any

from srbval.campaign.case import CaseResult, CaseTask, version
from srbval.campaign.engines.local import KEPT, THREADS, CaseProcess, Job, crashed
from srbval.errors import ConfigurationError, DataError, SrbvalError
from srbval.processes.worker import without_ctrl_c
from srbval.scene import Scene

AHEAD = 2  # cases with the scheduler per worker: none waits for the next one, and the scheduler holds few
SLURM_MEMORY = "2 GB"
CONNECT_S = "20 s"
# Dask always serves a few pages about itself: on a port that only this machine reaches.
HIDDEN = {"dashboard_address": "127.0.0.1:0", "dashboard": False}
NO_DASHBOARD = ("--no-dashboard", "--dashboard-address", "127.0.0.1:0")
# For the first worker: a running scheduler's workers start in seconds, jobs may stand in a queue.
WAIT_S, QUEUE_WAIT_S = 120.0, 3600.0
ALONE = "-alone"  # ends the key of a case that is run with no other one beside it
CHECKS = 8  # how often the number of workers is checked within the time that a cluster may have none
_local = threading.local()  # a worker's process, one for each of its threads; it ends when no case comes for a while


class DaskCluster:
    """Cases on a Dask cluster. `make_client` is a context manager that yields a client; see the functions below.

    `wait_s`: how long to wait for the first worker, and for another one when all are lost [s]; after that `run` raises
    `DataError`.
    """

    def __init__(self, name: str, workers: int, make_client: Callable[[], Any], *, wait_s: float = WAIT_S) -> None:
        self.name, self.workers = name, workers
        self._make_client, self._wait_s = make_client, wait_s

    def run(self, job: Job) -> Generator[CaseResult]:
        """Results as they come; never more than a few cases per worker are with the scheduler."""
        from distributed import KilledWorker

        with _one_error(self.name), self._make_client() as client:
            self._wait_for_a_worker(client)

            def submit(task: CaseTask, alone: str = "") -> Any:
                key, scenes = f"srbval-{task.key}{alone}", tuple(job.precompiled)
                return client.submit(run_on_worker, task, job.folder, version(), scenes, key=key, pure=False)

            waiting = iter(job.tasks)
            blamed: list[CaseTask] = []
            submitted: dict[Any, CaseTask] = {}
            while True:
                room = max(2, AHEAD * sum(client.nthreads().values())) - len(submitted)
                submitted |= {submit(task): task for task in itertools.islice(waiting, max(0, room))}
                if not submitted and blamed:
                    submitted = {submit(blamed[-1], ALONE): blamed.pop()}
                if not submitted:
                    return
                for future in self._ended(client, list(submitted)):
                    try:
                        yield future.result(timeout=self._wait_s / CHECKS)
                    except TimeoutError:
                        if future.status == "error":
                            raise
                        continue  # its worker was lost with the result: it is run again
                    except KilledWorker:
                        # Dask blames all cases that a lost worker held: alone, one shows whether it was the cause.
                        if future.key.endswith(ALONE):
                            yield crashed(submitted[future].key, f"{self.name} worker was lost each time it was tried")
                        else:
                            blamed.append(submitted[future])
                    del submitted[future]

    def _ended(self, client: Any, futures: Collection[Any]) -> Collection[Any]:
        """Those of `futures` that have ended, at least one; `DataError` where no worker comes any more."""
        from distributed import wait

        seen = time.monotonic()
        while True:
            try:
                return wait(futures, timeout=self._wait_s / CHECKS, return_when="FIRST_COMPLETED").done
            except TimeoutError:
                if client.nthreads():
                    seen = time.monotonic()
                elif time.monotonic() - seen > self._wait_s:
                    raise DataError(
                        f"all workers of {self.name} were lost, and no other came within {self._wait_s:g} s. {KEPT} "
                        "Where jobs end at their time limit, ask for longer ones."
                    ) from None
            except CancelledError:
                raise DataError(f"the scheduler of {self.name} is gone. {KEPT}") from None

    def _wait_for_a_worker(self, client: Any) -> None:
        try:
            client.wait_for_workers(1, timeout=self._wait_s)
        except TimeoutError:
            raise DataError(
                f"no worker of {self.name} came within {self._wait_s:g} s. Its own log says why: a queue that is full, "
                "jobs that sbatch refuses, or workers that cannot reach the scheduler and give up. Wait longer with "
                "--wait S; the same command starts again where this one stopped."
            ) from None


@contextlib.contextmanager
def _one_error(name: str) -> Iterator[None]:
    """Turn what a cluster raises into one `DataError`, and keep what Dask logs of it from the user's terminal."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    except SrbvalError:
        raise
    except Exception as error:  # of the network, of a worker that lacks packages, of Dask's own configuration
        said = str(error).strip().splitlines() or [""]
        raise DataError(f"{name} failed ({type(error).__name__}: {said[0]}). {KEPT}") from None
    finally:
        logging.disable(before)


def cluster_at(address: str, *, wait_s: float = WAIT_S) -> DaskCluster:
    """The cluster of a scheduler at `address`, such as ``tcp://host:8786``; its workers should have one thread each."""

    @contextlib.contextmanager
    def client() -> Iterator[Any]:
        from distributed import Client

        try:
            connected = Client(address, timeout=CONNECT_S)
        except (OSError, ValueError) as error:
            raise DataError(f"no Dask scheduler answers at {address} ({error}). Start one: dask scheduler") from None
        with connected:
            yield connected

    return DaskCluster(f"dask at {address}", 0, client, wait_s=wait_s)


def slurm_cluster(workers: int, *, wait_s: float = QUEUE_WAIT_S, dashboard: str | None = None) -> DaskCluster:
    """A cluster of `workers` SLURM jobs of one core each; queue, account and time from Dask's own configuration.

    Those stand in ``~/.config/dask/jobqueue.yaml`` under ``jobqueue.slurm``, as dask-jobqueue documents. No dashboard
    is served but at the address `dashboard`, ``HOST:PORT``, or where that configuration asks for one.
    """

    @contextlib.contextmanager
    def client() -> Iterator[Any]:
        import dask
        from distributed import Client

        with without_ctrl_c():
            from dask_jobqueue import SLURMCluster
        own = dask.config.get("jobqueue.slurm", {})
        one_thread = [f"export {name}=1" for name in THREADS]
        asked = {"dashboard_address": dashboard, "dashboard": True} if dashboard else {}
        with (
            SLURMCluster(
                cores=1, processes=1, memory=own.get("memory") or SLURM_MEMORY,
                job_script_prologue=[*(own.get("job-script-prologue") or []), *one_thread],
                worker_extra_args=[*NO_DASHBOARD, *(own.get("worker-extra-args") or [])],
                scheduler_options=HIDDEN | (own.get("scheduler-options") or {}) | asked,
            ) as cluster,
            Client(cluster) as connected,
        ):  # fmt: skip
            cluster.scale(jobs=workers)
            yield connected

    return DaskCluster("slurm", workers, client, wait_s=wait_s)


def run_on_worker(task: CaseTask, folder: Path, expected: str, scenes: tuple[Scene, ...]) -> CaseResult:
    """Run a case in a process of its own, so that one that dies or hangs takes no Dask worker with it.

    Raises `ConfigurationError` where the version of this worker's code is not the one `expected`, `DataError` where it
    does not see the campaign's `folder`.
    """
    process: CaseProcess | None = getattr(_local, "process", None)
    if process is None or process.scenes != scenes:
        process = _local.process = CaseProcess(scenes)
    host = platform.node()
    if (theirs := process.prepare()) != expected:
        raise ConfigurationError(
            f"the Dask workers at {host} run another version of the model ({theirs}, here {expected}): results "
            "would not compare. Install the same srbval there."
        )
    if not folder.is_dir():
        raise DataError(f"the Dask worker at {host} does not see {folder}; choose a folder that all machines share.")
    return process.run(task)
