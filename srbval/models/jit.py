"""Compilation of kernels by numba, and the cache that keeps them; no other module names numba.

Set ``NUMBA_DISABLE_JIT=1`` to run every kernel as plain Python, for stepping through and for coverage.

Kernels are compiled into the cache by a process that then ends; runs only load them. A compiler's memory stays with its
process: 430 MB, while a run needs 250. A separate process can be interrupted at any time, a compiler only between its
kernels. Results do not depend on the process that compiled, see `kernel`.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable
from functools import cache
from importlib import metadata
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from srbval.models.solvers import FAMILIES, METHODS
from srbval.processes.machine import usable_cores
from srbval.storage.cache import KERNEL_VARIABLE, KERNELS, cache_folder
from srbval.storage.installation import child_environment, package_folder
from srbval.storage.sources import content_version

if TYPE_CHECKING:  # what only types are taken from does not count for the version of the kernels
    from srbval.scene import Scene

# Sums may be reordered and products contracted, so that loops vectorise. Infinities and NaN keep their
# meaning: a broken run must stay visible.
FAST_MATH = {"reassoc", "contract", "nsz", "arcp"}

# `_nrt`: without reference counting. `forceinline`: within the kernels that call it.
OPTIONS: dict[str, Any] = {
    "nogil": True,
    "fastmath": FAST_MATH,
    "error_model": "numpy",
    "_nrt": False,
    "forceinline": True,
    "no_cfunc_wrapper": True,
}
WITHOUT_KERNELS = ("kinematic", "impulse")
RING, RATES = "ring", "rates"  # what a kernel does, see `kernels_of`
OIL, FREE_ROLLERS = "-oil", "-free"  # at the end of their names

WITHOUT_EFFECT = (KERNEL_VARIABLE, "NUMBA_NUM_THREADS")  # on numbers, of numba's settings

_requested: set[str] = set()
_lock = threading.RLock()


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile `function`, which Python calls, for the processor at hand, kept on disk, without the interpreter lock.

    Kernels work in arrays they are given and make none: they are compiled without reference counting, which would
    count every array of a parameter tuple in and out at each call.
    """
    numba = load_numba()
    settings = vars(numba.config)
    before = settings["CACHE_DIR"]
    settings["CACHE_DIR"] = str(kernel_cache_folder())
    try:
        compiled: Callable[..., Any] = numba.njit(cache=True, **OPTIONS)(function)
    finally:
        settings["CACHE_DIR"] = before
    return compiled


