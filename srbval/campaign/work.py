"""What a worker process does: load and compile, run a case, write the result."""

import contextlib
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

from filelock import FileLock, Timeout

from srbval.campaign.case import CaseOutcome, CaseTask, Ending, version
from srbval.campaign.case_file import read_result, write_failure, write_result
from srbval.campaign.quantities import quantities_of
from srbval.errors import DataError, SrbvalError
from srbval.models.kernel_cache import kernel_cache_folder
from srbval.models.run import Run
from srbval.scene import Scene

SHORTEST_S = 0.001  # simulated time in which everything that a case needs is compiled


def prepare(scenes: Sequence[Scene]) -> str:
    """Compile what `scenes` need into the kernel cache, for all workers; the version of this process's code."""
    from srbval.models.simulate import Step, simulate

    _one_thread()
    for scene in scenes:
        with contextlib.suppress(SrbvalError, OSError, MemoryError), _after_others(scene):  # the case will report it
            simulate(
                replace(scene, duration_s=max(SHORTEST_S, 1 / scene.output_rate_hz), settle_s=0.0), step=Step.UNCHECKED
            )
    return version()


@contextlib.contextmanager
def _after_others(scene: Scene) -> Iterator[None]:
    """Let one process compile; those that come meanwhile wait, then load what it has stored, side by side."""
    lock = FileLock(kernel_cache_folder() / f"{scene.model}-{scene.solver.name}.lock")
    try:
        with lock.acquire(timeout=0):
            yield
    except Timeout:
        with lock:
            pass
        yield


def run_case(task: CaseTask) -> CaseOutcome:
    """Run a case and write its result; whatever goes wrong is an outcome, not an exception.

    A case whose result exists already is not run again, unless that is damaged.
    """
    _one_thread()
    started = time.perf_counter()
    simulated_s = 0.0

    def ended(ending: Ending, reason: str) -> CaseOutcome:
        wall_s = time.perf_counter() - started
        return CaseOutcome(key=task.key, ending=ending, reason=reason, wall_s=wall_s, simulation_s=simulated_s)

    try:
        if (found := _existing(task)) is not None:
            return found
        result = _simulate(task.scene)
        simulated_s = time.perf_counter() - started
        if isinstance(result, str):
            write_failure(task.path, task.scene, Ending.REFUSED, result)
            return ended(Ending.REFUSED, result)
        if not result.status.usable:
            reason = f"{result.status.value}: {result.reason}"
            write_failure(task.path, task.scene, Ending.FAILED, reason)
            return ended(Ending.FAILED, reason)
        write_result(task.path, result, quantities_of(result, task.outputs), task.outputs)
        return ended(Ending(result.status.value), result.reason)
    except (OSError, DataError) as error:
        text = getattr(error, "strerror", None) or str(error)
        return ended(Ending.UNWRITTEN, f"the result could not be written: {text}")
    except MemoryError:
        return ended(Ending.CRASHED, "out of memory; run fewer cases at a time (--jobs)")
    except Exception as error:  # a bug of ours must not end the other cases
        return ended(Ending.CRASHED, f"unexpected {type(error).__name__}: {error}")


def _existing(task: CaseTask) -> CaseOutcome | None:
    """The outcome of a result that is there and whole."""
    if not task.path.exists():
        return None
    try:
        result = read_result(task.path)
    except DataError:
        return None
    return CaseOutcome(key=task.key, ending=result.ending, reason=result.reason, found=True)


def _simulate(scene: Scene) -> Run | str:
    from srbval.models.simulate import simulate

    try:
        return simulate(scene)
    except SrbvalError as error:
        return str(error)


@cache
def _one_thread() -> Any:
    """Limit the libraries of this process to one thread: cases run in parallel, and sums must be reproducible."""
    from threadpoolctl import threadpool_limits

    return threadpool_limits(1)
