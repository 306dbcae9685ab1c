"""What a worker does: prepare itself, run one case, put the result away."""

from __future__ import annotations

import importlib
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from srbval.campaign.case import version
from srbval.campaign.case_file import read_result, write_failure, write_result
from srbval.campaign.quantities import quantities_of
from srbval.campaign.task import Ending, Outcome, Task
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
SHORTEST_S = 0.001  # simulated, to compile what a case needs


def prepare(scenes: Sequence[Scene]) -> str:
    """Have what `scenes` need compiled, so that workers find it in the store; the version of this process's models."""
    from srbval.models.simulate import simulate

    _one_thread()
    for scene in scenes:
        try:
            simulate(replace(scene, duration_s=max(SHORTEST_S, 1 / scene.output_rate_hz), settle_s=0.0))
        except SrbvalError:
            continue  # the case itself will say so
    return version()


def ready(folder: Path) -> bool:
    """Load what cases need, so that the first one does not wait for it; whether `folder` can be seen from here."""
    for module in LOADED:
        importlib.import_module(module)
    return folder.is_dir()


def run_task(task: Task) -> Outcome:
    """Run a case and write its result; whatever goes wrong with it is the outcome, not an exception.

    A result that is already there is not run again.
    """
    _one_thread()
    if task.path.exists():
        return landed(task)
    started = time.perf_counter()
    simulated_s = 0.0

    def ended(ending: Ending, reason: str) -> Outcome:
        wall_s = time.perf_counter() - started
        return Outcome(key=task.key, ending=ending, reason=reason, wall_s=wall_s, simulation_s=simulated_s)

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
    except Exception as error:  # a bug of ours must not take the other cases with it
        return ended(Ending.CRASHED, f"unexpected {type(error).__name__}: {error}")


def landed(task: Task) -> Outcome:
    """The outcome of a case whose result is there."""
    try:
        result = read_result(task.path)
    except DataError as error:
        return Outcome(key=task.key, ending=Ending.CRASHED, reason=str(error))
    return Outcome(key=task.key, ending=result.ending, reason=result.reason, found=True)


def _simulate(scene: Scene) -> Run | str:
    from srbval.models.simulate import simulate

    try:
        return simulate(scene)
    except SrbvalError as error:
        return str(error)


@cache
def _one_thread() -> Any:
    """Keep the libraries of this process to one thread from now on: cases run side by side, and sums repeat."""
    from threadpoolctl import threadpool_limits

    return threadpool_limits(1)
