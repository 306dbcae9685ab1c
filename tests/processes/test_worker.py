"""A child process answers, or is said to have died; it never takes its parent along, nor outlives it."""

import os
import signal
import subprocess
import sys
import threading
from concurrent.futures import CancelledError, ThreadPoolExecutor

import pytest

from srbval.processes import worker
from srbval.processes.worker import DiedError, OverLimitError, WorkerProcess, without_ctrl_c
from tests.marked import marked, until
from tests.processes.answerer import GRACE_S

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")
ANSWERER = "tests.processes.answerer"


@pytest.fixture(params=[False, True], ids=["started", "forked"])
def process(request, monkeypatch):
    """One that starts anew, and one that is a copy, as if no library had a thread here."""
    monkeypatch.setattr(worker, "is_single_threaded", lambda: True)
    started = WorkerProcess(ANSWERER, may_fork=request.param)
    yield started
    started.close()
    started.close()  # more than once does no harm


def test_it_answers(process):
    large = bytes(10_000_000)
    assert [process.call(request, limit_s=60.0) for request in (1, "print", large)] == [1, "print", large]


COPIED = f"""
import pathlib, signal, sys, threading
from srbval.processes.worker import WorkerProcess
signal.signal(signal.SIGTERM, lambda *_: None)
if len(sys.argv) > 1: threading.Thread(target=threading.Event().wait, daemon=True).start()
process = WorkerProcess({ANSWERER!r}, may_fork=True)
process.call(1)
print(b"may_fork" in pathlib.Path(f"/proc/{{process.start().pid}}/cmdline").read_bytes())
process.start().terminate()
process.start().wait(60)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere none is a copy")
@pytest.mark.parametrize("more", [[], ["with a thread"]])
def test_only_a_process_of_one_thread_is_copied(more):
    """Without its handlers of signals, or SIGTERM would not end the copy."""
    run = subprocess.run([sys.executable, "-c", COPIED, *more], check=True, capture_output=True, text=True)
    assert run.stdout.strip() == str(not more)


@pytest.mark.parametrize(
    ("request_", "how"),
    [("die", "signal SIGKILL"), ("leave", "exit code 7"), ("raise", "exit code 1"), ("cannot be pickled", "exit code")],
)
def test_it_dies(request_, how, process, capfd):
    with pytest.raises(DiedError, match=how) as caught:
        process.call(request_)
    assert not isinstance(caught.value, OverLimitError)
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize("request_", ["sleep", "hold the interpreter"])
def test_it_takes_too_long(request_, process):
    assert process.call(1) == 1
    with pytest.raises(OverLimitError, match="signal SIGKILL"):
        process.call(request_, limit_s=0.2)


def test_it_starts_again_until_it_is_stopped(process):
    for _ in range(2):
        assert process.call(1) == 1
        with pytest.raises(DiedError, match="signal SIGKILL"):
            process.call("die")
    process.stop()
    with pytest.raises(CancelledError):
        process.call(1)


PARENT = f"""
import sys
from srbval.processes import worker
worker.WorkerProcess({ANSWERER!r}).call(sys.argv[1], limit_s=float(sys.argv[2]))
"""


@pytest.mark.parametrize("request_", ["sleep", "hold the interpreter"])
def test_it_does_not_outlive_its_parent(request_):
    """Code that lets no thread of Python run ends with the request's limit, which a thread of C keeps."""
    mark = {"SRBVAL_TEST": f"{os.getpid()} {request_}"}
    parent = subprocess.Popen([sys.executable, "-c", PARENT, request_, "3"], env=os.environ | mark)
    until(lambda: len(marked(mark)) == 2)
    parent.kill()
    parent.wait()
    until(lambda: not marked(mark), within_s=3 + 15 * GRACE_S)
    assert parent.returncode == -signal.SIGKILL


def test_ctrl_c_does_not_reach_it_even_while_it_starts(capfd):
    for _ in range(5):
        process = WorkerProcess(ANSWERER)
        os.kill(process.start().pid, signal.SIGINT)
        assert process.call(1, limit_s=60.0) == 1
        process.close()
    assert "KeyboardInterrupt" not in capfd.readouterr().err


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="Windows delays no Ctrl-C")
def test_ctrl_c_within_comes_afterwards_to_the_handler_of_before():
    seen: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: seen.append(number))
    with without_ctrl_c():
        signal.raise_signal(signal.SIGINT)
        signal.signal(signal.SIGINT, lambda *_: sys.exit())  # as dask-jobqueue does when it is imported
        assert seen == []
    assert seen == [signal.SIGINT]


def test_without_groups_a_tree_of_processes_is_ended(monkeypatch):
    called: list[list[str]] = []
    monkeypatch.delattr(os, "killpg", raising=False)
    monkeypatch.setattr(subprocess, "run", lambda command, **_: called.append(command))
    process = WorkerProcess(ANSWERER, own_group=True)
    leader = process.start().pid
    process.kill()
    process.close()
    assert called == [["taskkill", "/F", "/T", "/PID", str(leader)]]


def test_a_signal_that_does_not_wake_the_main_thread_ends_its_wait():
    """Python runs a handler in the main thread only, which sleeps on if another thread is given the signal."""

    def interrupt(*_):
        raise InterruptedError

    before = signal.signal(signal.SIGUSR1, interrupt)
    with ThreadPoolExecutor() as pool:
        done = threading.Event()
        signalled = pool.submit(lambda: (done.wait(1.0), signal.pthread_kill(threading.get_ident(), signal.SIGUSR1)))
        try:
            with pytest.raises(InterruptedError):
                worker.wait_for_result(asleep := pool.submit(done.wait, 20.0))
            assert signalled.result()
            assert not asleep.done()
        finally:
            done.set()
            signal.signal(signal.SIGUSR1, before)
