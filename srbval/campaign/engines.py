"""Engines by name: worker processes of this machine, or a Dask cluster, running already or of queued jobs."""

import contextlib
import itertools
import logging
import platform
import threading
import time
from collections.abc import Callable, Collection, Generator, Iterator
from concurrent.futures import CancelledError
from contextlib import AbstractContextManager
from importlib import util
from pathlib import Path
from typing import Any, Protocol

from srbval.campaign.local import AHEAD, KEPT, THREADS, CaseProcess, Job, LocalProcesses, crashed
from srbval.campaign.results import CaseResult, CaseTask
from srbval.campaign.worker import version
from srbval.errors import ConfigurationError, DataError, SrbvalError
from srbval.processes.machine import usable_cores
from srbval.processes.worker import without_ctrl_c
from srbval.scene import Scene
from srbval.storage.installation import MissingLibraryError

AUTO, SERIAL, LOCAL, DASK = "auto", "serial", "local", "dask"
QUEUES = {  # classes of dask-jobqueue, by the name under which their settings are configured
    name.lower(): f"{name}Cluster" for name in ("SLURM", "PBS", "SGE", "LSF", "HTCondor", "OAR", "Moab")
}
NAMES = (AUTO, SERIAL, LOCAL, DASK, *QUEUES)
JOB_MEMORY = "2 GB"
CONNECT_S = "20 s"
# Dask always serves some pages about itself; here on a port that only this machine reaches.
HIDDEN = {"dashboard_address": "127.0.0.1:0", "dashboard": False}
NO_DASHBOARD = ("--no-dashboard", "--dashboard-address", "127.0.0.1:0")
WAIT_S, QUEUE_WAIT_S = 120.0, 3600.0  # without a worker: those of a scheduler start in seconds, jobs wait in a queue
CHECKS = 8  # how often the number of workers is checked within the longest time without a worker
_local = threading.local()  # the process of each thread of a Dask worker


class Engine(Protocol):
    """Runs cases somewhere."""

    name: str
    workers: int

    def run(self, job: Job) -> Generator[CaseResult]:
        """Results as they come, one per task. Closing the generator ends everything that still runs."""
        ...


class DaskEngine:
    """Runs cases on a Dask cluster; each worker should have one thread.

    `cluster` is the address of a scheduler, such as ``tcp://host:8786``, a cluster object, such as ``LocalCluster`` or
    any class of dask-jobqueue (scaled or adapted by its owner), or a function that starts one and
    returns a context manager of its client.
    `workers` is the number of jobs asked for, 0 if unknown. `wait_s` [s] limits the time without any worker; after that
    `run` raises `DataError`.
    """

    def __init__(self, cluster: Any, *, name: str = DASK, workers: int = 0, wait_s: float = WAIT_S) -> None:
        self.name, self.workers = name, workers
        self._cluster, self._wait_s = cluster, wait_s

    def run(self, job: Job) -> Generator[CaseResult]:
        """Results as they come; the scheduler has only a few cases per worker at a time."""
        from distributed import KilledWorker

        with _one_error(self.name), self._client() as client:
            with contextlib.suppress(TimeoutError):
                client.wait_for_workers(1, timeout=self._wait_s)  # raises the errors of a batch system
            if not client.nthreads():
                raise self._no_worker()
            waiting, scenes = iter(job.tasks), tuple(job.precompiled)
            submitted: dict[Any, CaseTask] = {}
            while True:
                room = AHEAD * max(1, self.workers, sum(client.nthreads().values())) - len(submitted)
                for task in itertools.islice(waiting, max(0, room)):
                    name = f"srbval-{task.key}"
                    future = client.submit(run_on_worker, task, job.folder, version(), scenes, key=name, pure=False)
                    submitted[future] = task
                if not submitted:
                    return
                for future in self._ended(client, list(submitted)):
                    try:
                        yield future.result(timeout=self._wait_s / CHECKS)
                    except TimeoutError:
                        if future.status == "error":
                            raise
                        continue  # the worker was lost with the result: Dask runs the case again
                    except KilledWorker:
                        yield crashed(submitted[future].key, f"{self.name} worker was lost each time it was tried")
                    del submitted[future]

    @contextlib.contextmanager
    def _client(self) -> Iterator[Any]:
        from distributed import Client

        if callable(self._cluster):
            with self._cluster() as client:
                yield client
            return
        try:
            client = Client(self._cluster, timeout=CONNECT_S)
        except (OSError, ValueError) as error:
            raise DataError(
                f"no Dask scheduler answers at {self._cluster} ({error}). Start one: dask scheduler"
            ) from None
        with client:
            yield client

    def _ended(self, client: Any, futures: Collection[Any]) -> Collection[Any]:
        """Return the `futures` that have ended, at least one; `DataError` if no worker comes."""
        from distributed import wait

        seen = time.monotonic()
        while True:
            try:
                return wait(futures, timeout=self._wait_s / CHECKS, return_when="FIRST_COMPLETED").done
            except TimeoutError:
                if client.nthreads():
                    seen = time.monotonic()
                elif time.monotonic() - seen > self._wait_s:
                    raise self._no_worker() from None
            except CancelledError:
                raise DataError(f"the scheduler of {self.name} is gone. {KEPT}") from None

    def _no_worker(self) -> DataError:
        return DataError(
            f"no worker of {self.name} for {self._wait_s:g} s. {KEPT} Its own log says why: a full queue (wait longer "
            "with --wait S), jobs that are refused or end at their time limit, or workers that cannot reach the "
            "scheduler."
        )