def kernel_part(function: Callable[..., Any], **more: Any) -> Callable[..., Any]:
    """Let kernels call `function`, which is compiled with each of them; called from Python it stays plain.

    A kernel's machine code calls no other function of this package. Otherwise it would carry weak copies of them, each
    optimised with its own order of sums, and the linker would take the copy that came into memory first: the last
    digits of a run would depend on the history of its process, and a rattling roller makes them grow.
    """
    options = OPTIONS | {"no_cpython_wrapper": True} | more
    part: Callable[..., Any] = load_numba().extending.register_jitable(**options)(function)
    return part


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Like `kernel_part`, but inlined before types are known: faster to compile if few places call it.

    Called from Python, it is compiled then.
    """
    part: Callable[..., Any] = load_numba().njit(inline="always", **OPTIONS)(function)
    return part


@cache
def load_numba() -> Any:
    """Import numba, set to use vectors of 512 bits if this processor has them.

    Its default is half of that, for programs that seldom use vectors. A lane group fills a vector of 512 bits: 0.84 to
    0.93 of the time.
    """
    import numba.extending
    from llvmlite import binding

    settings, features = vars(numba.config), binding.get_host_cpu_features()
    if features.get("avx512f") and not settings["CPU_FEATURES"]:
        settings["CPU_FEATURES"] = f"{features.flatten()},-prefer-256-bit"
    return numba


@cache
def kernel_cache_folder() -> Path:
    """Folder of the compiled kernels of exactly this version of the kernels' sources, and of all that these import.

    Numba checks only a kernel's own file, not the files it calls, when it decides if a cached kernel is valid.
    """
    package = package_folder()
    sources = (package / "models").rglob("*_kernel.py")
    modules = (".".join(source.relative_to(package.parent).with_suffix("").parts) for source in sources)
    return cache_folder(KERNELS) / content_version(*sorted(modules))


def is_compiled(*scenes: Scene) -> bool:
    """True if the kernels that `scenes` need are in the cache, or nothing is to be compiled."""
    return not _missing(scenes)


def precompile(*scenes: Scene, jobs: int | None = None) -> float:
    """Compile the kernels that `scenes` need and that the cache lacks; returns the seconds it took.

    If another process compiles, this one waits and then checks again.

    `jobs` processes compile at a time (default: one for each usable core), each a share of the kernels. Nothing happens
    if the cache has them, if numba is switched off, and within the compiling process itself. If such a process fails,
    this process compiles the missing kernels when it uses them.
    """
    from filelock import FileLock

    with _lock:
        missing = [kernel for kernel in _missing(scenes) if kernel not in _requested]
        if not missing:
            return 0.0
        _requested.update(missing)
        started = time.perf_counter()
        with contextlib.suppress(OSError), contextlib.ExitStack() as running:
            running.enter_context(FileLock(kernel_cache_folder() / "all.lock"))
            missing = [kernel for kernel in missing if not _marker(kernel).exists()]  # of which others compiled some
            share = -(-len(missing) // (jobs or usable_cores()))
            shares = [missing[first : first + share] for first in range(0, len(missing), share or 1)]
            for kernels, process in [(one, running.enter_context(_compiler(one))) for one in shares]:
                if process.wait() == 0:
                    for kernel in kernels:
                        _marker(kernel).touch()
        return time.perf_counter() - started


def kernels_of(scene: Scene) -> list[str]:
    """Names of the kernels that the scene's run needs: model, part, cages, oil, free rollers.

    Models with the full model's equations need their ``rates``, and the steps of the family of the scene's solver.
    """
    if scene.model in WITHOUT_KERNELS or scene.solver.name not in METHODS:
        return []
    parts = (RING,) if scene.model == "planar" else (RATES, FAMILIES[METHODS[scene.solver.name].coefficients.family])
    end = ("" if scene.oil is None else OIL) + (FREE_ROLLERS if scene.bodies.free_rollers else "")
    return [f"{scene.model}-{part}-{scene.bodies.cages}{end}" for part in parts]


def _missing(scenes: Iterable[Scene]) -> list[str]:
    """Kernels of the scenes that are not in the cache."""
    wanted = () if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0" else chain.from_iterable(map(kernels_of, scenes))
    return [kernel for kernel in dict.fromkeys(wanted) if not _marker(kernel).exists()]


def _compiler(kernels: Iterable[str]) -> subprocess.Popen[bytes]:
    """A process that compiles kernels; it ends when its input does, so it does not outlive this one."""
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "srbval.models.precompile", *kernels],
        env=os.environ | child_environment(),
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def compile_in_this_process(scene: Scene) -> None:
    """Let this process compile the kernels of the scene itself when it uses them, in place of a child process."""
    _requested.update(kernels_of(scene))


def _marker(kernel: str) -> Path:
    """File that exists if the cache has the kernel for this machine and installation.

    Numba keeps kernels by the path of their source, so that kernels of another environment are not found from here.
    """
    digest = hashlib.sha256(f"{machine()} {package_folder()}".encode()).hexdigest()[:12]
    return kernel_cache_folder() / f"compiled-{kernel}-{digest}"


@cache
def machine() -> str:
    """Processor, Python, libraries and settings of numba: numbers depend on them beside the sources."""
    from llvmlite import binding

    processor = binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()
    versions = [metadata.version(name) for name in ("numba", "llvmlite", "numpy", "scipy")]
    settings = sorted(f"{k}={v}" for k, v in os.environ.items() if k.startswith("NUMBA_") and k not in WITHOUT_EFFECT)
    return repr((sys.version, processor, versions, settings))
