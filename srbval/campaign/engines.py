"""Engines that run the cases of a campaign: in worker processes of this machine, or on a Dask cluster."""

import contextlib
import functools
import itertools
import logging
import os
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from concurrent.futures import CancelledError, ThreadPoolExecutor
from multiprocessing import resource_tracker
from queue import Empty, SimpleQueue
from typing import Any, NamedTuple

from srbval.campaign.results import CRASHED, CaseResult, CaseTask
from srbval.campaign.worker import case_process, run_isolated, this_thread, write_failure
from srbval.errors import ConfigurationError, DataError, SrbvalError
from srbval.processes.machine import usable_cores
from srbval.processes.worker import without_ctrl_c
from srbval.storage.installation import import_library

LOCAL, DASK = "local", "dask"
MAX_SUBMITTED_CASES = 1000  # enough for any cluster, and few enough to keep the scenes in memory
WORKER_CHECK_S = 2.0  # time without a result after which `check` is called
JOB_MEMORY = "2 GB"
CONNECT_S = "20 s"
# Dask always serves status pages; here on a port that only this machine can reach.
HIDDEN = {"dashboard_address": "127.0.0.1:0", "dashboard": False}
NO_DASHBOARD = ("--no-dashboard", "--dashboard-address", "127.0.0.1:0")
WAIT_S, QUEUE_WAIT_S = 120.0, 3600.0  # longest time without a worker: of a scheduler; of jobs in a queue


def run_tasks(
    submit: Callable[..., Any],
    tasks: Iterable[CaseTask],
    *,
    check: Callable[[], None] = lambda: None,
    lost: tuple[type[Exception], ...] = (),
) -> Generator[CaseResult]:
    """Submit the `tasks`, at most `MAX_SUBMITTED_CASES` at a time, and yield each result when its case has ended.

    `submit` returns a future of `concurrent.futures` or Dask. If no case ends for `WORKER_CHECK_S` [s], `check` is
    called; for Dask it raises an error if the cluster has no worker. The exceptions `lost` mean that the worker was
    lost: if a future raises one of them, its case gets the status ``crashed``.
    """
    waiting, running, ended = iter(tasks), dict[Any, CaseTask](), SimpleQueue[Any]()
    while True:
        for task in itertools.islice(waiting, MAX_SUBMITTED_CASES - len(running)):
            future = submit(run_isolated, task)
            running[future] = task
            future.add_done_callback(ended.put)
        if not running:
            return
        future = None
        try:
            future = ended.get(timeout=WORKER_CHECK_S)
            result = future.result(timeout=WORKER_CHECK_S)
        except lost:
            reason = "its worker was lost each time it was tried; the other cases were run"
            result = write_failure(running[future], CRASHED, reason)
        except (Empty, TimeoutError):
            if future is not None:  # Dask lost the worker before the result arrived, and repeats the case
                ended.put(future)
            check()
            continue
        del running[future]
        yield result


class Engine(NamedTuple):
    """Engine of a campaign: ``run(tasks)`` returns a generator of results; closing it ends the cases that still run."""

    name: str
    run: Callable[[Iterable[CaseTask]], Generator[CaseResult]]


def run_in_processes(jobs: int, tasks: Iterable[CaseTask]) -> Generator[CaseResult]:
    """Run cases in `jobs` processes of this machine and yield the results; closing the generator ends the processes."""
    processes = [case_process() for _ in range(jobs)]
    free = iter(processes)
    pool = ThreadPoolExecutor(jobs, initializer=lambda: setattr(this_thread, "process", next(free)))
    try:
        yield from run_tasks(pool.submit, tasks)
    finally:
        for process in processes:
            process.stop()
        pool.shutdown(cancel_futures=True)
        for process in processes:
            process.close()


def run_on_dask(cluster: Any, cluster_name: str, wait_s: float, tasks: Iterable[CaseTask]) -> Generator[CaseResult]:
    """Run cases on a Dask cluster, one at a time in each thread of a worker, and yield their results.

    `cluster` is a running cluster, as in `choose_engine`, or a function that returns a context manager of a cluster.
    Raises `DataError` with `cluster_name` if it has no worker for `wait_s` [s], or for another error of the cluster.
    Dask repeats a lost worker's cases; its log is suppressed.
    """
    from distributed import Client, KilledWorker

    def check() -> None:
        try:
            client.wait_for_workers(1, timeout=wait_s)
        except TimeoutError:
            raise DataError(
                f"no worker of {cluster_name} for {wait_s:g} s. See the cluster's log: the queue may be full (wait "
                "longer with --wait S), jobs may be refused or exceed their time limit, or workers may not reach the "
                "scheduler."
            ) from None

    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        with contextlib.ExitStack() as opened:
            made = opened.enter_context(cluster()) if callable(cluster) else cluster
            client = made if isinstance(made, Client) else opened.enter_context(Client(made, timeout=CONNECT_S))
            check()
            submit = functools.partial(client.submit, pure=False)
            yield from run_tasks(submit, tasks, check=check, lost=(KilledWorker,))
    except Exception as error:  # network, missing packages on a worker, Dask's configuration
        # Closing a cluster whose jobs were refused raises another error.
        first = (isinstance(error, AssertionError) and error.__context__) or error
        if isinstance(first, SrbvalError):
            raise first from None
        why = "its scheduler has ended" if isinstance(first, CancelledError) else " ".join(str(first).split())
        raise DataError(f"{cluster_name} failed ({type(first).__name__}: {why}).") from None
    finally:
        logging.disable(before)


