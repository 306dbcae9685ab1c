"""Worker process that answers one call at a time, the object by which its parent calls it, and calls in many processes.

The worker ends when its input is closed, even during a call, so it never outlives its parent; a call that blocks the
interpreter is ended at its time limit. Output that libraries print goes to standard error, not between the answers.
"""

import contextlib
import faulthandler
import gc
import importlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, Future, as_completed, wait
from pathlib import Path
from typing import Any, TypeVar

from srbval.errors import DataError
from srbval.processes.machine import is_single_threaded, usable_cores
from srbval.storage.installation import child_environment

GRACE_S = 5.0  # time after the limit for the parent to kill the child before the child ends itself
TERMINATION_S = 10.0  # longest wait for the end of a killed process, which may hang on a dead disk
SIGNAL_S = 0.5  # the longest time for which a wait ignores a signal

Item = TypeVar("Item")
Result = TypeVar("Result")


def wait_for_result(future: Future[Result]) -> Result:
    """Wait for a future and return its result; a signal such as Ctrl-C interrupts the wait within `SIGNAL_S` [s].

    `Future.result` alone may ignore a signal until the result is there.
    """
    while not wait([future], SIGNAL_S).done:
        pass
    return future.result()


@contextlib.contextmanager
def without_ctrl_c() -> Iterator[None]:
    """Context in which Ctrl-C is delayed, except on Windows. Processes that are started in it never receive Ctrl-C.

    If code in the context sets a handler of Ctrl-C, the former handler is restored at the end: the import of `runner`
    of dask-jobqueue, for example, sets a handler that ends the program as if all work were done.
    """
    masks, handler = hasattr(signal, "pthread_sigmask"), signal.getsignal(signal.SIGINT)
    main = threading.current_thread() is threading.main_thread()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT]) if masks else ()
    try:
        yield
    finally:
        if main and signal.getsignal(signal.SIGINT) is not handler:  # only the main thread may set handlers
            signal.signal(signal.SIGINT, handler)
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_group(leader: int) -> None:
    """Kill the process group of the process `leader`, or on Windows the process and its child processes."""
    with contextlib.suppress(OSError):  # no process is left
        if hasattr(os, "killpg"):
            os.killpg(leader, signal.SIGKILL)
        else:
            subprocess.run(["taskkill", "/F", "/T", "/PID", str(leader)], capture_output=True, check=False)


class DiedError(Exception):
    """Error: the process died or was killed before it answered; the message contains its exit code or signal."""


class OverLimitError(DiedError):
    """Error: the process was killed because a call exceeded its time limit."""


class WorkerProcess:
    """Worker process that runs ``python -m module``; if it died, the next `call` starts it again.

    It gets the environment variables of the calling process and those in `environment`. With `own_group`, `kill` also
    ends its child processes. `module` calls `serve_calls`. With `may_fork`, the worker is instead a copy of the calling
    process that calls `prepare_worker` of `module` and need not repeat imports, unless other threads of the caller make
    a fork unsafe. Requests and answers are pickled, so the worker must run trusted code.
    """

    def __init__(
        self,
        module: str,
        *,
        environment: Mapping[str, str] | None = None,
        own_group: bool = False,
        may_fork: bool = False,
    ) -> None:
        self._module, self._may_fork, self._leads = module, may_fork, own_group
        self._environment = dict(environment or {})
        self._lock, self._stopped = threading.Lock(), False
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> subprocess.Popen[bytes]:
        """Start the process unless it runs; raises `OSError` if that fails, `CancelledError` after `stop`."""
        with self._lock:
            if self._stopped:
                raise CancelledError
            if self._process is None:
                with without_ctrl_c():
                    self._process = subprocess.Popen(
                        [sys.executable, "-P", "-m", self._module],
                        stdin=subprocess.PIPE,
                        stdout=subprocess.PIPE,
                        env=os.environ | self._environment | child_environment(),
                        process_group=0 if self._leads and hasattr(os, "killpg") else None,
                        creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),  # Windows: without Ctrl-C
                        preexec_fn=self._serve_as_copy if self._may_fork and is_single_threaded() else None,
                    )
            return self._process

    def _serve_as_copy(self) -> None:
        """Serve calls in the forked process; use, close or clean up nothing that belongs to the parent."""
        gc.freeze()
        gc.enable()
        os.closerange(3, os.sysconf("SC_OPEN_MAX"))  # closing the last one signals `Popen` that the process has started
        sys.stdout = sys.stderr = os.fdopen(2, "w", closefd=False)  # the streams of the parent may be redirected
        for number in (signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)
        serve_calls(lambda: importlib.import_module(self._module).prepare_worker())

    def call(self, request: Any, *, limit_s: float | None = None) -> Any:
        """Send a request and return the answer; raises `DiedError`, or `OverLimitError` after `limit_s` [s]."""
        process = self.start()
        assert process.stdin is not None
        assert process.stdout is not None
        started = time.monotonic()
        timer = threading.Timer(limit_s or 0.0, self.kill)
        timer.daemon = True
        try:
            if limit_s is not None:
                timer.start()
            pickle.dump((request, limit_s), process.stdin)
            process.stdin.flush()
            return pickle.load(process.stdout)
        except (OSError, EOFError, ValueError, pickle.UnpicklingError):  # ValueError: the pipe was closed meanwhile
            over = limit_s is not None and time.monotonic() >= started + limit_s
            how = f"it stopped answering and did not end within {TERMINATION_S:g} s"
            with contextlib.suppress(subprocess.TimeoutExpired):
                names, code = {one.value: one.name for one in signal.Signals}, process.wait(TERMINATION_S)
                how = f"signal {names[-code]}" if -code in names else f"exit code {code}"
            self.kill()  # also its group
            self.close()
            raise (OverLimitError if over else DiedError)(how) from None
        finally:
            timer.cancel()

    def kill(self) -> None:
        """Kill the process and, if it leads a group, the other processes of the group."""
        if (process := self._process) is not None:
            if self._leads:
                end_group(process.pid)
            process.kill()

    def stop(self) -> None:
        """Kill the process; later calls do not start it again."""
        with self._lock:
            self._stopped = True
            self.kill()

    def close(self) -> None:
        """Close the pipes of the process and wait for its end."""
        process, self._process = self._process, None
        if process is None:
            return
        for stream in filter(None, (process.stdin, process.stdout)):
            with contextlib.suppress(OSError):
                stream.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(TERMINATION_S)

    __del__ = close


