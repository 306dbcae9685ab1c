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
from srbval.storage.installation import child_environment, package_folder
from srbval.storage.sources import content_version

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


def precompile(*models: str, jobs: int | None = None) -> float:
    """Make sure that the kernels of `models` are in the cache before this process needs them; seconds it took.

    At most `jobs` are compiled at a time (default: all), each by a process of its own. Nothing happens where they are
    there already, where numba is switched off, and within the compiling process itself. If such a process fails,
    whatever is missing is compiled here when it is used.
    """
    with _lock:
        missing = [model for model in models if model not in _requested and not is_compiled(model)]
        _requested.update(models)
        started, at_once = time.perf_counter(), jobs or max(1, len(missing))
        for first in range(0, len(missing), at_once):
            with contextlib.suppress(OSError), contextlib.ExitStack() as running:
                compilers = {model: running.enter_context(_compiler(model)) for model in missing[first:][:at_once]}
                for model, compiler in compilers.items():
                    if compiler.wait() == 0:
                        _marker(model).touch()
        return time.perf_counter() - started if missing else 0.0


def _compiler(model: str) -> subprocess.Popen[bytes]:
    """A process that compiles the kernels of `model`; it ends when its input does, so it does not outlive this one."""
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "srbval.models.precompile", model],
        env=os.environ | child_environment(), stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


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
