"""The process of a `CaseProcess`, ``python -m srbval.campaign.worker``: compiles, runs cases, writes results."""

import contextlib
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

from srbval.campaign.quantities import Output, Quantities, quantities_of
from srbval.campaign.results import CaseResult, CaseTask, Ending, acceleration_only, final_result, write_result
from srbval.errors import DataError, SrbvalError
from srbval.models.run import Run
from srbval.processes.worker import serve_calls
from srbval.scene import Scene
from srbval.storage.sources import content_version

COMPUTED_BY = "srbval.campaign.worker"
SHORTEST_S = 0.001  # simulated time in which everything that a case needs is compiled
IDLE_S = 60.0  # without a case, after which the process ends: a Dask worker outlives campaigns


def version() -> str:
    """Version of all code that runs a case and measures it."""
    return content_version(COMPUTED_BY)


def prepare(scenes: Sequence[Scene]) -> str:
    """Compile the kernels of `scenes` into the cache, for all workers; returns the version of this process's code."""
    from srbval.models.simulate import Step, simulate

    _one_thread()
    for scene in scenes:
        with contextlib.suppress(SrbvalError, OSError, MemoryError):  # the case reports it
            shortest_s = max(SHORTEST_S, 1 / scene.output_rate_hz)
            simulate(replace(scene, duration_s=shortest_s, settle_s=0.0), step=Step.UNCHECKED)
    return version()


def run_case(task: CaseTask) -> CaseResult:
    """Run a case and write its result; every failure becomes an ending and raises nothing.

    A case that has an intact and final result is not run again.
    """
    _one_thread()
    if (found := final_result(task.path)) is not None:
        return found
    started, simulation_s = time.perf_counter(), 0.0

    def ended(ending: Ending, reason: str, quantities: Quantities | None = None) -> CaseResult:
        found = quantities or {}
        return CaseResult(key=task.key, ending=ending, reason=reason, quantities=found, simulation_s=simulation_s)

    try:
        run, signals = _simulate(task.scene), None
        simulation_s = time.perf_counter() - started
        if isinstance(run, str):
            result = ended(Ending.REFUSED, run)
        elif not run.status.usable:
            result = ended(Ending.FAILED, f"{run.status.value}: {run.reason}")
        else:
            result = ended(Ending(run.status.value), run.reason, quantities_of(run, task.outputs))
            if Output.SIGNALS in task.outputs:
                signals = run
            elif Output.ACCELERATION in task.outputs:
                signals = acceleration_only(run)
        write_result(task.path, result, task.scene, signals)
        return result
    except (OSError, DataError) as error:
        text = getattr(error, "strerror", None) or str(error)
        return ended(Ending.UNWRITTEN, f"the result could not be written: {text}")
    except MemoryError:
        return ended(Ending.CRASHED, "out of memory; run fewer cases at a time (--jobs)")
    except Exception as error:  # a bug in the program must not end the other cases
        return ended(Ending.CRASHED, f"unexpected {type(error).__name__}: {error}")


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


def load() -> Callable[[tuple[str, Any]], Any]:
    """Return the function that answers ``("prepare", scenes)`` and ``("run", task)``."""
    from srbval.campaign import worker  # under its own name: tasks and results are pickled

    return lambda request: worker.prepare(request[1]) if request[0] == "prepare" else worker.run_case(request[1])


if __name__ == "__main__":
    serve_calls(load, idle_s=IDLE_S)
