"""Cases run in a process of their own, of this machine or of a Dask worker: one that dies or hangs harms no other.

The standard pools of processes, and the pool of pebble, give up everything that is running if one dies at the wrong
moment.
"""

import platform
import threading

from srbval.campaign.results import CRASHED, TIMED_OUT, CaseResult, CaseTask, intact_result, write_result
from srbval.errors import ConfigurationError, DataError, NumericsError
from srbval.processes.worker import DiedError, OverLimitError, RestartingProcess

ATTEMPTS = 3  # per case whose process dies: the system may have killed it because of another process's memory
PREPARE_LIMIT_S = 1800.0  # to load and compile everything, which takes a minute or two
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
this_thread = threading.local()  # its `process`, of each thread that runs cases


def case_process() -> RestartingProcess:
    """A process of one thread that runs cases."""
    return RestartingProcess("srbval.campaign.worker", environment=dict.fromkeys(THREADS, "1"))


def run_isolated(task: CaseTask) -> CaseResult:
    """Compile what a case needs and run it in the process of this thread, up to `ATTEMPTS` times if that dies.

    Raises `ConfigurationError` if the process runs other code than the task asks for, `NumericsError` if processes die
    or hang while they compile, and `DataError` if no process can be started, or the campaign's folder is not seen or
    cannot be written.
    """
    here, folder = f"the Dask worker at {platform.node()}", task.path.parents[1]
    if not folder.is_dir():
        raise DataError(f"{here} does not see {folder}; choose a folder that all machines share.")
    if not hasattr(this_thread, "process"):
        this_thread.process = case_process()
    for _ in range(ATTEMPTS):
        ready = False
        try:
            theirs = this_thread.process.call(task.scene, limit_s=PREPARE_LIMIT_S)
            if theirs != task.version:
                raise ConfigurationError(
                    f"{here} runs another version of the model ({theirs}, here {task.version}): results would not "
                    "compare. Install the same srbval there."
                )
            ready = True
            answer: CaseResult | DataError = this_thread.process.call(task, limit_s=task.limit_s)
        except DiedError as error:
            how, over = str(error), isinstance(error, OverLimitError)
            if (found := intact_result(task.path)) and found.final:  # written, but too late in being announced
                return found
            if over:
                break
        except OSError as error:
            raise DataError(f"the operating system refused to start a process ({error}). Use fewer --jobs.") from None
        else:
            if isinstance(answer, DataError):
                raise answer
            return answer
    if not ready:
        why = f"within {PREPARE_LIMIT_S:g} s" if over else f"but died {ATTEMPTS} times ({how})"
        raise NumericsError(f"a worker process did not compile what it needs {why}. See: srbval doctor")
    if not over:
        return crashed(task, f"process died {ATTEMPTS} times ({how})")
    limit = f"its limit of {task.limit_s:.6g} s, so its process was ended; the other cases were run"
    options = "--limit-factor, --least-limit, or limit_factor and least_limit in the campaign file"
    return _written(task, TIMED_OUT, f"it took longer than {limit}. If it only needs longer: {options}")


def crashed(task: CaseTask, how: str) -> CaseResult:
    """Write and return the result of a case whose process died each time it was tried; `how` completes "its ..."."""
    return _written(task, CRASHED, f"its {how}; the other cases were run without it")


def _written(task: CaseTask, status: str, reason: str) -> CaseResult:
    result = CaseResult(key=task.key, status=status, reason=reason)
    write_result(task.path, result)
    return result
