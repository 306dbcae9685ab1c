"""Runs a scene with a model from outside in a separate process, with limits of time and memory."""

import contextlib
import math
import os
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import CancelledError
from dataclasses import replace
from functools import cache

import numpy as np

from srbval.errors import ConfigurationError, SrbvalError
from srbval.models import outputs as col
from srbval.models.health import default_solver
from srbval.models.hierarchy import check_known
from srbval.models.outputs import Outputs, split_run
from srbval.models.outside.names import COMMAND, FMU, content_of, solvers_of
from srbval.models.outside.process import OutsideResult
from srbval.models.run import RunStatus
from srbval.models.run_statistics import RunStatistics
from srbval.processes.worker import DiedError, OverLimitError, WorkerProcess
from srbval.scene import Scene

TIME_VARIABLE, MEMORY_VARIABLE = "SRBVAL_MODEL_SECONDS", "SRBVAL_MODEL_GB"  # environment variables with limits
START_S, PER_SIMULATED_S = 60.0, 1000.0  # default limit of the wall time: start, and for each simulated second
USUAL_GB = 4.0
OWN_SOLVER = "own"  # name of the solver of a model that offers no choice

_running: set[WorkerProcess] = set()
_ending: list[None] = []  # an entry for each active `models_ended`; models cannot start meanwhile


def run_outside(stats: RunStatistics, settle: int, whole: int) -> Iterator[tuple[int, Outputs]]:
    """Run a model from outside; arguments as in `srbval.models.hierarchy`. A failed run yields one row of NaN."""
    scene = stats.scene
    if scene.solver.name == OWN_SOLVER:  # for bundled models that the model may call
        scene = replace(scene, solver=replace(scene.solver, name=default_solver()))
    _announce(scene.model)
    found = run_in_process(scene)
    stats.wall_s, stats.cpu_s, stats.ended = found.wall_s, found.cpu_s, (found.status, found.reason)
    if found.out is None:
        yield settle, Outputs(out=np.full((1, col.COLUMN_COUNT), np.nan))
        return
    for first, count in split_run(0, whole - settle, 0, scene.output_rate_hz):
        yield settle + first, Outputs(out=found.out[first : first + count])


def with_own_solver(scene: Scene) -> Scene:
    """If a scene has the default solver and its external model lacks it, replace it by the first solver of the model.

    Raises `ConfigurationError` for any other solver that the model lacks, `DataError` if the model's files are missing.
    """
    content_of(scene.model)
    offered, name = solvers_of(scene.model) or (OWN_SOLVER,), scene.solver.name
    if name == default_solver() and name not in offered:
        name = offered[0]
    check_known(f"{scene.model}: the solver", name, offered)
    return replace(scene, solver=replace(scene.solver, name=name))


def run_in_process(scene: Scene) -> OutsideResult:
    """Run the scene's model in a new process; raises errors in the user's input, returns other failures as status."""
    limit_s = _limit(TIME_VARIABLE, START_S + PER_SIMULATED_S * (scene.settle_s + scene.duration_s))
    memory = 1e9 * _limit(MEMORY_VARIABLE, USUAL_GB)
    with tempfile.TemporaryDirectory(prefix="srbval-model-", ignore_cleanup_errors=True) as folder:
        own = {"TMPDIR": folder, "PYTHONDONTWRITEBYTECODE": "1"}  # leaves nothing in the user's folders
        process = WorkerProcess("srbval.models.outside.process", environment=own, own_group=True)
        _running.add(process)  # before the start, so that it can be stopped at any time
        try:
            if _ending:
                raise CancelledError
            found: OutsideResult | SrbvalError = process.call((scene, memory), limit_s=limit_s)
        except OverLimitError:
            reason = f"it did not end within {limit_s:g} s; the environment variable {TIME_VARIABLE} sets this limit"
            found = OutsideResult(RunStatus.OUT_OF_TIME, reason)
        except DiedError as error:
            if process not in _running:
                raise CancelledError from None
            more = f"perhaps for lack of memory; the environment variable {MEMORY_VARIABLE} sets its limit"
            found = OutsideResult(RunStatus.DIED, f"its process ended ({error}), {more}")
        finally:
            _running.discard(process)
            process.kill()
            process.close()
    if isinstance(found, SrbvalError):
        raise found
    return found


@contextlib.contextmanager
def models_ended() -> Iterator[None]:
    """Stop the processes of models from outside; callers get `CancelledError`. In the ``with`` block none can start."""
    _ending.append(None)
    try:
        while _running:
            _running.pop().stop()
        yield
    finally:
        _ending.pop()


@cache
def _announce(name: str) -> None:
    """Warn once that a program or FMU is executed."""
    if name.startswith(COMMAND) or name.endswith(FMU):
        what = name.removeprefix(COMMAND)
        print(f"srbval: {what} is a program with all your permissions; run only what you trust", file=sys.stderr)


def _limit(variable: str, usual: float) -> float:
    """Read a limit of time or memory from an environment variable; `usual` if the variable is not set."""
    text = os.environ.get(variable) or str(usual)
    with contextlib.suppress(ValueError):
        if 0 < float(text) < math.inf:
            return float(text)
    raise ConfigurationError(f"environment variable {variable} = {text!r} must be a positive number.")
