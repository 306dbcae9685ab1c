"""Engines by name: worker processes of this machine, or a Dask cluster, running already or of queued jobs.

Each of them calls `run_isolated` for every case.
"""

import contextlib
import functools
import itertools
import logging
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import CancelledError, ThreadPoolExecutor
from dataclasses import dataclass
from importlib import util
from queue import Empty, SimpleQueue
from typing import Any

from srbval.campaign.results import CaseResult, CaseTask
from srbval.campaign.worker import case_process, crashed, run_isolated, this_thread
from srbval.errors import ConfigurationError, DataError, SrbvalError
from srbval.processes.machine import usable_cores
from srbval.processes.worker import without_ctrl_c
from srbval.storage.installation import MissingLibraryError

LOCAL, DASK = "local", "dask"
QUEUES = {  # classes of dask-jobqueue, by the name under which their settings are configured
    name.lower(): f"{name}Cluster" for name in ("SLURM", "PBS", "SGE", "LSF", "HTCondor", "OAR", "Moab")
}
NAMES = (LOCAL, DASK, *QUEUES)
AHEAD = 1000  # cases handed out at a time: enough for any cluster, and few scenes are in memory
CHECK_S = 2.0  # without a result, after which an engine is asked for its workers
JOB_MEMORY = "2 GB"
CONNECT_S = "20 s"
# Dask always serves some pages about itself; here on a port that only this machine reaches.
HIDDEN = {"dashboard_address": "127.0.0.1:0", "dashboard": False}
NO_DASHBOARD = ("--no-dashboard", "--dashboard-address", "127.0.0.1:0")
WAIT_S, QUEUE_WAIT_S = 120.0, 3600.0  # without a worker: those of a scheduler start in seconds, jobs wait in a queue


def results_of(
    submit: Callable[..., Any],
    tasks: Iterable[CaseTask],
    *,
    check: Callable[[], None] = lambda: None,
    lost: tuple[type[Exception], ...] = (),
) -> Generator[CaseResult]:
    """Results as they come; `submit` has `AHEAD` cases at a time and returns a future of `concurrent.futures` or Dask.

    `check` is called if nothing ends for `CHECK_S`. A case that ends with one of the exceptions `lost` has crashed.
    """
    waiting, running, ended = iter(tasks), dict[Any, CaseTask](), SimpleQueue[Any]()
    while True:
        for task in itertools.islice(waiting, AHEAD - len(running)):
            future = submit(run_isolated, task)
            running[future] = task
            future.add_done_callback(ended.put)
        if not running:
            return
        try:
            future = ended.get(timeout=CHECK_S)
        except Empty:
            check()
            continue
        try:
            result = future.result(timeout=CHECK_S)
        except lost:
            result = crashed(running[future], "worker was lost each time it was tried")
        except TimeoutError:  # Dask lost the worker before its result came, and runs the case once more
            ended.put(future)
            check()
            continue
        del running[future]
        yield result


@dataclass
class LocalProcesses:
    """Runs cases in `jobs` processes of this machine."""

    jobs: int
    name: str = LOCAL

    def run(self, tasks: Iterable[CaseTask]) -> Generator[CaseResult]:
        """Results as they come, one per task; a thread waits for each process. Closing the generator ends all.

        Tasks are made as they are asked for, so that ten thousand scenes need not be in memory.
        """
        processes = [case_process() for _ in range(self.jobs)]
        free = list(processes)

        def take_process() -> None:
            this_thread.process = free.pop()

        pool = ThreadPoolExecutor(self.jobs, initializer=take_process)
        try:
            yield from results_of(pool.submit, tasks)
        finally:
            for process in processes:
                process.stop()
            pool.shutdown(cancel_futures=True)
            for process in processes:
                process.close()


