"""Runs a scene with a model from outside in a separate process, with limits of time and memory.

The process runs this module: ``python -m srbval.models.outside.run``. It returns every outcome as a value: outputs of a
run, a status with its reason, or an exception for wrong input.
"""

import contextlib
import importlib
import importlib.util
import json
import math
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import load_bearing
from srbval.errors import ConfigurationError, DataError, SrbvalError, UnknownNameError
from srbval.models import outputs as col
from srbval.models.health import default_solver
from srbval.models.outputs import Outputs, split_run
from srbval.models.outside.names import COMMAND, FMU, OWN_SOLVER, entry_points
from srbval.models.outside.signals import UnusableSignalsError, recorded_columns, signals_of
from srbval.models.run import RunStatus
from srbval.models.run_file import scene_dict
from srbval.models.run_statistics import RunStatistics
from srbval.processes.machine import limit_memory, limit_resource
from srbval.processes.worker import DiedError, OverLimitError, WorkerProcess, serve_calls
from srbval.scene import Scene

Model = Callable[[Scene], Any]
TIME_VARIABLE, MEMORY_VARIABLE = "SRBVAL_MODEL_SECONDS", "SRBVAL_MODEL_GB"  # environment variables with limits
START_S, PER_SIMULATED_S = 60.0, 1000.0  # default limit of the wall time: start, and for each simulated second
USUAL_GB = 4.0
SCENE_FILE, SIGNAL_FILE = "{scene_json}", "{out_csv}"  # placeholders in a command
WARM_UP_S = 0.01  # length of a first run that is not timed: delayed imports, compiling
REASON = "the signals are finite and not constant; nothing else is checked for a model from outside"

_running: set[WorkerProcess] = set()
_ending: list[None] = []  # an entry for each active `models_ended`; models cannot start meanwhile


class OutsideResult(NamedTuple):
    """Result of a model from outside: status, array `Outputs.out` if the run succeeded, and computing times [s]."""

    status: RunStatus
    reason: str
    out: FloatArray | None = None
    wall_s: float = 0.0
    cpu_s: float = 0.0


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


def run_in_process(scene: Scene) -> OutsideResult:
    """Run the scene's model in a new process; raises errors in the user's input, returns other failures as status."""
    limit_s = _limit(TIME_VARIABLE, START_S + PER_SIMULATED_S * (scene.settle_s + scene.duration_s))
    memory = 1e9 * _limit(MEMORY_VARIABLE, USUAL_GB)
    with tempfile.TemporaryDirectory(prefix="srbval-model-", ignore_cleanup_errors=True) as folder:
        own = {"TMPDIR": folder, "PYTHONDONTWRITEBYTECODE": "1"}  # leaves nothing in the user's folders
        process = WorkerProcess("srbval.models.outside.run", environment=own, own_group=True)
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


def run_requested_model(request: tuple[Scene, float]) -> OutsideResult | SrbvalError:
    """Run the model of a scene; `request` is the scene and the memory limit [bytes].

    A wrong name or file of the model is returned as an error; every other exception becomes a status.
    """
    scene, memory = request
    limit_resource("RLIMIT_CORE", 0)  # a crash leaves no memory dump
    limit_memory(memory)
    model: Model | None = None
    try:
        model = load_model(scene.model)
        return run_model(model, scene)
    except UnusableSignalsError as error:
        return OutsideResult(*error.args)
    except MemoryError as error:
        reason = f"it needed more memory than {memory / 1e9:g} GB, its limit ({error})"
        return OutsideResult(RunStatus.OUT_OF_MEMORY, reason)
    except BaseException as error:  # whatever foreign code raises, also SystemExit
        if model is None and isinstance(error, SrbvalError):
            kind = next(kind for kind in (ConfigurationError, DataError, SrbvalError) if isinstance(error, kind))
            return kind(str(error))  # not every error can be pickled
        frames = traceback.extract_tb(error.__traceback__)
        own = [f for f in frames if f.filename != __file__ and "-packages" not in f.filename and f.filename[:1] != "<"]
        place = f", in {Path(own[-1].filename).name} line {own[-1].lineno}" if own else ""  # of the model's code
        return OutsideResult(RunStatus.RAISED, f"{type(error).__name__}: {' '.join(str(error).split())[:300]}{place}")


