"""What a worker process does: load and compile, run a case, write the result."""

import contextlib
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

from srbval.campaign.case import CaseResult, CaseTask, Ending, acceleration_only, read_result, version, write_result
from srbval.campaign.quantities import CaseQuantity, Output, quantities_of
from srbval.errors import DataError, SrbvalError
from srbval.models.run import Run
from srbval.scene import Scene

SHORTEST_S = 0.001  # simulated time in which everything that a case needs is compiled


def prepare(scenes: Sequence[Scene]) -> str:
    """Compile what `scenes` need into the kernel cache, for all workers; the version of this process's code."""
    from srbval.models.simulate import Step, simulate

    _one_thread()
    for scene in scenes:
        with contextlib.suppress(SrbvalError, OSError, MemoryError):  # the case will report it
            simulate(
                replace(scene, duration_s=max(SHORTEST_S, 1 / scene.output_rate_hz), settle_s=0.0), step=Step.UNCHECKED
            )
    return version()


def run_case(task: CaseTask) -> CaseResult:
    """Run a case and write its result; whatever goes wrong is an ending, not an exception.

    A case whose result exists already is not run again, unless that is damaged.
    """
    _one_thread()
    if task.path.exists():
        with contextlib.suppress(DataError):
            return replace(read_result(task.path), found=True)
    started, simulation_s = time.perf_counter(), 0.0

    def ended(ending: Ending, reason: str, quantities: tuple[CaseQuantity, ...] = ()) -> CaseResult:
        return CaseResult(
            key=task.key, ending=ending, reason=reason, quantities=quantities,
            wall_s=time.perf_counter() - started, simulation_s=simulation_s,
        )  # fmt: skip

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
        return replace(result, wall_s=time.perf_counter() - started)
    except (OSError, DataError) as error:
        text = getattr(error, "strerror", None) or str(error)
        return ended(Ending.UNWRITTEN, f"the result could not be written: {text}")
    except MemoryError:
        return ended(Ending.CRASHED, "out of memory; run fewer cases at a time (--jobs)")
    except Exception as error:  # a bug of ours must not end the other cases
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
