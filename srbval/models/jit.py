"""The one place that names numba: how kernels are compiled, and the cache in which they are kept.

Set ``NUMBA_DISABLE_JIT=1`` to run every kernel as plain Python, for stepping through and for coverage.

Kernels are compiled into the cache by a process that then ends; runs only load them. A compiler's memory stays with its
process: 430 MB where a run by itself needs 250. And a process of its own can be interrupted at any time, a compiler
only between its kernels. Results do not depend on who compiled, see `kernel`.
"""

import contextlib
import hashlib
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from srbval.storage.cache import KERNELS, cache_folder
from srbval.storage.installation import child_environment, package_folder
from srbval.storage.sources import content_version

# Sums may be reordered and products contracted, so that loops vectorise. Infinities and NaN keep their
# meaning: a broken run must stay visible.
FAST_MATH = {"reassoc", "contract", "nsz", "arcp"}

# `_nrt`: without reference counting. `forceinline`: within the kernels that call it.
OPTIONS: dict[str, Any] = {
    "cache": True, "nogil": True, "fastmath": FAST_MATH, "error_model": "numpy", "_nrt": False, "forceinline": True,
}  # fmt: skip
WITHOUT_KERNELS = ("kinematic", "impulse")

_requested: set[str] = set()
_lock = threading.RLock()


def kernel(function: Callable[..., Any], **more: Any) -> Callable[..., Any]:
    """Compile `function` for the processor at hand, kept on disk, releasing the interpreter lock.

    Kernels work in arrays they are given and make none: they are compiled without reference counting, which would
    count every array of a parameter tuple in and out at each call.

    A kernel's machine code calls no other kernel's. Otherwise it would carry weak copies of those, each optimised for
    its place with its sums in an order of its own, and the linker would take whichever came into memory first: the
    last digits of a run would depend on what its process had done before, and a rattling roller makes them grow.
    """
    import numba

    settings = vars(numba.config)
    before = settings["CACHE_DIR"]
    settings["CACHE_DIR"] = str(kernel_cache_folder())
    try:
        compiled: Callable[..., Any] = numba.njit(**(OPTIONS | more))(function)
    finally:
        settings["CACHE_DIR"] = before
    return compiled


def kernel_part(function: Callable[..., Any]) -> Callable[..., Any]:
    """As `kernel`, for a part of one kernel alone: written out in its place before types are known.

    It is not compiled by itself as well, unless it is called from Python: half a second to three saved for a large one.
    """
    return kernel(function, inline="always")


def exactly_rounded(function: Callable[..., Any]) -> Callable[..., Any]:
    """As `kernel`, but each operation is rounded as written, whatever stands around the call."""
    return kernel(function, fastmath=False)


@cache
def kernel_cache_folder() -> Path:
    """Folder of the compiled kernels of exactly this version of the kernels' sources, and of all that these import.

    Numba looks only at a kernel's own file when it decides whether a cached one is still good, not at those it calls.
    """
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
    """A file that stands in the cache when the kernels of `model` do, for this processor, numba and installation.

    Numba keeps kernels by the path of their source: those of another environment are compiled, but not found from here.
    """
    import numba
    from llvmlite import binding

    machine = (numba.__version__, sys.version, binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten())
    digest = hashlib.sha256(repr((*machine, str(package_folder()))).encode()).hexdigest()[:12]
    return kernel_cache_folder() / f"compiled-{model}-{digest}"
