"""A process that runs cases and is replaced when it dies or takes too long; every engine uses it."""

import threading
from collections.abc import Sequence

from srbval.campaign.case import CaseOutcome, CaseTask
from srbval.campaign.engines.engine import ATTEMPTS, crashed, timed_out
from srbval.errors import NumericsError
from srbval.processes.worker import DiedError, OverLimitError, WorkerProcess
from srbval.scene import Scene

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
PREPARE_LIMIT_S = 1800.0  # to load and compile everything, which takes a minute or two


class StoppedError(Exception):
    """Another thread has stopped this process for good."""


class CaseProcess:
    """One process of one thread, which compiles or loads `scenes` before its first case; its limits are kept from here.

    All methods raise `StoppedError` after `stop`, and `OSError` where the system starts no process.
    """

    def __init__(self, scenes: Sequence[Scene]) -> None:
        self.scenes = tuple(scenes)
        self._lock = threading.Lock()
        self._process: WorkerProcess | None = None
        self._version = ""  # of the code that the process runs
        self._stopped = False

    def prepare(self) -> str:
        """Start and compile unless that is done; the version of the code. `NumericsError` if it dies or hangs."""
        for _ in range(ATTEMPTS):
            try:
                return self._prepared()[1]
            except DiedError:
                how = self._end()
        raise NumericsError(f"a worker process died {ATTEMPTS} times while compiling ({how}). See: srbval doctor")

    def run(self, task: CaseTask) -> CaseOutcome:
        """Run a case, up to `ATTEMPTS` times if its process dies."""
        for _ in range(ATTEMPTS):
            try:
                outcome: CaseOutcome = self._prepared()[0].call(("run", task), limit_s=task.limit_s)
                return outcome
            except DiedError as error:
                how = self._end()
                # A result that is there was only too late in being announced: the next process reads it.
                if isinstance(error, OverLimitError) and not task.path.exists():
                    return timed_out(task)
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

    def _prepared(self) -> tuple[WorkerProcess, str]:
        with self._lock:
            if self._stopped:
                raise StoppedError
            if self._process is not None:
                return self._process, self._version
            process = self._process = WorkerProcess(
                "srbval.campaign.engines.worker", environment=dict.fromkeys(THREADS, "1")
            )
        try:
            self._version = process.call(("prepare", self.scenes), limit_s=PREPARE_LIMIT_S)
        except OverLimitError:
            raise NumericsError(
                f"a worker process did not compile what it needs within {PREPARE_LIMIT_S:g} s. See: srbval doctor"
            ) from None
        return process, self._version

    def _end(self) -> str:
        """How the process ended."""
        how = self._process.death() if self._process is not None else ""
        self.close()
        return how
