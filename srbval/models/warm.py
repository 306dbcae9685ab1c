"""Kernels compiled apart: in a process that then ends, so that a run only loads them from the store.

What a compiler has taken stays with its process: 430 MB where a run by itself needs 250. And a process apart can be
interrupted at any time, a compiler only between its kernels. Results do not depend on who compiled, see `jit.kernel`.

``python -m srbval.models.warm MODEL`` is that other process.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterable
from pathlib import Path

import srbval
from srbval.errors import SrbvalError

SHORTEST_S = 0.001  # simulated, to compile what a run needs
WITHOUT_KERNELS = ("kinematic", "impulse")

_ready: set[str] = set()
_loaded: set[str] = set()
_lock = threading.RLock()


def is_compiled(model: str) -> bool:
    """Whether the kernels of `model` are in the store, or nothing is to be compiled."""
    import numba

    return model in WITHOUT_KERNELS or bool(vars(numba.config)["DISABLE_JIT"]) or _mark(model).exists()


def compile_apart(model: str) -> float:
    """Make sure that the kernels of `model` are in the store before this process needs them; seconds it took.

    Nothing happens where they are there already, where numba is switched off, and within the process apart itself. If
    that process fails, whatever is missing is compiled here when it is used.
    """
    with _lock:
        if model in _ready:
            return 0.0
        _ready.add(model)
        if is_compiled(model):
            return 0.0
        started = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-P", "-m", "srbval.models.warm", model],
            env=os.environ | package_path(), stdin=subprocess.DEVNULL, capture_output=True, check=False,
        )  # fmt: skip
        if done.returncode == 0:
            with contextlib.suppress(OSError):
                _mark(model).touch()
        return time.perf_counter() - started


def load_kernels(models: Iterable[str]) -> None:
    """Load the kernels of `models` into this process; compile apart what is missing.

    For whoever runs several models in threads or times them: no run then waits for another's kernels.
    """
    with _lock:
        for model in sorted(set(models) - set(WITHOUT_KERNELS) - _loaded):
            _loaded.add(model)
            compile_apart(model)
            with contextlib.suppress(SrbvalError):  # the run itself will say what is wrong
                _shortest_run(model)


def package_path() -> dict[str, str]:
    """Environment in which a child process finds this very package."""
    here = str(Path(srbval.__file__).parent.parent)
    return {"PYTHONPATH": os.pathsep.join([here, *filter(None, [os.environ.get("PYTHONPATH")])])}


def _mark(model: str) -> Path:
    """A file that stands in the store when the kernels of `model` do, for this processor and this numba."""
    import numba
    from llvmlite import binding

    from srbval.models.jit import kernel_store

    machine = (numba.__version__, sys.version, binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten())
    return kernel_store() / f"compiled-{model}-{hashlib.sha256(repr(machine).encode()).hexdigest()[:12]}"


def _shortest_run(model: str) -> None:
    from srbval.models.simulate import simulate
    from srbval.scene import paper_scene

    simulate(paper_scene(model=model, duration_s=SHORTEST_S, settle_s=0.0))


if __name__ == "__main__":
    from srbval.models import warm

    warm._ready.update(sys.argv[1:])
    for name in sys.argv[1:]:
        _shortest_run(name)
