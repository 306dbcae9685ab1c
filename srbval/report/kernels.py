"""The model's kernels, compiled in a process of their own before the first report.

A process that compiles a kernel gets other last digits than one that loads it from the store; so the first report
would differ from all later ones.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from srbval.errors import NumericsError
from srbval.models.jit import kernel_store

COMPILE = "import srbval; srbval.simulate(srbval.paper_scene(duration='1 ms', settle='0 s'))"


def kernels_are_stored() -> bool:
    """Whether a process before this one has compiled what a report needs, or nothing is to be compiled."""
    return bool(os.environ.get("NUMBA_DISABLE_JIT")) or _mark().exists()


def store_kernels() -> None:
    """Compile in another process, and leave a mark; `NumericsError` with that process's last line if it fails."""
    made = subprocess.run([sys.executable, "-c", COMPILE], capture_output=True, text=True, check=False)
    if made.returncode:
        said = made.stderr.strip().splitlines() or ["it said nothing"]
        raise NumericsError(f"compiling the model failed: {said[-1]} Try `srbval doctor`.")
    try:
        _mark().touch()
    except OSError:
        return  # nothing could be stored: each process compiles for itself


def _mark() -> Path:
    return kernel_store() / "report-ready"