@contextlib.contextmanager
def _one_error(name: str) -> Iterator[None]:
    """Turn every error of a cluster into one `DataError`, and keep Dask's log of it from the terminal."""
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


def queued_jobs(name: str, workers: int, *, adapt: bool = False) -> Callable[[], AbstractContextManager[Any]]:
    """A function that starts `workers` jobs of one core each in the batch system `name`; it yields Dask's client.

    Queue, account, time and all else come from Dask's own configuration, ``~/.config/dask/jobqueue.yaml`` under
    ``jobqueue.NAME``, as dask-jobqueue documents. With `adapt`, Dask submits and ends jobs as there is work, `workers`
    at most. No dashboard is served unless that configuration states its address.
    """

    @contextlib.contextmanager
    def start() -> Iterator[Any]:
        import dask
        from distributed import Client

        with without_ctrl_c():
            import dask_jobqueue
        own = dask.config.get(f"jobqueue.{name}", {})
        one_thread = [f"export {variable}=1" for variable in THREADS]
        settings = {
            "memory": own.get("memory") or JOB_MEMORY,
            "job_script_prologue": [*(own.get("job-script-prologue") or []), *one_thread],
            "worker_extra_args": [*NO_DASHBOARD, *(own.get("worker-extra-args") or [])],
            "scheduler_options": HIDDEN | (own.get("scheduler-options") or {}),
        }
        make = getattr(dask_jobqueue, QUEUES[name])
        with make(cores=1, processes=1, **settings) as cluster, Client(cluster) as client:
            if adapt:
                cluster.adapt(maximum_jobs=workers)
            else:
                cluster.scale(jobs=workers)
            yield client

    return start


def run_on_worker(task: CaseTask, folder: Path, expected: str, scenes: tuple[Scene, ...]) -> CaseResult:
    """Run a case on a Dask worker, in a process of its own: one that dies or hangs takes no Dask worker with it.

    Raises `ConfigurationError` if the code of this worker is not of the version `expected`, `DataError` if the worker
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


def choose_engine(
    name: str = AUTO,
    *,
    jobs: int | None = None,
    address: str | None = None,
    wait_s: float | None = None,
    adapt: bool = False,
) -> Engine:
    """The engine of that name.

    ``serial`` is one worker process of this machine, ``local`` are `jobs` of them, ``dask`` is the cluster of the
    scheduler at `address`; the other names are batch systems, of which `jobs` jobs are asked, with `adapt` at most that
    many. ``auto`` and ``dask`` are ``local`` without an `address`. `jobs` is by default one per usable core; `wait_s`
    limits the time without any worker of a cluster [s], by default two minutes, an hour for a batch system.

    Raises `ConfigurationError` for an unknown name, options that do not fit it, or missing packages.
    """
    if name not in NAMES:
        raise ConfigurationError(f"engine {name!r} is not known. Known: {', '.join(NAMES)}.")
    if jobs is not None and jobs < 1:
        raise ConfigurationError(f"--jobs {jobs} must be at least 1.")
    if address is not None and name not in (AUTO, DASK):
        raise ConfigurationError(f"a scheduler's address needs --engine dask, not {name!r}.")
    if adapt and name not in QUEUES:
        raise ConfigurationError(f"--adapt needs the engine of a batch system ({', '.join(QUEUES)}), not {name!r}.")
    workers = jobs or usable_cores()
    if address is None and name not in QUEUES:
        return LocalProcesses(1, name=SERIAL) if name == SERIAL else LocalProcesses(workers)
    package = "distributed" if address is not None else "dask_jobqueue"
    if util.find_spec(package) is None:
        raise MissingLibraryError(f"engine {DASK if address else name!r}", "dask[distributed]", "dask-jobqueue")
    if address is not None:
        return DaskEngine(address, name=f"dask at {address}", wait_s=wait_s or WAIT_S)
    start = queued_jobs(name, workers, adapt=adapt)
    return DaskEngine(start, name=name, workers=workers, wait_s=wait_s or QUEUE_WAIT_S)