def serve_calls(load: Callable[[], Callable[[Any], Any]], *, idle_s: float | None = None) -> None:
    """Answer requests in the worker process until its input is closed or no request arrives for `idle_s` [s].

    `load` is called first: it imports what is needed and returns the function that answers; requests that arrive
    meanwhile wait. Ctrl-C is ignored. An exception ends the process with a line on standard error.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        answers = os.fdopen(os.dup(1), "wb")
        os.dup2(2, 1)  # output of libraries must not mix with the answers
        requests = end_with_input()
        answer = load()
        with Path(os.devnull).open("w") as nowhere:
            while True:
                request, limit_s = requests.get(timeout=idle_s)
                if limit_s is not None:  # works even if the code blocks the interpreter
                    faulthandler.dump_traceback_later(limit_s + GRACE_S, exit=True, file=nowhere)
                answered = pickle.dumps(answer(request), protocol=pickle.HIGHEST_PROTOCOL)
                faulthandler.cancel_dump_traceback_later()
                answers.write(answered)
                answers.flush()
    except (BrokenPipeError, queue.Empty):
        os._exit(0)  # the parent no longer waits
    except BaseException as error:
        print(f"worker process {os.getpid()}: {type(error).__name__}: {error}", file=sys.stderr, flush=True)
        os._exit(1)


def end_with_input() -> queue.Queue[Any]:
    """Start a thread that ends this process when its standard input is closed, as happens when its parent ends.

    The returned queue receives the requests from the input. If this process leads a group, the group ends, too.
    """
    stream, requests = os.fdopen(os.dup(0), "rb"), queue.Queue[Any]()

    def receive() -> None:
        try:
            while True:
                requests.put(pickle.load(stream))
        finally:
            if hasattr(os, "getpgrp") and os.getpgrp() == os.getpid():
                end_group(os.getpid())
            os._exit(0)

    threading.Thread(target=receive, daemon=True).start()
    return requests


def in_processes(
    function: Callable[[Item], Result], items: Sequence[Item], *, jobs: int | None = None
) -> Iterator[tuple[Item, Result]]:
    """Call `function` for each item in several processes; yields item and result in the order of completion.

    `jobs` processes run at a time, by default one per core; they ignore Ctrl-C. A single item is computed in this
    process. The function, the items and the results must be picklable. Raises the exceptions of `function`, and
    `DataError` if a process dies.
    """
    from concurrent.futures import ProcessPoolExecutor  # slow imports
    from concurrent.futures.process import BrokenProcessPool
    from multiprocessing import get_context
    from unittest.mock import patch

    if len(items) < 2:
        yield from ((item, function(item)) for item in items)
        return
    count, ignore = min(jobs or usable_cores(), len(items)), (signal.SIGINT, signal.SIG_IGN)
    with ProcessPoolExecutor(count, get_context("spawn"), initializer=signal.signal, initargs=ignore) as pool:
        script = {"__file__": None, "__spec__": None}  # so that a spawned process does not run the user's script
        with patch.multiple(sys.modules["__main__"], create=True, **script):
            running = {pool.submit(function, item): item for item in items}
        try:
            yield from ((running[future], future.result()) for future in as_completed(running))
        except BrokenProcessPool:
            raise DataError(
                "a worker process died, perhaps for lack of memory. Finished work is kept, and the same command "
                "continues from there; use fewer --jobs."
            ) from None
        finally:
            pool.shutdown(cancel_futures=True)
