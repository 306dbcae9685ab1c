"""Process in which a model from outside runs: ``python -m srbval.models.outside.process``.

Every outcome is returned as a value: outputs of a run, a status with its reason, or an exception for wrong input.
"""

import contextlib
import importlib
import importlib.util
import json
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, cast

from srbval.arrays import FloatArray
from srbval.bearing import load_bearing
from srbval.errors import ConfigurationError, DataError, SrbvalError, UnknownNameError
from srbval.models.outside.names import COMMAND, FMU, entry_points
from srbval.models.outside.signals import UnusableSignalsError, recorded_columns, signals_of
from srbval.models.run import RunStatus
from srbval.models.run_file import scene_dict
from srbval.processes.machine import limit_memory, limit_resource
from srbval.processes.worker import serve_calls
from srbval.scene import Scene

Model = Callable[[Scene], Any]
SCENE_FILE, SIGNAL_FILE = "{scene_json}", "{out_csv}"  # placeholders in a command
WARM_UP_S = 0.01  # length of a first run that is not timed: delayed imports, compiling
REASON = "the signals are finite and not constant; nothing else is checked for a model from outside"


class OutsideResult(NamedTuple):
    """Result of a model from outside: status, array `Outputs.out` if the run succeeded, and computing times [s]."""

    status: RunStatus
    reason: str
    out: FloatArray | None = None
    wall_s: float = 0.0
    cpu_s: float = 0.0


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
        return OutsideResult(RunStatus.RAISED, _place_and_text(error))


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

        return cast(Model, load_fmu(Path(place)))
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
    if not words or not any(SIGNAL_FILE in word for word in words):
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


def _place_and_text(error: BaseException) -> str:
    """Describe an exception in one line, with the file and line of the model's code at which it occurred."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if f.filename != __file__ and "-packages" not in f.filename and f.filename[:1] != "<"]
    place = f", in {Path(own[-1].filename).name} line {own[-1].lineno}" if own else ""
    return f"{type(error).__name__}: {' '.join(str(error).split())[:300]}{place}"


def _worked_s() -> float:
    """Processor time of this process and of its finished child processes [s]."""
    spent = os.times()
    return time.process_time() + spent.children_user + spent.children_system


if __name__ == "__main__":  # the function is imported by its module's name, because its results are pickled
    serve_calls(lambda: importlib.import_module("srbval.models.outside.process").run_requested_model)
