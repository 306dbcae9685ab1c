"""What only a new process can show: compile time, start-up time, peak memory."""

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from srbval.errors import NumericsError
from srbval.progress import Progress, silent
from srbval.storage.installation import child_environment
from srbval.studies.scenes import BenchSettings

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
SIMULATE = ("-m", "srbval", "simulate", "--seconds", "0.1", "--json")
CHILD = ("-m", "srbval.studies.speed_accuracy.child")


@dataclass(frozen=True, kw_only=True)
class Processes:
    """Compile time of all solvers' kernels, and each one's part [s]; wall time of a later ``srbval simulate
    --seconds 0.1`` with kernels in store, process start included, best of several [s]; peak memory of a run of
    `memory_seconds` [bytes], None where the system does not tell.
    """

    compile_s: float
    compile_by_solver_s: dict[str, float]
    second_start_s: float
    peak_bytes: int | None
    memory_seconds: float


def measure_processes(settings: BenchSettings, progress: Progress = silent) -> Processes:
    """Start with an empty kernel store in a temporary folder, which the later processes find filled."""
    with tempfile.TemporaryDirectory(prefix="srbval-bench-") as folder:
        store = Path(folder)
        progress("compile from nothing", 0.0)
        compiled = json.loads(_run(store, *CHILD, "compile"))
        _start(store)  # fills what only the command itself needs
        progress("compile from nothing", 1.0)
        progress("start again", 0.0)
        second_start_s = min(_start(store) for _ in range(settings.starts))
        progress("start again", 1.0)
        progress("read the memory", 0.0)
        memory = json.loads(_run(store, *CHILD, "memory", str(settings.memory_s)))
        progress("read the memory", 1.0)
    return Processes(
        compile_s=compiled["compile_s"],
        compile_by_solver_s=compiled["by_solver"],
        second_start_s=second_start_s,
        peak_bytes=memory["peak_bytes"],
        memory_seconds=memory["seconds"],
    )


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
