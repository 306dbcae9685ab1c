"""Worker process that runs cases, ``python -m srbval.campaign.worker``, and the functions that call it.

Each thread, on this machine or a Dask worker, has its own process for cases: a case that dies or hangs affects no
other case. The process pools of Python and of the library pebble lose all running cases if a process dies at the wrong
moment.
"""

import platform
import threading

from srbval.campaign import results
from srbval.campaign.results import CaseResult, CaseTask
from srbval.errors import ConfigurationError, DataError, SrbvalError
from srbval.models.simulate import Step, compile_for
from srbval.processes.worker import DiedError, OverLimitError, WorkerProcess, serve_calls
from srbval.storage.sources import content_version
from srbval.sweep.pool import attempt

IDLE_S = 60.0  # idle time after which the process ends, because a Dask worker outlives campaigns
ATTEMPTS = 3  # per case: the system may kill a process because another one needs memory
THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
this_thread = threading.local()  # `process` of each thread that waits for cases


def run_case(task: CaseTask) -> CaseResult | DataError:
    """Run a case and write its result, unless its file contains a final one; an error becomes the result's status.

    Returns a `DataError` if the result cannot be written.
    """
    if (found := results.read_intact_result(task.path)) and found.final:
        return found
    run = None
    try:
        tried = attempt(task.scene, step=Step.CHECKED)
        run = tried.run if tried.run is not None and tried.run.status.usable else None
        numbers = {} if run is None else results.quantities_of(run, task.outputs)
        result = CaseResult(key=task.key, status=tried.status, reason=tried.reason, quantities=numbers)
    except SrbvalError as error:
        result = CaseResult(key=task.key, status=results.REFUSED, reason=str(error))
    except MemoryError:
        reason = "out of memory; run fewer cases at a time (--jobs)"
        result = CaseResult(key=task.key, status=results.CRASHED, reason=reason)
    except Exception as error:  # a bug in the program must not end the other cases
        result = CaseResult(key=task.key, status=results.CRASHED, reason=f"unexpected {type(error).__name__}: {error}")
    try:
        results.write_result(task.path, result, run if result.usable else None, task.outputs)
    except DataError as error:
        return error
    return result


def case_process() -> WorkerProcess:
    """Create a worker process that runs cases, with numerical libraries limited to one thread."""
    return WorkerProcess(__name__, environment=dict.fromkeys(THREAD_VARIABLES, "1"))


def run_isolated(task: CaseTask) -> CaseResult:
    """Run a case in this thread's worker process, in at most `ATTEMPTS` attempts; compile its kernels before.

    Raises `ConfigurationError` if the code here has another version than the task requires, and `DataError` if no
    process can be started, or if the campaign folder does not exist here or cannot be written.
    """
    here, folder = f"the Dask worker at {platform.node()}", task.path.parents[1]
    if not folder.is_dir():
        raise DataError(f"{here} cannot access {folder}; choose a folder that all machines share.")
    if (version := content_version(results.COMPUTED_BY)) != task.version:
        raise ConfigurationError(
            f"{here} runs version {version} of the model, the campaign version {task.version}: their "
            "results would not be comparable. Install the same srbval there."
        )
    compile_for(task.scene)
    if not hasattr(this_thread, "process"):
        this_thread.process = case_process()
    for _ in range(ATTEMPTS):
        try:
            result: CaseResult | DataError = this_thread.process.call(task, limit_s=task.limit_s)
        except DiedError as error:
            how, over = str(error), isinstance(error, OverLimitError)
            if (found := results.read_intact_result(task.path)) and found.final:  # written before the process died
                return found
            if over:
                break
        except OSError as error:
            raise DataError(f"the operating system refused to start a process ({error}). Use fewer --jobs.") from None
        else:
            if isinstance(result, DataError):
                raise result
            return result
    if not over:
        reason = f"its process died {ATTEMPTS} times ({how}); the other cases were run"
        return write_failure(task, results.CRASHED, reason)
    limit = f"its limit of {task.limit_s:.6g} s, so its process was ended; the other cases were run"
    options = "--limit-factor, --least-limit, or limit_factor and least_limit in the campaign file"
    return write_failure(task, results.TIMED_OUT, f"it took longer than {limit}. If it only needs more time: {options}")


def write_failure(task: CaseTask, status: str, reason: str) -> CaseResult:
    """Write and return the result of a case that its process did not complete."""
    result = CaseResult(key=task.key, status=status, reason=reason)
    results.write_result(task.path, result)
    return result


if __name__ == "__main__":
    serve_calls(lambda: run_case, idle_s=IDLE_S)
