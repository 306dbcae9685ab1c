"""Worker process that runs cases, ``python -m srbval.campaign.worker``, and the functions that call it.

Each thread, on this machine or a Dask worker, has its own process for cases: a case that dies or hangs affects no
other case. The process pools of Python and of the library pebble lose all running cases if a process dies at the wrong
moment.
"""

import contextlib
import platform
import threading
from dataclasses import replace

from srbval.campaign.results import (
    CRASHED,
    REFUSED,
    TIMED_OUT,
    CaseResult,
    CaseTask,
    code_version,
    quantities_of,
    read_intact_result,
    write_result,
)
from srbval.errors import ConfigurationError, DataError, NumericsError, SrbvalError
from srbval.models.hierarchy import level_of
from srbval.models.jit import kernels_of
from srbval.models.simulate import Step, simulate
from srbval.processes.worker import DiedError, OverLimitError, WorkerProcess, serve_calls
from srbval.scene import Scene
from srbval.sweep.pool import attempt

COMPILE_RUN_S = 0.001  # simulated time that suffices to compile all kernels of a case
IDLE_S = 60.0  # idle time after which the process ends, because a Dask worker outlives campaigns
ATTEMPTS = 3  # per case: the system may kill a process because another one needs memory
PREPARE_LIMIT_S = 1800.0  # limit for loading and compiling, which takes a minute or two
THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
this_thread = threading.local()  # `process` of each thread that waits for cases
_compiled = set[tuple[str, ...]]()  # models with the kernels that this process has compiled or loaded


def prepare(scene: Scene) -> str:
    """Compile or load the kernels (inner loops) of a scene's model; returns the version of this process's code."""
    kernels = (scene.model, scene.solver.name, *kernels_of(scene))
    if kernels not in _compiled and not level_of(scene.model).outside:
        shortest_s = max(COMPILE_RUN_S, 1 / scene.output_rate_hz)
        with contextlib.suppress(SrbvalError, OSError, MemoryError):  # the case itself reports the error
            simulate(replace(scene, duration_s=shortest_s, settle_s=0.0), step=Step.UNCHECKED)
    _compiled.add(kernels)
    return code_version()


def run_case(task: CaseTask) -> CaseResult:
    """Run a case and write its result, unless its file contains a final one; an error becomes the result's status."""
    if (found := read_intact_result(task.path)) and found.final:
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


def handle_request(request: Scene | CaseTask) -> str | CaseResult | DataError:
    """Compile the kernels of a scene, or run a case; returns a `DataError` if the result cannot be written."""
    try:
        return prepare(request) if isinstance(request, Scene) else run_case(request)
    except DataError as error:
        return error


def case_process() -> WorkerProcess:
    """Create a worker process that runs cases, with numerical libraries limited to one thread."""
    return WorkerProcess(__name__, environment=dict.fromkeys(THREAD_VARIABLES, "1"))


def run_isolated(task: CaseTask) -> CaseResult:
    """Compile a model's inner loops and run a case in this thread's worker process, in at most `ATTEMPTS` attempts.

    Raises `ConfigurationError` if the process has another version of the code than the task requires, `NumericsError`
    if processes die or hang while they compile, and `DataError` if no process can be started, or if the campaign folder
    does not exist here or cannot be written.
    """
    here, folder = f"the Dask worker at {platform.node()}", task.path.parents[1]
    if not folder.is_dir():
        raise DataError(f"{here} cannot access {folder}; choose a folder that all machines share.")
    if not hasattr(this_thread, "process"):
        this_thread.process = case_process()
    for _ in range(ATTEMPTS):
        ready = False
        try:
            version = this_thread.process.call(task.scene, limit_s=PREPARE_LIMIT_S)
            if version != task.version:
                raise ConfigurationError(
                    f"{here} runs version {version} of the model, the campaign version {task.version}: their results "
                    "would not be comparable. Install the same srbval there."
                )
            ready = True
            result: CaseResult | DataError = this_thread.process.call(task, limit_s=task.limit_s)
        except DiedError as error:
            how, over = str(error), isinstance(error, OverLimitError)
            if (found := read_intact_result(task.path)) and found.final:  # written before the process died
                return found
            if over:
                break
        except OSError as error:
            raise DataError(f"the operating system refused to start a process ({error}). Use fewer --jobs.") from None
        else:
            if isinstance(result, DataError):
                raise result
            return result
    if not ready:
        why = f"within {PREPARE_LIMIT_S:g} s" if over else f"but died {ATTEMPTS} times ({how})"
        raise NumericsError(f"a worker process did not compile the model's kernels {why}. See: srbval doctor")
    if not over:
        return write_failure(task, CRASHED, f"its process died {ATTEMPTS} times ({how}); the other cases were run")
    limit = f"its limit of {task.limit_s:.6g} s, so its process was ended; the other cases were run"
    options = "--limit-factor, --least-limit, or limit_factor and least_limit in the campaign file"
    return write_failure(task, TIMED_OUT, f"it took longer than {limit}. If it only needs more time: {options}")


def write_failure(task: CaseTask, status: str, reason: str) -> CaseResult:
    """Write and return the result of a case that its process did not complete."""
    result = CaseResult(key=task.key, status=status, reason=reason)
    write_result(task.path, result)
    return result


if __name__ == "__main__":
    serve_calls(lambda: handle_request, idle_s=IDLE_S)
