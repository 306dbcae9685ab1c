"""What a worker process does: load and compile, run a case within its time limit, write the result."""

import contextlib
import faulthandler
import importlib
import os
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from srbval.campaign.case import CaseOutcome, CaseTask, Ending, version
from srbval.campaign.case_file import read_result, write_failure, write_result
from srbval.campaign.quantities import quantities_of
from srbval.errors import DataError, SrbvalError
from srbval.models.run import Run, RunStatus
from srbval.scene import Scene

LOADED = (
    "h5py",
    "srbval.bench.measures",
    "srbval.models.full.equilibrium",
    "srbval.models.full.steps",
    "srbval.models.run_file",
    "srbval.models.simulate",
)
SHORTEST_S = 0.001  # simulated time in which everything that a case needs is compiled
GRACE_S = 10.0  # after the time limit, for the thread that ends the process, before it is ended without a result
TIMED_OUT_CODE = 75


def prepare(scenes: Sequence[Scene]) -> str:
    """Compile what `scenes` need into the kernel cache, for all workers; the version of this process's code."""
    from srbval.models.simulate import simulate

    _one_thread()
    for scene in scenes:
        with contextlib.suppress(SrbvalError):  # the case itself will report it
            simulate(replace(scene, duration_s=max(SHORTEST_S, 1 / scene.output_rate_hz), settle_s=0.0))
    return version()


def load_modules(folder: Path) -> bool:
    """Load what cases need, so that the first does not wait for it; whether `folder` is visible from here."""
    for module in LOADED:
        importlib.import_module(module)
    return folder.is_dir()


def run_within_limit(task: CaseTask) -> CaseOutcome:
    """`run_case`, but if it exceeds the task's limit this process writes that as the result and ends itself.

    The engine then tries the case again in another process, which finds the result and returns it. Only for worker
    processes, not for the campaign's own.
    """
    with _time_limit(task):
        return run_case(task)


def run_case(task: CaseTask) -> CaseOutcome:
    """Run a case and write its result; whatever goes wrong is an outcome, not an exception.

    A case whose result exists already is not run again.
    """
    _one_thread()
    if task.path.exists():
        return _existing(task)
    started = time.perf_counter()
    simulated_s = 0.0

    def ended(ending: Ending, reason: str) -> CaseOutcome:
        wall_s = time.perf_counter() - started
        return CaseOutcome(key=task.key, ending=ending, reason=reason, wall_s=wall_s, simulation_s=simulated_s)

    try:
        result = _simulate(task.scene)
        simulated_s = time.perf_counter() - started
        if isinstance(result, str):
            write_failure(task.path, task.scene, Ending.REFUSED, result)
            return ended(Ending.REFUSED, result)
        if result.status is not RunStatus.OK:
            reason = f"{result.status.value}: {result.reason}"
            write_failure(task.path, task.scene, Ending.FAILED, reason)
            return ended(Ending.FAILED, reason)
        write_result(task.path, result, quantities_of(result, task.outputs), task.outputs)
        return ended(Ending.OK, result.reason)
    except (OSError, DataError) as error:
        text = getattr(error, "strerror", None) or str(error)
        return ended(Ending.UNWRITTEN, f"the result could not be written: {text}")
    except MemoryError:
        return ended(Ending.CRASHED, "out of memory; run fewer cases at a time (--jobs)")
    except Exception as error:  # a bug of ours must not end the other cases
        return ended(Ending.CRASHED, f"unexpected {type(error).__name__}: {error}")


def _existing(task: CaseTask) -> CaseOutcome:
    try:
        result = read_result(task.path)
    except DataError as error:
        return CaseOutcome(key=task.key, ending=Ending.CRASHED, reason=str(error))
    return CaseOutcome(key=task.key, ending=result.ending, reason=result.reason, found=True)


def _simulate(scene: Scene) -> Run | str:
    from srbval.models.simulate import simulate

    try:
        return simulate(scene)
    except SrbvalError as error:
        return str(error)


@contextlib.contextmanager
def _time_limit(task: CaseTask) -> Iterator[None]:
    if task.limit_s is None:
        yield
        return
    timer = threading.Timer(task.limit_s, _end_process, (task,))
    timer.daemon = True
    with Path(os.devnull).open("w") as nowhere:
        # code that never releases the interpreter lock lets no timer run: faulthandler ends the process from a C thread
        faulthandler.dump_traceback_later(task.limit_s + GRACE_S, exit=True, file=nowhere)
        timer.start()
        try:
            yield
        finally:
            timer.cancel()
            faulthandler.cancel_dump_traceback_later()


def _end_process(task: CaseTask) -> None:
    """Write that the limit was exceeded, then end; a result that was written meanwhile stays."""
    reason = (
        f"it took longer than its limit of {task.limit_s:.6g} s, so its process was ended; the other cases were run. "
        "If it only needs longer: --limit-factor, --least-limit, or limit_factor and least_limit in the campaign file"
    )
    with contextlib.suppress(OSError, DataError):
        if not task.path.exists():
            write_failure(task.path, task.scene, Ending.TIMED_OUT, reason)
    os._exit(TIMED_OUT_CODE)


@cache
def _one_thread() -> Any:
    """Limit the libraries of this process to one thread: cases run in parallel, and sums must be reproducible."""
    from threadpoolctl import threadpool_limits

    return threadpool_limits(1)