def run_model(model: Model, scene: Scene) -> OutsideResult:
    """Call the model, first for a short scene as a warm-up, and convert its signals to a result."""
    with contextlib.suppress(Exception):  # the run raises the exception again, unless only the short scene fails
        model(replace(scene, duration_s=min(WARM_UP_S, scene.duration_s), settle_s=0.0))
    wall_s, cpu_s = time.perf_counter(), _worked_s()
    returned = model(scene)
    wall_s, cpu_s = time.perf_counter() - wall_s, _worked_s() - cpu_s
    signals = signals_of(returned)
    own_s = wall_s if signals.wall_s is None else min(float(signals.wall_s), wall_s)
    out, own_cpu_s = recorded_columns(signals, scene), max(cpu_s - (wall_s - own_s), 0.0)
    return OutsideResult(RunStatus.OK, REASON, out, own_s, own_cpu_s)


def load_model(name: str) -> Model:
    """Load the function of a model; raises the exceptions of importing its file, `SrbvalError` for a wrong name."""
    place = entry_points().get(name, name)
    if place.startswith(COMMAND):
        return command_model(place.removeprefix(COMMAND))
    if place.endswith(FMU):
        from srbval.models.outside.fmu import load_fmu

        return load_fmu(Path(place))
    source, _, function = place.rpartition(":")
    if source.endswith(".py"):
        file = Path(source).resolve()
        sys.path.insert(0, str(file.parent))  # for modules in the same folder
        spec = importlib.util.spec_from_file_location(file.stem, file)
        assert spec is not None
        assert spec.loader is not None
        module = sys.modules[file.stem] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    else:
        module = importlib.import_module(source)
    found: Model | None = getattr(module, function, None)
    if not callable(found):
        known = [word for word, value in vars(module).items() if callable(value) and not word.startswith("_")]
        raise UnknownNameError.of(f"model {name!r}: it has no function {function!r}", function, known)
    return found


def command_model(text: str) -> Model:
    """Return a function that runs a program, which reads the scene as JSON and writes the signals as columns of CSV."""
    words = shlex.split(text)
    if not any(SIGNAL_FILE in word for word in words):
        raise ConfigurationError(f"command {text!r}: add {SIGNAL_FILE} for the file that the program writes.")
    if shutil.which(words[0]) is None:
        raise ConfigurationError(f"command {text!r}: no executable program {words[0]!r} is found here.")

    def simulate(scene: Scene) -> Any:
        import pandas as pd

        with tempfile.TemporaryDirectory() as folder:
            scene_file, signal_file = Path(folder) / "scene.json", Path(folder) / "signals.csv"
            bearing = load_bearing(scene.bearing)
            known = {"rolling_elements": bearing.rolling_elements, "orders": vars(bearing.orders)}
            scene_file.write_text(json.dumps(scene_dict(scene) | known), encoding="utf-8")
            command = [w.replace(SCENE_FILE, str(scene_file)).replace(SIGNAL_FILE, str(signal_file)) for w in words]
            done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace")
            if done.returncode or not signal_file.is_file():
                said = (done.stderr.strip() or done.stdout.strip()).rpartition("\n")[2]
                raise RuntimeError(f"the program ended with exit code {done.returncode} and wrote no signals: {said}")
            return pd.read_csv(signal_file)

    return simulate


def _worked_s() -> float:
    """Processor time of this process and of its finished child processes [s]."""
    spent = os.times()
    return time.process_time() + spent.children_user + spent.children_system


if __name__ == "__main__":  # the function is imported by its module's name, because its results are pickled
    serve_calls(lambda: importlib.import_module("srbval.models.outside.run").run_requested_model)
