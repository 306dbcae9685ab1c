"""A time limit for a case, kept by the process that runs it."""

from __future__ import annotations

import contextlib
import faulthandler
import os
import threading
from collections.abc import Iterator
from pathlib import Path

from srbval.campaign.case_file import write_failure
from srbval.campaign.task import Ending, Outcome, Task
from srbval.campaign.work import run_task
from srbval.errors import DataError

GRACE_S = 10.0  # for a watch that finds no chance to strike, before the process is ended without a word
TIMED_OUT_CODE = 75


def run_watched(task: Task) -> Outcome:
    """`run_task`, unless it takes longer than the task's limit: then this process puts down why and ends itself.

    Whoever minds it tries the case again, finds what was put down and passes it on. For processes that serve cases
    only: not for the campaign's own.
    """
    with _watch(task):
        return run_task(task)


@contextlib.contextmanager
def _watch(task: Task) -> Iterator[None]:
    if task.limit_s is None:
        yield
        return
    timer = threading.Timer(task.limit_s, _strike, (task,))
    timer.daemon = True
    with Path(os.devnull).open("w") as nowhere:
        # what never lets go of the interpreter is ended from outside it
        faulthandler.dump_traceback_later(task.limit_s + GRACE_S, exit=True, file=nowhere)
        timer.start()
        try:
            yield
        finally:
            timer.cancel()
            faulthandler.cancel_dump_traceback_later()


def _strike(task: Task) -> None:
    """Say that the limit was passed, then end; a result that landed meanwhile stays."""
    reason = (
        f"it took longer than its limit of {task.limit_s:.6g} s, so its process was ended; the other cases were run. "
        "If it only needs longer: --limit-factor, --least-limit, or limit_factor and least_limit in the campaign file"
    )
    with contextlib.suppress(OSError, DataError):
        if not task.path.exists():
            write_failure(task.path, task.scene, Ending.TIMED_OUT, reason)
    os._exit(TIMED_OUT_CODE)
