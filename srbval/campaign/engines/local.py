"""Engines of this machine: one case after the other in this process, or several worker processes.

Each worker process has a thread here that starts another when it dies. The standard pools, and pebble's too, give up
everything that is running when a process dies at the wrong moment; the standard ones do not say whose case it was.
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
from collections.abc import Generator
from dataclasses import replace
from typing import Any

from srbval.campaign.case import CaseOutcome, CaseTask
from srbval.campaign.engines.engine import ATTEMPTS, Job, crashed
from srbval.campaign.work import prepare, run_case
from srbval.errors import NumericsError
from srbval.storage.own_package import child_environment

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


class Serial:
    """In this process; cases that were running when the campaign was last killed run last, in another process."""

    name = "serial"
    workers = 1

    def run(self, job: Job) -> Generator[CaseOutcome]:
        """Outcomes in the order of the tasks, suspects last."""
        prepare(job.precompiled)
        suspected = []
        for task in job.tasks:
            if task.key in job.suspects:
                suspected.append(task)
                continue
            job.started(task.key)
            yield run_case(task)
        if suspected:
            yield from LocalProcesses(1).run(replace(job, precompiled=(), tasks=suspected, count=len(suspected)))


class LocalProcesses:
    """`workers` processes of one thread each."""

    name = "local"

    def __init__(self, workers: int) -> None:
        self.workers = workers

    def run(self, job: Job) -> Generator[CaseOutcome]:
        """Outcomes as they come. A case whose process dies is tried again in a new one, `ATTEMPTS` times in all."""
        crew = _Crew(job)
        threads = [
            threading.Thread(target=crew.keep_busy, args=(number,), name=f"srbval-worker-{number}", daemon=True)
            for number in range(min(self.workers, job.count))
        ]
        try:
            for thread in threads:
                thread.start()
            for _ in range(job.count):
                outcome = crew.outcomes.get()
                if isinstance(outcome, BaseException):
                    raise outcome
                yield outcome
        finally:
            crew.end()
            for thread in threads:
                thread.join()


class _Crew:
    """What the threads share: the tasks still to do, the outcomes, the running processes."""

    def __init__(self, job: Job) -> None:
        self._job = job
        self._tasks = iter(job.tasks)
        self._lock = threading.Lock()
        self._running: set[_Worker] = set()
        self._prepared = threading.Event()
        self._over = False
        self.outcomes: queue.Queue[CaseOutcome | BaseException] = queue.Queue()

    def keep_busy(self, number: int) -> None:
        """What each thread does: keep one process busy; the first one compiles while the others wait."""
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
            self._prepared.set()  # the others must not wait for a thread that has ended

    def end(self) -> None:
        """Kill what still runs."""
        with self._lock:
            self._over = True
            for worker in self._running:
                worker.kill()

    def _next(self) -> CaseTask | None:
        with self._lock:
            return None if self._over else next(self._tasks, None)

    def _start(self) -> _Worker:
        with self._lock:
            if self._over:
                raise _OverError
            worker = _Worker()
            self._running.add(worker)
            return worker

    def _replace(self, worker: _Worker) -> _Worker:
        worker.close()
        with self._lock:
            self._running.discard(worker)
        return self._start()

    def _prepare(self, worker: _Worker) -> _Worker:
        for _ in range(ATTEMPTS):
            try:
                worker.ask(("prepare", tuple(self._job.precompiled)))
                return worker
            except EOFError:
                how = worker.death()
                worker = self._replace(worker)
        raise NumericsError(f"a worker process died {ATTEMPTS} times while compiling ({how}). See: srbval doctor")

    def _run(self, worker: _Worker, task: CaseTask) -> _Worker:
        for _ in range(ATTEMPTS):
            self._job.started(task.key)
            try:
                self.outcomes.put(worker.ask(("run", task)))
                return worker
            except EOFError:
                how = worker.death()
                worker = self._replace(worker)
        self.outcomes.put(crashed(task.key, f"process died {ATTEMPTS} times ({how})"))
        return worker


class _Worker:
    """A process that answers one request at a time; it ends when its input does, so it never outlives this one."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "srbval.campaign.engines.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | dict.fromkeys(THREADS, "1") | child_environment(),
        )

    def ask(self, request: tuple[str, Any]) -> Any:
        """The answer to a request; `EOFError` where the process died meanwhile."""
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
