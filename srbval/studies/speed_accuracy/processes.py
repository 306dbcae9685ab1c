"""What only a new process can show: compile time, start-up time, peak memory.

Run as ``python -m srbval.studies.speed_accuracy.processes compile`` or ``... memory SECONDS`` it is such a process, and
prints one JSON object.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from srbval.errors import NumericsError
from srbval.models.simulate import Step, simulate
from srbval.models.solvers import SOLVERS
from srbval.progress import Progress, silent
from srbval.storage.installation import child_environment
from srbval.studies.machine import peak_bytes
from srbval.studies.scenes import bench_scene

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
SIMULATE = ("-m", "srbval", "simulate", "--seconds", "0.1", "--json")
CHILD = ("-m", "srbval.studies.speed_accuracy.processes")
SHORTEST_S = 0.001  # simulated, to compile what a run needs


def measure_processes(starts: int, memory_s: float, progress: Progress = silent) -> dict[str, Any]:
    """Start with an empty kernel store in a temporary folder, which the later processes find filled.

    Compile time of all solvers' kernels, and each one's part [s]; wall time of a later ``srbval simulate --seconds
    0.1``, process start included, best of `starts` [s]; peak memory of a run of `memory_seconds` [bytes], None where
    the system does not tell.
    """
    with tempfile.TemporaryDirectory(prefix="srbval-bench-") as folder:
        store = Path(folder)
        progress("compile from nothing", 0.0)
        compiled = json.loads(_run(store, *CHILD, "compile"))
        _start(store)  # fills what only the command itself needs
        progress("start again", 0.0)
        second_start_s = min(_start(store) for _ in range(starts))
        progress("read the memory", 0.0)
        memory = json.loads(_run(store, *CHILD, "memory", str(memory_s)))
        progress("read the memory", 1.0)
    return compiled | {"second_start_s": second_start_s} | memory


def _start(store: Path) -> float:
    started = time.perf_counter()
    _run(store, *SIMULATE)
    return time.perf_counter() - started


def _run(store: Path, *arguments: str) -> str:
    env = os.environ | ONE_THREAD | {"NUMBA_CACHE_DIR": str(store)} | child_environment()
    done = subprocess.run([sys.executable, "-P", *arguments], env=env, capture_output=True, text=True, check=False)
    if done.returncode:
        end = done.stderr.strip()[-300:]
        raise NumericsError(f"bench: python {' '.join(arguments)} ended with {done.returncode}: {end}")
    return done.stdout


def _compile_all() -> dict[str, Any]:
    """Compile time of the kernels behind each solver, in the order they are named: shared ones count once."""
    scenes = [bench_scene("play0-outer", solver=solver, seconds=SHORTEST_S, settle_s=0.0) for solver in SOLVERS]
    times = {scene.solver.name: simulate(scene, step=Step.UNCHECKED).compile_s for scene in scenes}
    return {"compile_s": sum(times.values()), "compile_by_solver_s": times}


def _peak_memory(seconds: float) -> dict[str, Any]:
    run = simulate(bench_scene("play0-outer", solver="ode4", seconds=seconds, settle_s=0.0), step=Step.UNCHECKED)
    return {"memory_seconds": run.seconds, "peak_bytes": peak_bytes()}


if __name__ == "__main__":
    print(json.dumps(_compile_all() if sys.argv[1] == "compile" else _peak_memory(float(sys.argv[2]))))
