"""The process in which a model from outside runs, ``python -m srbval.models.outside.process``.

Whatever the model does, the answer is a value: the columns of a run, a status with its reason, or a user's error.
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
from srbval.models.outside.signals import UnusableSignalsError, recorded, signals_of
from srbval.models.run import RunStatus
from srbval.models.run_file import scene_dict
from srbval.processes.machine import limit_memory, limit_resource
from srbval.processes.worker import serve_calls
from srbval.scene import Scene

Model = Callable[[Scene], Any]
SCENE_FILE, SIGNAL_FILE = "{scene_json}", "{out_csv}"  # places in the text of a command
WARM_UP_S = 0.01  # simulated first and not timed: imports within functions, compiling
REASON = "its signals are finite and not constant; no more is checked of a model from outside"


class Answer(NamedTuple):
    """How a run ended, the columns of `outputs` if it ended well, and the time of the model's call [s]."""

    status: RunStatus
    reason: str
    out: FloatArray | None = None
    wall_s: float = 0.0
    cpu_s: float = 0.0


def answer(request: tuple[Scene, float]) -> Answer | SrbvalError:
    """Run the scene's model with so much memory [bytes].

    A wrong name or file is an error, which is returned; whatever the model itself raises is a status.
    """
    scene, memory = request
    limit_resource("RLIMIT_CORE", 0)  # a crash leaves no memory dump
    limit_memory(memory)
    try:
        return run_model(load_model(scene.model), scene)
    except SrbvalError as error:
        kind = next(kind for kind in (ConfigurationError, DataError, SrbvalError) if isinstance(error, kind))
        return kind(str(error))  # not every error can be pickled
    except MemoryError as error:
        reason = f"it asked for more memory than {memory / 1e9:g} GB, its limit ({error})"
        return Answer(RunStatus.OUT_OF_MEMORY, reason)
    except BaseException as error:  # the border where foreign code meets this program; SystemExit too
        return Answer(RunStatus.RAISED, _place_and_text(error))


def run_model(model: Model, scene: Scene) -> Answer:
    """Call the model, first for a short scene, and take its signals."""
    try:
        with contextlib.suppress(Exception):  # the whole run raises it again, unless the short scene alone fails
            model(replace(scene, duration_s=min(WARM_UP_S, scene.duration_s), settle_s=0.0))
        wall_s, cpu_s = time.perf_counter(), _worked_s()
        returned = model(scene)
        wall_s, cpu_s = time.perf_counter() - wall_s, _worked_s() - cpu_s
        signals = signals_of(returned)
        own_s = wall_s if signals.wall_s is None else min(float(signals.wall_s), wall_s)
        return Answer(RunStatus.OK, REASON, recorded(signals, scene), own_s, max(cpu_s - (wall_s - own_s), 0.0))
    except UnusableSignalsError as error:
        return Answer(*error.args)
    except SrbvalError as error:  # of the bundled model, which it may call
        return Answer(RunStatus.RAISED, _place_and_text(error))


def load_model(name: str) -> Model:
    """The model's function of a scene; raises what importing its file raises, `SrbvalError` for a wrong name."""
    place = entry_points().get(name, name)
    if place.startswith(COMMAND):
        return program(place.removeprefix(COMMAND))
    if place.endswith(FMU):
        from srbval.models.outside.fmu import load_fmu

        return cast(Model, load_fmu(Path(place)))
    source, _, function = place.rpartition(":")
    if source.endswith(".py"):
        file = Path(source).resolve()
        sys.path.insert(0, str(file.parent))  # for what lies beside it
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


def program(text: str) -> Model:
    """A program as a function of a scene: it reads the scene from a JSON file and writes signals as columns of CSV."""
    words = shlex.split(text)
    if not words or not any(SIGNAL_FILE in word for word in words):
        raise ConfigurationError(f"command {text!r}: name the file that it writes, as {SCENE_FILE} {SIGNAL_FILE}.")
    if shutil.which(words[0]) is None:
        raise ConfigurationError(f"command {text!r}: {words[0]!r} is no program that may be executed here.")

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
    """An exception in a line, with the line of the model's code that it came through last."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if f.filename != __file__ and "-packages" not in f.filename and f.filename[:1] != "<"]
    place = f", in {Path(own[-1].filename).name} line {own[-1].lineno}" if own else ""
    return f"{type(error).__name__}: {' '.join(str(error).split())[:300]}{place}"


def _worked_s() -> float:
    """Processor time of this process and of those that it started and waited for [s]."""
    spent = os.times()
    return time.process_time() + spent.children_user + spent.children_system


def load() -> Callable[[Any], Any]:
    """Return the function that answers."""
    from srbval.models.outside import process  # under its own name: answers are pickled

    return process.answer


if __name__ == "__main__":
    serve_calls(load)