@contextlib.contextmanager
def start_cluster(kind: type, workers: int, options: Mapping[str, Any], *, adapt: bool = False) -> Iterator[Any]:
    """Start a Dask cluster of class `kind` with `workers` workers, and end it on exit.

    If `kind` submits batch jobs, each worker is a job with one core, which runs one case at a time; the option `cores`
    sets another number of both. Queue, account and time limit come from the options or from Dask's configuration,
    ``~/.config/dask/jobqueue.yaml``, as dask-jobqueue documents. With `adapt`, Dask starts and ends workers as needed,
    at most `workers`. Dask's web dashboard is off unless the options or the configuration contain its address.
    """
    import dask

    settings: dict[str, Any] = {}
    if job := getattr(kind, "job_cls", None):
        names = ("memory", "worker_extra_args", "scheduler_options")
        own = {name: options.get(name) or dask.config.get(f"jobqueue.{job.config_name}.{name}", None) for name in names}
        settings = {"cores": 1, "processes": 1, "memory": own["memory"] or JOB_MEMORY, **options}
        settings["worker_extra_args"] = [*NO_DASHBOARD, *(own["worker_extra_args"] or ())]
        settings["scheduler_options"] = HIDDEN | (own["scheduler_options"] or {})
    elif kind.__name__ == "LocalCluster":
        if hasattr(os, "fork"):
            resource_tracker.ensure_running()  # a tracker started by a worker would pass Ctrl-C on to the workers
        settings = {"n_workers": workers, "threads_per_worker": 1, "silence_logs": "CRITICAL"}
        settings |= {"dashboard_address": HIDDEN["dashboard_address"], **options}
    with without_ctrl_c():
        made = kind(**{**options, **settings})
    with made as cluster:
        try:
            cluster.sync(_scale, cluster, 1 if adapt else workers)
        except Exception:
            cluster.shutdown_on_close = False  # closing it fails; when the program ends, Dask would try again for 10 s
            raise
        if adapt:
            cluster.adapt(minimum=1, maximum=workers)
        yield cluster


async def _scale(cluster: Any, workers: int) -> None:
    """Request `workers` workers and wait for the answer: errors of a batch system are raised, not only logged."""
    cluster.scale(workers)
    await cluster


def choose_engine(
    engine: Any = LOCAL,
    *,
    jobs: int | None = None,
    cluster_options: Mapping[str, Any] | None = None,
    wait_s: float | None = None,
    adapt: bool = False,
) -> Engine:
    """Create an engine that runs the cases of a campaign.

    ``local`` runs them in `jobs` processes of this machine. A `Client` of Dask, a cluster object, or the address of a
    scheduler, such as ``tcp://host:8786``, is a cluster that runs already. ``dask`` starts a ``LocalCluster`` of `jobs`
    workers, and the name of a class, such as ``dask_jobqueue.PBSCluster``, starts such a cluster; `cluster_options` are
    options of the class, and with `adapt` the number of workers follows the work, at most `jobs` (default: one per
    usable core). `wait_s` limits the time without any worker [s], by default two minutes, or an hour for a named class.

    Raises `ConfigurationError` for an unknown name, options that the engine does not use, or missing packages.
    """
    title, workers, queued = str(engine), jobs or usable_cores(), engine not in (LOCAL, DASK)
    running = not isinstance(engine, str) or "://" in engine
    if (engine == LOCAL or running) and (cluster_options or adapt):
        raise ConfigurationError(
            f"engine {title!r} with --cluster-option or --adapt: these two are for a cluster that srbval starts, by "
            "--engine dask or --cluster-class."
        )
    if engine == LOCAL:
        return Engine(LOCAL, functools.partial(run_in_processes, workers))
    if running:
        title, cluster = f"{DASK} at {title}" if isinstance(engine, str) else DASK, engine
    else:
        kind = _dask_class(engine if queued else "distributed.LocalCluster")
        title = f"{DASK} {kind.__name__}"
        cluster = functools.partial(start_cluster, kind, workers, cluster_options or {}, adapt=adapt)
    wait_s = wait_s or (QUEUE_WAIT_S if queued and not running else WAIT_S)
    return Engine(title, functools.partial(run_on_dask, cluster, title, wait_s))


def _dask_class(path: str) -> type:
    """Import the Dask cluster class with the dotted name `path`; raises `ConfigurationError` if it is no such class."""
    module, _, name = path.rpartition(".")
    packages = ("dask[distributed]", "dask-jobqueue")
    with without_ctrl_c():
        found = getattr(import_library(module or "distributed", f"cluster class {path!r}", *packages), name, None)
    if not (isinstance(found, type) and hasattr(found, "scale")):
        raise ConfigurationError(f"{path!r} is not a class of Dask clusters, such as dask_jobqueue.SLURMCluster.")
    return found