@dataclass
class DaskEngine:
    """Runs cases on a Dask cluster; each worker should have one thread.

    `cluster` is the address of a scheduler, such as ``tcp://host:8786``, a cluster object, such as ``LocalCluster`` or
    any class of dask-jobqueue (scaled or adapted by its owner), or a function that returns a context manager of one.
    `wait_s` [s] limits the time without any worker; after that `run` raises `DataError`.
    """

    cluster: Any
    name: str = DASK
    wait_s: float = WAIT_S

    def run(self, tasks: Iterable[CaseTask]) -> Generator[CaseResult]:
        """Results as they come. Dask gives the cases of a lost worker to others."""
        from distributed import KilledWorker

        with self._client() as client:
            check = functools.partial(self._wait_for_worker, client)
            check()
            submit = functools.partial(client.submit, pure=False)
            yield from results_of(submit, tasks, check=check, lost=(KilledWorker,))

    @contextlib.contextmanager
    def _client(self) -> Iterator[Any]:
        """Dask's client; every error of the cluster becomes one `DataError`, and Dask logs nothing on the terminal."""
        from distributed import Client

        before = logging.root.manager.disable
        logging.disable(logging.CRITICAL)
        try:
            with contextlib.ExitStack() as opened:
                cluster = opened.enter_context(self.cluster()) if callable(self.cluster) else self.cluster
                yield opened.enter_context(Client(cluster, timeout=CONNECT_S))
        except Exception as error:  # of the network, of a worker that lacks packages, of Dask's own configuration
            # Closing a cluster whose jobs were refused fails with an error of its own.
            first = (isinstance(error, AssertionError) and error.__context__) or error
            if isinstance(first, SrbvalError):
                raise first from None
            why = "its scheduler is gone" if isinstance(first, CancelledError) else " ".join(str(first).split())
            raise DataError(f"{self.name} failed ({type(first).__name__}: {why}).") from None
        finally:
            logging.disable(before)

    def _wait_for_worker(self, client: Any) -> None:
        """Return if there is a worker, or as soon as there is one; `DataError` if none comes."""
        try:
            client.wait_for_workers(1, timeout=self.wait_s)
        except TimeoutError:
            raise DataError(
                f"no worker of {self.name} for {self.wait_s:g} s. Its own log says why: a full queue (wait "
                "longer with --wait S), jobs that are refused or end at their time limit, or workers that cannot reach "
                "the scheduler."
            ) from None


Engine = LocalProcesses | DaskEngine


@contextlib.contextmanager
def queued_jobs(name: str, workers: int, *, adapt: bool = False) -> Iterator[Any]:
    """Cluster of `workers` jobs of one core each in the batch system `name`.

    Queue, account, time and all else come from Dask's own configuration, ``~/.config/dask/jobqueue.yaml`` under
    ``jobqueue.NAME``, as dask-jobqueue documents. With `adapt`, Dask submits and ends jobs as there is work, `workers`
    at most. No dashboard is served unless that configuration states its address.
    """
    import dask

    with without_ctrl_c():
        import dask_jobqueue
    own = functools.partial(dask.config.get, default=None)
    settings = {
        "memory": own(f"jobqueue.{name}.memory") or JOB_MEMORY,
        "worker_extra_args": [*NO_DASHBOARD, *(own(f"jobqueue.{name}.worker-extra-args") or [])],
        "scheduler_options": HIDDEN | (own(f"jobqueue.{name}.scheduler-options") or {}),
    }
    with getattr(dask_jobqueue, QUEUES[name])(cores=1, processes=1, **settings) as cluster:
        cluster.sync(_submit, cluster, 1 if adapt else workers)
        if adapt:
            cluster.adapt(maximum_jobs=workers)
        yield cluster


async def _submit(cluster: Any, jobs: int) -> None:
    """Submit jobs and wait for that: it raises the errors of the batch system, which Dask would only log."""
    cluster.scale(jobs=jobs)
    await cluster


def choose_engine(
    name: str | None = None,
    *,
    jobs: int | None = None,
    address: str | None = None,
    wait_s: float | None = None,
    adapt: bool = False,
) -> Engine:
    """The engine of that name.

    ``local`` are `jobs` worker processes of this machine, ``dask`` is the cluster of the scheduler at `address`; the
    other names are batch systems, of which `jobs` jobs are asked, with `adapt` at most that many. Without a name it is
    ``dask`` if there is an address, and ``local`` if not. `jobs` is by default one per usable core; `wait_s` limits the
    time without any worker of a cluster [s], by default two minutes, an hour for a batch system.

    Raises `ConfigurationError` for an unknown name, options that do not fit it, or missing packages.
    """
    name = name or (DASK if address else LOCAL)
    if name not in NAMES:
        raise ConfigurationError(f"engine {name!r} is not known. Known: {', '.join(NAMES)}.")
    if (name == DASK) != (address is not None):
        raise ConfigurationError(f"engine {name!r}: --engine dask needs --address, and no other engine has one.")
    if adapt and name not in QUEUES:
        raise ConfigurationError(f"--adapt needs the engine of a batch system ({', '.join(QUEUES)}), not {name!r}.")
    workers = jobs or usable_cores()
    if name == LOCAL:
        return LocalProcesses(workers)
    if util.find_spec("distributed" if name == DASK else "dask_jobqueue") is None:
        raise MissingLibraryError(f"engine {name!r}", "dask[distributed]", "dask-jobqueue")
    if name == DASK:
        return DaskEngine(address, f"dask at {address}", wait_s or WAIT_S)
    return DaskEngine(functools.partial(queued_jobs, name, workers, adapt=adapt), name, wait_s or QUEUE_WAIT_S)
