"""Processes on this machine, each watched by a thread that starts another when it dies.

The standard pools give up all that is under way when one of their processes dies and do not say which case it was.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from typing import Any

from srbval.campaign.engines.engine import ATTEMPTS, Job, Outcome, crashed
from srbval.campaign.task import Task
from srbval.errors import NumericsError
from srbval.storage.own_package import child_environment

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


class LocalProcesses:
    """`workers` processes of one thread each."""

    name = "local"

    def __init__(self, workers: int) -> None:
        self.workers = workers

    def run(self, job: Job) -> Iterator[Outcome]:
        """Outcomes as they come. A case whose process dies is tried again in a new one, `ATTEMPTS` times in all."""
        shift = _Shift(job)
        threads = [
            threading.Thread(target=shift.work, args=(number,), name=f"srbval-worker-{number}", daemon=True)
            for number in range(max(1, min(self.workers, len(job.tasks))))
        ]
        try:
            for thread in threads:
                thread.start()
            for _ in range(len(job.tasks)):
                outcome = shift.outcomes.get()
                if isinstance(outcome, BaseException):
                    raise outcome
                yield outcome
        finally:
            shift.end()
            for thread in threads:
                thread.join()


class _Shift:
    """What the threads share: tasks still to do, outcomes, the processes that run."""

    def __init__(self, job: Job) -> None:
        self._job = job
        self._tasks = iter(job.tasks)
        self._lock = threading.Lock()
        self._running: set[Worker] = set()
        self._prepared = threading.Event()
        self._over = False
        self.outcomes: queue.Queue[Outcome | BaseException] = queue.Queue()

    def work(self, number: int) -> None:
        """A thread's life: keep one process busy; the first one compiles while the others wait."""
        try:
            worker = self._start()
            if number == 0:
                worker = self._prepare(worker)
                self._prepared.set()
            self._prepared.wait()
            while (task := self._next()) is not None:
                worker = self._run(worker, task)
            worker.close()
        except _OverError:
            return
        except BaseException as error:
            self.outcomes.put(error)
        finally:
            self._prepared.set()  # the others must not wait for what will never be

    def end(self) -> None:
        """Kill what still runs."""
        with self._lock:
            self._over = True
            for worker in self._running:
                worker.kill()

    def _next(self) -> Task | None:
        with self._lock:
            return None if self._over else next(self._tasks, None)

    def _start(self) -> Worker:
        with self._lock:
            if self._over:
                raise _OverError
            worker = Worker()
            self._running.add(worker)
            return worker

    def _replace(self, worker: Worker) -> Worker:
        worker.close()
        with self._lock:
            self._running.discard(worker)
        return self._start()

    def _prepare(self, worker: Worker) -> Worker:
        for _ in range(ATTEMPTS):
            try:
                worker.ask(("prepare", tuple(self._job.first)))
                return worker
            except EOFError:
                how = worker.death()
                worker = self._replace(worker)
        raise NumericsError(f"a worker process died {ATTEMPTS} times while compiling ({how}). See: srbval doctor")

    def _run(self, worker: Worker, task: Task) -> Worker:
        for attempt in range(ATTEMPTS):
            self._job.begun(task.key)
            try:
                self.outcomes.put(worker.ask(("run", task)))
                return worker
            except EOFError:
                how = worker.death()
                worker = self._replace(worker)
                if attempt + 1 == ATTEMPTS:
                    self.outcomes.put(crashed(task.key, how))
        return worker


class Worker:
    """A process that answers one request at a time; it ends when its input does, so it never outlives this one."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "srbval.campaign.engines.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | dict.fromkeys(THREADS, "1") | child_environment(),
        )

    def ask(self, request: tuple[str, Any]) -> Any:
        """The answer to a request; `EOFError` where the process died over it."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            pickle.dump(request, self._process.stdin)
            self._process.stdin.flush()
            return pickle.load(self._process.stdout)
        except (OSError, EOFError, pickle.UnpicklingError):
            raise EOFError from None

    def death(self) -> str:
        """How the process ended, in words."""
        code = self._process.wait()
        with contextlib.suppress(ValueError):
            return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        return f"exit code {code}"

    def kill(self) -> None:
        """End it now."""
        self._process.kill()

    def close(self) -> None:
        """Let it end and wait for that."""
        for stream in (self._process.stdin, self._process.stdout):
            with contextlib.suppress(OSError):
                if stream is not None:
                    stream.close()
        self._process.wait()


class _OverError(Exception):
    """The campaign ended meanwhile."""
