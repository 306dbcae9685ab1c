"""Precompilation: kernels are compiled into the kernel cache by a process that then ends; runs only load them.

A compiler's memory stays with its process: 430 MB where a run by itself needs 250. And a process of its own can be
interrupted at any time, a compiler only between its kernels. Results do not depend on who compiled, see `jit.kernel`.

Numba looks only at a kernel's own file when it decides whether a cached one is still good, not at the kernels it calls;
so the cache's folder is named by the content of all of them.
"""

import contextlib
import hashlib
import os
import subprocess
import sys
import threading
import time
from functools import cache
from pathlib import Path

from srbval.storage.cache import KERNELS, cache_folder
from srbval.storage.content_version import content_version
from srbval.storage.own_package import child_environment, package_folder

WITHOUT_KERNELS = ("kinematic", "impulse")

_requested: set[str] = set()
_lock = threading.RLock()


@cache
def kernel_cache_folder() -> Path:
    """Folder of the compiled kernels of exactly this version of the kernels' sources, and of all that these import."""
    package = package_folder()
    sources = (package / "models").rglob("*_kernel.py")
    modules = (".".join(source.relative_to(package.parent).with_suffix("").parts) for source in sources)
    return cache_folder(KERNELS) / content_version(*sorted(modules))


def is_compiled(model: str) -> bool:
    """Whether the kernels of `model` are in the cache, or nothing is to be compiled."""
    import numba

    return model in WITHOUT_KERNELS or bool(vars(numba.config)["DISABLE_JIT"]) or _marker(model).exists()


def precompile(model: str) -> float:
    """Make sure that the kernels of `model` are in the cache before this process needs them; seconds it took.

    Nothing happens where they are there already, where numba is switched off, and within the compiling process itself.
    If that process fails, whatever is missing is compiled here when it is used.
    """
    with _lock:
        if model in _requested:
            return 0.0
        _requested.add(model)
        if is_compiled(model):
            return 0.0
        started = time.perf_counter()
        with contextlib.suppress(OSError):
            with subprocess.Popen(  # it ends when its input does, so it does not outlive this process
                [sys.executable, "-P", "-m", "srbval.models.precompile", model],
                env=os.environ | child_environment(), stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            ) as compiler:  # fmt: skip
                code = compiler.wait()
            if code == 0:
                _marker(model).touch()
        return time.perf_counter() - started


def compile_in_this_process(model: str) -> None:
    """Let this process compile the kernels of `model` itself when it uses them, in place of a child process."""
    _requested.add(model)


def _marker(model: str) -> Path:
    """A file that stands in the cache when the kernels of `model` do, for this processor and this numba."""
    import numba
    from llvmlite import binding

    machine = (numba.__version__, sys.version, binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten())
    digest = hashlib.sha256(repr(machine).encode()).hexdigest()[:12]
    return kernel_cache_folder() / f"compiled-{model}-{digest}"
