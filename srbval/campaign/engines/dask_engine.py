"""A Dask cluster: one made for the campaign on this machine, one that is there already, or one that SLURM starts."""

from __future__ import annotations

import contextlib
import itertools
import logging
import os
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from typing import Any

from srbval.campaign.case import version
from srbval.campaign.engines import dask_worker
from srbval.campaign.engines.engine import ATTEMPTS, Job, Outcome, crashed
from srbval.campaign.engines.processes import THREADS
from srbval.campaign.engines.worker_watch import watched
from srbval.campaign.task import Task
from srbval.campaign.watch import run_watched
from srbval.campaign.work import prepare, ready
from srbval.errors import ConfigurationError, DataError

AHEAD = 2  # cases handed to the scheduler for each worker: none waits for the next, the scheduler holds few
SLURM_MEMORY = "2 GB"
CONNECT_S = "20 s"
# Of a scheduler's web page: two campaigns may run on one machine.
ANY_PORT = ":0"
# For the first worker: processes and a running scheduler's workers start in seconds, jobs may stand in a queue.
WAIT_S, QUEUE_WAIT_S = 120.0, 3600.0
# For the successor of a worker that was lost last, before the cluster is closed: it starts in seconds.
SUCCESSOR_S = 30.0


class DaskCluster:
    """Cases on a Dask cluster. `make_client` is a context that yields a client of it; see the functions below.

    `wait_s`: how long to wait for the first worker, and for another one when all are lost [s]; after that `run` raises
    `DataError`.
    """

    def __init__(self, name: str, workers: int, make_client: Callable[[], Any], *, wait_s: float = WAIT_S) -> None:
        self.name, self.workers = name, workers
        self._make_client, self._wait_s = make_client, wait_s

    def run(self, job: Job) -> Iterator[Outcome]:
        """Outcomes as they come; never more than a few cases a worker are with the scheduler."""
        from distributed import KilledWorker, as_completed

        waiting = iter(job.tasks)
        with contextlib.ExitStack() as stack:
            client = stack.enter_context(self._make_client())
            self._wait_for_a_worker(client)
            _prepare(client, job)
            under_way = as_completed()
            tasks: dict[str, tuple[Any, Task]] = {}
            blamed: list[Task] = []

            def submit(task: Task, name: str) -> Any:
                future = client.submit(run_watched, task, key=f"srbval-{task.key}{name}", pure=False, retries=0)
                tasks[future.key] = future, task
                return future

            def fill() -> None:
                room = max(2, AHEAD * sum(client.nthreads().values())) - len(tasks)
                for task in itertools.islice(waiting, max(0, room)):
                    job.begun(task.key)
                    under_way.add(submit(task, ""))

            stack.enter_context(watched(client, lambda: [f for f, _ in list(tasks.values())], wait_s=self._wait_s))
            try:
                fill()
                for future in under_way:
                    task = tasks[future.key][1]
                    try:
                        yield future.result()
                    except KilledWorker:
                        blamed.append(task)
                    del tasks[future.key]
                    future.release()
                    fill()
                # Dask blames all that a lost worker held: with nothing beside it a case tells whose fault it was.
                for task in blamed:
                    try:
                        yield submit(task, "-alone").result()
                    except KilledWorker:
                        yield crashed(task.key, "its Dask worker was lost, with no other case on it")
            except CancelledError:
                raise self._all_lost() from None

    def _all_lost(self) -> DataError:
        return DataError(
            f"all workers of {self.name} were lost, and no other came within {self._wait_s:g} s. Results that had come "
            "are kept; the same command goes on from there. Where jobs end at their time limit, ask for longer ones."
        )

    def _wait_for_a_worker(self, client: Any) -> None:
        try:
            client.wait_for_workers(1, timeout=self._wait_s)
        except TimeoutError:
            raise DataError(
                f"no worker of {self.name} came within {self._wait_s:g} s. Its own log says why: a queue that is full, "
                "or workers that cannot reach the scheduler and give up. Wait longer with --wait S; the same command "
                "starts again where this one stopped."
            ) from None


