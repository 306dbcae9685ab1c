"""Worker processes of this machine, which run cases; Dask's workers run their cases in such processes too.

A thread waits for each process and starts another one if it dies. The standard pools of processes, and the pool of
pebble, give up everything that is running if one dies at the wrong moment.
"""

import itertools
import threading
from collections.abc import Generator, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path

from srbval.campaign.results import CaseResult, CaseTask, Ending, final_result
from srbval.errors import DataError, NumericsError
from srbval.processes.worker import DiedError, OverLimitError, WorkerProcess
from srbval.scene import Scene

AHEAD = 2  # cases handed out per process: none waits for the next case, and few scenes are in memory
ATTEMPTS = 3  # per case whose process dies: the system may have killed it because of another process's memory
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
PREPARE_LIMIT_S = 1800.0  # to load and compile everything, which takes a minute or two
KEPT = "Results received so far are kept; the same command resumes from there."
WORKER = "srbval.campaign.worker"


@dataclass(frozen=True, kw_only=True)
class Job:
    """The work of an engine: compile for the scenes `precompiled`, then run the `count` `tasks` in order.

    `tasks` are made as they are asked for, so that ten thousand scenes need not be in memory; `folder` is the folder
    of the campaign.
    """

    folder: Path
    precompiled: Sequence[Scene]
    tasks: Iterable[CaseTask]
    count: int


class CaseProcess:
    """A process of one thread that runs cases and is replaced if it dies or exceeds a time limit.

    It compiles or loads `scenes` before its first case. `prepare` and `run` raise `CancelledError` after `stop`,
    `OSError` if the system starts no process, and `NumericsError` if processes die or hang while they compile.
    """

    def __init__(self, scenes: Sequence[Scene]) -> None:
        self.scenes, self._lock, self._stopped = tuple(scenes), threading.Lock(), False
        self._process: WorkerProcess | None = None
        self._version = ""  # of the code that the process runs

    def prepare(self) -> str:
        """Start and compile unless done; returns the version of the code."""
        return self._ready()[1]

    def run(self, task: CaseTask) -> CaseResult:
        """Run a case, up to `ATTEMPTS` times if its process dies."""
        for _ in range(ATTEMPTS):
            process, _version = self._ready()
            try:
                result: CaseResult = process.call(("run", task), limit_s=task.limit_s)
                return result
            except DiedError as error:
                how = self._end(process)
                if (found := final_result(task.path)) is not None:  # written, but too late in being announced
                    return found
                if isinstance(error, OverLimitError):
                    reason = (
                        f"it took longer than its limit of {task.limit_s:.6g} s, so its process was ended; the other "
                        "cases were run. If it only needs longer: --limit-factor, --least-limit, or limit_factor and "
                        "least_limit in the campaign file"
                    )
                    return CaseResult(key=task.key, ending=Ending.TIMED_OUT, reason=reason)
        return crashed(task.key, f"process died {ATTEMPTS} times ({how})")

    def stop(self) -> None:
        """Kill the process and start no other."""
        with self._lock:
            self._stopped = True
            if self._process is not None:
                self._process.kill()

    def close(self) -> None:
        """Let the process end."""
        if self._process is not None:
            self._process.close()
            self._process = None

    __del__ = close  # with the thread of a Dask worker

    def _ready(self) -> tuple[WorkerProcess, str]:
        """The process that has compiled, and its version; a new one unless there is one."""
        for _ in range(ATTEMPTS):
            with self._lock:
                if self._stopped:
                    raise CancelledError
                if self._process is not None:
                    return self._process, self._version
                process = self._process = WorkerProcess(WORKER, environment=dict.fromkeys(THREADS, "1"))
            try:
                self._version = process.call(("prepare", self.scenes), limit_s=PREPARE_LIMIT_S)
                return process, self._version
            except OverLimitError:
                raise NumericsError(
                    f"a worker process did not compile what it needs within {PREPARE_LIMIT_S:g} s. See: srbval doctor"
                ) from None
            except DiedError:
                how = self._end(process)
        raise NumericsError(f"a worker process died {ATTEMPTS} times while compiling ({how}). See: srbval doctor")

    def _end(self, process: WorkerProcess) -> str:
        """Close the dead process; returns how it ended."""
        how = process.death()
        self.close()
        return how


def crashed(key: str, how: str) -> CaseResult:
    """The result of a case whose process died each time it was tried; `how` completes "its ..."."""
    return CaseResult(key=key, ending=Ending.CRASHED, reason=f"its {how}; the other cases were run without it")


class LocalProcesses:
    """`workers` processes of one thread each."""

    def __init__(self, workers: int, *, name: str = "local") -> None:
        self.workers, self.name = workers, name

    def run(self, job: Job) -> Generator[CaseResult]:
        """Results as they come. A case whose process dies is tried again in a new one, `ATTEMPTS` times in all."""
        processes = [CaseProcess(job.precompiled) for _ in range(min(self.workers, job.count))]
        free = list(processes)  # as many as there are threads

        def run_one(task: CaseTask) -> CaseResult:
            process = free.pop()
            try:
                return process.run(task)
            finally:
                free.append(process)

        pool, tasks = ThreadPoolExecutor(len(processes)), iter(job.tasks)
        try:
            running = {pool.submit(run_one, task) for task in itertools.islice(tasks, AHEAD * len(processes))}
            while running:
                ended, running = wait(running, return_when=FIRST_COMPLETED)
                running |= {pool.submit(run_one, task) for task in itertools.islice(tasks, len(ended))}
                for future in ended:
                    yield future.result()
        except (OSError, RuntimeError, MemoryError) as error:  # no process or thread more
            text = f"the operating system refused to start a process ({error}). {KEPT} Use fewer --jobs."
            raise DataError(text) from None
        finally:
            for process in processes:
                process.stop()
            pool.shutdown(cancel_futures=True)
            for process in processes:
                process.close()
