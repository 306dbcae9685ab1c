"""A child process for the tests: does what it is told, in some of the ways in which one may go wrong."""

import os
import signal
import time
from collections.abc import Callable
from typing import Any

from srbval.processes import worker

GRACE_S = 1.0  # in place of five seconds


def _answer(request: Any) -> Any:
    if request == "sleep":
        time.sleep(1e6)
    if request == "hold the interpreter":
        sum(iter(int, 1))
    if request == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    if request == "leave":
        os._exit(7)
    if request == "raise":
        raise OSError("no such luck")
    if request == "print":
        print("in between")
    if request == "cannot be pickled":
        return lambda: None
    return request


def prepare_worker() -> Callable[[Any], Any]:
    return _answer


if __name__ == "__main__":
    worker.GRACE_S = GRACE_S
    worker.serve_calls(prepare_worker)
