"""Dask clusters: one that runs already, or one whose workers are SLURM jobs."""

import contextlib
import itertools
import threading
import time
from collections.abc import Callable, Collection, Generator, Iterator
from concurrent.futures import CancelledError
from typing import Any

from srbval.campaign.case import CaseOutcome, CaseTask, version
from srbval.campaign.engines.engine import ATTEMPTS, Job, crashed
from srbval.campaign.engines.local import THREADS
from srbval.campaign.work import load_modules, prepare, run_within_limit
from srbval.errors import ConfigurationError, DataError

AHEAD = 2  # cases with the scheduler per worker: none waits for the next one, and the scheduler holds few
SLURM_MEMORY = "2 GB"
CONNECT_S = "20 s"
ANY_PORT = ":0"  # of the scheduler's web page: two campaigns may run on one machine
# For the first worker: a running scheduler's workers start in seconds, jobs may stand in a queue.
WAIT_S, QUEUE_WAIT_S = 120.0, 3600.0
CHECKS = 8  # how often the number of workers is checked within the time that a cluster may have none


class DaskCluster:
    """Cases on a Dask cluster. `make_client` is a context manager that yields a client; see the functions below.

    `wait_s`: how long to wait for the first worker, and for another one when all are lost [s]; after that `run` raises
    `DataError`.
    """

    def __init__(self, name: str, workers: int, make_client: Callable[[], Any], *, wait_s: float = WAIT_S) -> None:
        self.name, self.workers = name, workers
        self._make_client, self._wait_s = make_client, wait_s

    def run(self, job: Job) -> Generator[CaseOutcome]:
        """Outcomes as they come; never more than a few cases per worker are with the scheduler."""
        with contextlib.ExitStack() as stack:
            client = stack.enter_context(self._make_client())
            self._wait_for_a_worker(client)
            _prepare(client, job)
            submitted = _Submitted(client)
            stack.enter_context(cancelled_without_workers(client, submitted.futures, wait_s=self._wait_s))
            try:
                yield from submitted.run_all(job)
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


class _Submitted:
    """The cases that are with the scheduler."""

    def __init__(self, client: Any) -> None:
        self._client = client
        self._tasks: dict[str, tuple[Any, CaseTask]] = {}

    def futures(self) -> list[Any]:
        """The futures of all these cases."""
        return [future for future, _ in list(self._tasks.values())]

    def run_all(self, job: Job) -> Iterator[CaseOutcome]:
        """Outcomes of all cases of the job; `CancelledError` where their futures were cancelled."""
        from distributed import KilledWorker, as_completed

        waiting, completed, blamed = iter(job.tasks), as_completed(), []

        def submit_more() -> None:
            room = max(2, AHEAD * sum(self._client.nthreads().values())) - len(self._tasks)
            for task in itertools.islice(waiting, max(0, room)):
                job.started(task.key)
                completed.add(self._submit(task, ""))

        submit_more()
        for future in completed:
            task = self._tasks[future.key][1]
            try:
                yield future.result()
            except KilledWorker:
                blamed.append(task)
            del self._tasks[future.key]
            future.release()
            submit_more()
        # Dask blames all cases that a lost worker held: run one at a time, a case shows whether it was the cause.
        for task in blamed:
            try:
                yield self._submit(task, "-alone").result()
            except KilledWorker:
                yield crashed(task.key, "Dask worker was lost each time it was tried, with no other case on it")

    def _submit(self, task: CaseTask, suffix: str) -> Any:
        key = f"srbval-{task.key}{suffix}"
        future = self._client.submit(run_within_limit, task, key=key, pure=False, retries=0)
        self._tasks[future.key] = future, task
        return future


@contextlib.contextmanager
def cancelled_without_workers(client: Any, futures: Callable[[], Collection[Any]], *, wait_s: float) -> Iterator[None]:
    """Cancel `futures` once the cluster of `client` has had no worker for `wait_s` [s]: their results then raise.

    A client would wait for ever for another worker.
    """
    ended = threading.Event()

    def watch() -> None:
        seen = time.monotonic()
        while not ended.wait(wait_s / CHECKS):
            if client.nthreads():
                seen = time.monotonic()
            elif time.monotonic() - seen > wait_s:
                client.cancel(list(futures()), force=True)
                return

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


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


def slurm_cluster(workers: int, *, wait_s: float = QUEUE_WAIT_S) -> DaskCluster:
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
        one_thread = [f"export {name}=1" for name in THREADS]
        with (
            SLURMCluster(
                cores=1, processes=1, memory=memory, job_script_prologue=[*prologue, *one_thread],
                scheduler_options={"dashboard_address": ANY_PORT},
            ) as cluster,
            Client(cluster) as connected,
        ):  # fmt: skip
            cluster.scale(jobs=workers)
            yield connected

    return DaskCluster("slurm", workers, client, wait_s=wait_s)


def _prepare(client: Any, job: Job) -> None:
    """Compile once on each machine, and check that all workers run this version and see the campaign's folder."""
    hosts: dict[str, str] = {}
    for address in client.nthreads():
        hosts.setdefault(address.rpartition(":")[0], address)
    versions = {
        host: client.submit(prepare, tuple(job.precompiled), workers=[address], pure=False, retries=ATTEMPTS)
        for host, address in hosts.items()
    }
    visible = client.run(load_modules, job.folder)
    for host, future in versions.items():
        if (theirs := future.result()) != version():
            raise ConfigurationError(
                f"the Dask workers at {host} run another version of the model ({theirs}, here {version()}): results "
                "would not compare. Install the same srbval there."
            )
    for address, sees_folder in visible.items():
        if not sees_folder:
            raise DataError(
                f"the Dask worker at {address} does not see {job.folder}; choose a folder that all machines share."
            )
