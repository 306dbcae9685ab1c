"""The process of a `CaseProcess`, ``python -m srbval.campaign.worker``: compiles, runs cases, writes results."""

import contextlib
from dataclasses import replace

from srbval.campaign.quantities import quantities_of
from srbval.campaign.results import CRASHED, REFUSED, CaseResult, CaseTask, intact_result, version, write_result
from srbval.errors import DataError, SrbvalError
from srbval.models.jit import kernels_of
from srbval.models.simulate import Step, simulate
from srbval.processes.worker import serve_calls
from srbval.scene import Scene
from srbval.sweep.pool import attempt

SHORTEST_S = 0.001  # simulated time in which everything that a case needs is compiled
IDLE_S = 60.0  # without a case, after which the process ends: a Dask worker outlives campaigns
_prepared: set[tuple[str, ...]] = set()


def prepare(scene: Scene) -> str:
    """Compile or load what runs like that of `scene` need, once; returns the version of this process's code."""
    kind = (scene.model, scene.solver.name, *kernels_of(scene))
    if kind not in _prepared:
        shortest_s = max(SHORTEST_S, 1 / scene.output_rate_hz)
        with contextlib.suppress(SrbvalError, OSError, MemoryError):  # the case reports it
            simulate(replace(scene, duration_s=shortest_s, settle_s=0.0), step=Step.UNCHECKED)
        _prepared.add(kind)
    return version()


def run_case(task: CaseTask) -> CaseResult:
    """Run a case and write its result; every failure but `DataError` of writing becomes a status and raises nothing.

    A case that has an intact and final result is not run again.
    """
    if (found := intact_result(task.path)) and found.final:
        return found
    run = None
    try:
        tried = attempt(task.scene, step=Step.CHECKED)
        run = tried.run if tried.run is not None and tried.run.status.usable else None
        numbers = {} if run is None else quantities_of(run, task.outputs)
        result = CaseResult(key=task.key, status=tried.status, reason=tried.reason, quantities=numbers)
    except SrbvalError as error:
        result = CaseResult(key=task.key, status=REFUSED, reason=str(error))
    except MemoryError:
        reason = "out of memory; run fewer cases at a time (--jobs)"
        result = CaseResult(key=task.key, status=CRASHED, reason=reason)
    except Exception as error:  # a bug in the program must not end the other cases
        result = CaseResult(key=task.key, status=CRASHED, reason=f"unexpected {type(error).__name__}: {error}")
    write_result(task.path, result, run if result.usable else None, task.outputs)
    return result


def answer(request: Scene | CaseTask) -> str | CaseResult | DataError:
    """Prepare for a scene, or run a case; an error of writing its result is an answer, too."""
    try:
        return prepare(request) if isinstance(request, Scene) else run_case(request)
    except DataError as error:
        return error


if __name__ == "__main__":
    serve_calls(lambda: answer, idle_s=IDLE_S)