def embedded(workers: int, *, wait_s: float = WAIT_S) -> DaskCluster:
    """A cluster of `workers` processes on this machine, for this campaign alone."""

    @contextlib.contextmanager
    def client() -> Iterator[Any]:
        import dask
        from distributed import Client, LocalCluster

        settings = {
            "distributed.scheduler.allowed-failures": ATTEMPTS - 1,
            "distributed.deploy.lost-worker-timeout": f"{wait_s} s",  # after that no successor is started any more
        }
        with (
            dask.config.set(settings),
            _environment(),
            _closed(LocalCluster(
                n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=ANY_PORT,
                silence_logs=logging.CRITICAL, memory_limit=None, preload=[dask_worker.__name__],
            )) as cluster,
            Client(cluster) as made,
        ):  # fmt: skip
            yield made
            _await_successors(made, workers)

    return DaskCluster("dask", workers, client, wait_s=wait_s)


@contextlib.contextmanager
def _closed(cluster: Any) -> Iterator[Any]:
    """`cluster`, closed afterwards. Results are on disk by then: a close that fails does not fail the campaign."""
    try:
        yield cluster
    finally:
        try:
            cluster.close()
        except Exception:
            logging.getLogger(__name__).debug("the Dask cluster did not close cleanly", exc_info=True)


def _await_successors(client: Any, workers: int) -> None:
    """Wait until lost workers are replaced: a cluster cannot be closed while it starts the successor of one.

    A nanny that misses how soon its worker died after it registered takes the successor for started before it is, and
    its close then fails on an assertion (distributed 2026.8, ``WorkerProcess.start`` and ``kill``).
    """
    with contextlib.suppress(TimeoutError):
        client.wait_for_workers(workers, timeout=SUCCESSOR_S)


def existing(address: str, *, wait_s: float = WAIT_S) -> DaskCluster:
    """The cluster of a scheduler at `address`, such as ``tcp://host:8786``; its workers should have one thread each."""

    @contextlib.contextmanager
    def client() -> Iterator[Any]:
        from distributed import Client

        try:
            made = Client(address, timeout=CONNECT_S)
        except (OSError, ValueError) as error:
            raise DataError(f"no Dask scheduler answers at {address} ({error}). Start one: dask scheduler") from None
        with made:
            yield made

    return DaskCluster(f"dask at {address}", 0, client, wait_s=wait_s)


def slurm(workers: int, *, wait_s: float = QUEUE_WAIT_S) -> DaskCluster:
    """A cluster of `workers` SLURM jobs of one core each; queue, account and time from Dask's own configuration.

    Those stand in ``~/.config/dask/jobqueue.yaml`` under ``jobqueue.slurm``, as dask-jobqueue documents.
    """

    @contextlib.contextmanager
    def client() -> Iterator[Any]:
        import dask
        from dask_jobqueue import SLURMCluster
        from distributed import Client

        memory = dask.config.get("jobqueue.slurm.memory", None) or SLURM_MEMORY
        prologue = dask.config.get("jobqueue.slurm.job-script-prologue", None) or []
        single = [f"export {name}=1" for name in THREADS]
        with (
            SLURMCluster(
                cores=1, processes=1, memory=memory, job_script_prologue=[*prologue, *single],
                scheduler_options={"dashboard_address": ANY_PORT},
            ) as cluster,
            Client(cluster) as made,
        ):  # fmt: skip
            cluster.scale(jobs=workers)
            yield made

    return DaskCluster("slurm", workers, client, wait_s=wait_s)


def _prepare(client: Any, job: Job) -> None:
    """Compile once on each machine, and see that all workers are of our kind."""
    hosts: dict[str, str] = {}
    for address in client.nthreads():
        hosts.setdefault(address.rpartition(":")[0], address)
    found = {
        host: client.submit(prepare, tuple(job.first), workers=[address], pure=False, retries=ATTEMPTS)
        for host, address in hosts.items()
    }
    seen = client.run(ready, job.folder)  # loads what cases need meanwhile
    for host, future in found.items():
        theirs = future.result()
        if theirs != version():
            raise ConfigurationError(
                f"the Dask workers at {host} run another version of the model ({theirs}, here {version()}): results "
                "would not compare. Install the same srbval there."
            )
    for address, there in seen.items():
        if not there:
            raise DataError(
                f"the Dask worker at {address} does not see {job.folder}; choose a folder that all machines share."
            )


@contextlib.contextmanager
def _environment() -> Iterator[None]:
    """One thread a library in the processes started meanwhile."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
