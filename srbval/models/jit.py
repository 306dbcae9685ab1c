"""Compiles kernels with numba and keeps them in a cache; no other module uses numba.

Set ``NUMBA_DISABLE_JIT=1`` to run every kernel as plain Python, for debugging and for coverage.

A separate process compiles the kernels into the cache; runs only load the kernels. When the process ends, its 430 MB
are free again (a run needs 250 MB), and it can be stopped at any time, whereas compiling within a run can be
interrupted only between kernels. Results do not depend on the process that compiled, see `kernel_part`.
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
from functools import cache, partial
from importlib import metadata
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from srbval.errors import DataError
from srbval.models.native import Kernel, add_entry
from srbval.models.solvers import FAMILIES, METHODS
from srbval.processes.machine import load_average, usable_cores
from srbval.storage.files import atomic_write
from srbval.storage.installation import KERNEL_VARIABLE, KERNELS, cache_folder, child_environment, package_folder
from srbval.storage.sources import content_version

if TYPE_CHECKING:  # imports for types alone do not change the version of the kernels
    from srbval.scene import Scene

# Sums may be reordered and products contracted to vectorise loops. Infinities and NaN are kept to detect failed runs.
FAST_MATH = {"reassoc", "contract", "nsz", "arcp"}

# `_nrt`: no reference counting. `forceinline`: functions are inlined into the kernels that call them.
OPTIONS: dict[str, Any] = {
    "nogil": True,
    "fastmath": FAST_MATH,
    "error_model": "numpy",
    "_nrt": False,
    "forceinline": True,
    "no_cfunc_wrapper": True,
    "no_cpython_wrapper": True,
}
WITHOUT_KERNELS = ("kinematic", "impulse")
RING, RATES = "ring", "rates"  # parts of kernels' names, see `kernels_of`
OIL_SUFFIX, FREE_SUFFIX = "-oil", "-free"  # suffixes of kernels' names

WITHOUT_EFFECT = (KERNEL_VARIABLE, "NUMBA_NUM_THREADS")  # settings of numba that do not change results

PACE_ROUNDS = 10**6  # rounds of a loop that takes some 30 ms
# Time to compile a kernel of the full model, divided by the time of that loop; factor for a kernel of the slices model.
COMPILE_WORK, SLICES_WORK = {RING: 50.0, RATES: 320.0} | dict.fromkeys(FAMILIES, 420.0), 1.25
CHECKSUM_BYTES = hashlib.sha256().digest_size
_unregistered: list[tuple[Callable[..., Any], dict[str, Any]]] = []  # functions that numba does not know, options
_requested_kernels: set[str] = set()
_cached_kernels: set[str] = set()  # kernels that are in the cache
_kernel_files: set[str] = set()  # names of files with machine code that this process read or wrote
_lock = threading.RLock()


def kernel(function: Callable[..., None]) -> Callable[..., None]:
    """Decorator for kernels that Python calls: compile for this processor, cache on disk, run without interpreter lock.

    Kernels use the arrays that they receive and create none, and return nothing. They are compiled without reference
    counting, which would count every array of a parameter tuple at each call.
    """
    if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
        return function
    return Kernel(function.__name__, partial(_stored_or_compiled, function, kernel_cache_folder()))


def kernel_part(function: Callable[..., Any], **more: Any) -> Callable[..., Any]:
    """Decorator for functions that kernels call: compiled into kernels, plain Python elsewhere; `more`: numba options.

    The functions are inlined. Otherwise each kernel would contain its own copy, with a different order of sums, and the
    linker would use the copy loaded first. The last digits of results would then depend on the runs before in the same
    process, and rattling rollers amplify such differences.
    """
    _unregistered.append((function, OPTIONS | more))
    return function


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator like `kernel_part`, but numba inlines before it infers types: compiles faster if few places call it."""
    part: Any = kernel_part(function)
    part.targetoptions, part.py_func = {"inline": "always"}, function  # by these numba finds what it inlines
    return function


@cache
def load_numba() -> Any:
    """Import numba and set it to use vectors of 512 bits if this processor has them.

    The default is 256 bits; with 512 bits, runs take 0.84 to 0.93 of the time.
    """
    import numba.extending
    from llvmlite import binding

    settings, features = vars(numba.config), binding.get_host_cpu_features()
    if features.get("avx512f") and not settings["CPU_FEATURES"]:
        settings["CPU_FEATURES"] = f"{features.flatten()},-prefer-256-bit"
    return numba


def _stored_or_compiled(function: Callable[..., Any], folder: Path, form: str, arguments: tuple[Any, ...]) -> bytes:
    """Machine code of a kernel for arguments of a form: read from its file in the cache `folder`, or compiled."""
    file = folder / f"{function.__name__}-{_digest(form)}.kernel"
    stored = _machine_code(file)
    if stored is None:
        stored = compile_function(function, arguments)
        with contextlib.suppress(DataError), atomic_write(file) as part:
            part.write_bytes(_checksum(file, stored) + stored)
            _kernel_files.add(file.name)
    return stored


def compile_function(function: Callable[..., Any], arguments: tuple[Any, ...]) -> bytes:
    """Compile a kernel for arguments of these types; the result is the object file that `native.load` loads."""
    numba = load_numba()
    for_kernels, for_parts = _compilers()
    while _unregistered:
        part, options = _unregistered.pop()
        numba.extending.register_jitable(**options, pipeline_class=for_parts)(part)
    compiler = numba.njit(pipeline_class=for_kernels, **OPTIONS)(function)
    compiler.compile(tuple(map(numba.typeof, arguments)))
    (result,) = compiler.overloads.values()
    machine_code: bytes = result.library._get_compiled_object()
    return machine_code


@cache
def _compilers() -> tuple[Any, Any]:
    """Make two compiler classes for numba: for kernels, and for their parts, which need no machine code of their own.

    Passes for features that kernels do not use (closures, array expressions, ``with`` blocks, literals) are left out.
    """
    from numba.core import typed_passes as typed
    from numba.core import untyped_passes as untyped
    from numba.core.codegen import JITCodeLibrary
    from numba.core.compiler import CompilerBase
    from numba.core.compiler_machinery import PassManager, register_pass
    from numba.core.lowering import Lower

    passes = (
        untyped.TranslateByteCode,
        untyped.FixupArgs,
        untyped.IRProcessing,
        untyped.RewriteSemanticConstants,
        untyped.DeadBranchPrune,
        untyped.GenericRewrites,
        untyped.InlineInlinables,
        untyped.DeadBranchPrune,
        untyped.ReconstructSSA,
        typed.NopythonTypeInference,
        typed.PreLowerStripPhis,
        typed.IRLegalization,
    )

    class WithEntry(Lower):
        def lower(self) -> None:
            super().lower()
            add_entry(self.library, self.context, self.fndesc)

    @register_pass(mutates_CFG=True, analysis_only=False)
    class KernelLowering(typed.NativeLowering):
        _name = "kernel_lowering"
        lowering_class = WithEntry

    class Part(JITCodeLibrary):
        codegen = property(lambda self: self)

        def _finalize_final_module(self) -> None:
            self._finalized = True

        def get_pointer_to_function(self, _: str) -> int:
            return 0  # Python calls no part

        def set_env(self, *_: Any) -> None:
            """Ignore numba's environment, because there is no machine code that needs it."""

    def compiler(library: type, lowering: type) -> type:
        class Compiler(CompilerBase):
            def define_pipelines(self) -> Any:
                self.state.library = library(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
                self.state.library.enable_object_caching()
                self.state.type_annotation = None
                manager = PassManager("kernel")
                for one in (*passes, lowering, typed.NoPythonBackend):
                    manager.add_pass(one, one.__name__)
                manager.finalize()
                return [manager]

        return Compiler

    return compiler(JITCodeLibrary, KernelLowering), compiler(Part, typed.NativeLowering)


def _machine_code(file: Path) -> bytes | None:
    """Read the machine code in a kernel's file; None if the file is missing or (with a printed warning) damaged."""
    try:
        content = file.read_bytes()
    except (OSError, ValueError):  # a damaged list may contain a name with a zero byte
        return None
    if content[:CHECKSUM_BYTES] == _checksum(file, content[CHECKSUM_BYTES:]):
        _kernel_files.add(file.name)
        return content[CHECKSUM_BYTES:]
    print(f"srbval: the compiled kernel {file} is damaged or of another version; it is compiled again", file=sys.stderr)
    with contextlib.suppress(OSError):
        file.unlink()
    return None


def _checksum(file: Path, content: bytes) -> bytes:
    """SHA-256 of a kernel's machine code and of its folder and file names, which identify sources and machine."""
    return hashlib.sha256(f"{file.parent.name}/{file.name}\n".encode() + content).digest()


@cache
def kernel_cache_folder() -> Path:
    """Folder of the kernels compiled from this version of the kernels' sources and of all modules that they import.

    All copies of the package with these sources share the folder.
    """
    package = package_folder()
    sources = (package / "models").rglob("*_kernel.py")
    modules = (".".join(source.relative_to(package.parent).with_suffix("").parts) for source in sources)
    return cache_folder(KERNELS) / content_version(*sorted(modules))


def precompile(*scenes: Scene, jobs: int | None = None) -> float:
    """Compile the kernels of `scenes` that are missing in the cache, and return the time it took [s].

    `jobs` processes, by default one for each usable core, share the kernels. If another program compiles at the moment,
    this function first waits for it. Nothing is compiled if numba is switched off or within a compiling process. If a
    compiling process fails, the calling process compiles the missing kernels when it uses them.
    """
    from filelock import FileLock

    with _lock:
        missing = [kernel for kernel in missing_kernels(*scenes) if kernel not in _requested_kernels]
        if not missing:
            return 0.0
        _requested_kernels.update(missing)
        started = time.perf_counter()
        with contextlib.suppress(OSError), contextlib.ExitStack() as running:
            kernel_cache_folder().mkdir(parents=True, exist_ok=True)
            running.enter_context(FileLock(kernel_cache_folder() / "all.lock"))
            missing = [kernel for kernel in missing if not _is_stored(kernel)]  # others may have compiled some
            for process in [running.enter_context(_start_compiler(one)) for one in _split_kernels(missing, jobs)]:
                process.wait()
        return time.perf_counter() - started


def expected_compile_s(*scenes: Scene) -> float:
    """Estimate the time that `precompile` will take under the present load [s], from the speed of a short loop."""
    started = time.process_time()
    sum(map(hash, range(PACE_ROUNDS)))
    pace_s, longest = time.process_time() - started, 0.0
    for kernels in _split_kernels(missing_kernels(*scenes), None):
        parts = [kernel.split("-") for kernel in kernels]
        works = [COMPILE_WORK[part] * (SLICES_WORK if model == "slices" else 1.0) for model, part, *_ in parts]
        longest = max(longest, sum(works))
    return pace_s * longest * max(1.0, (load_average() or 0.0) / usable_cores())


def _split_kernels(kernels: list[str], jobs: int | None) -> list[list[str]]:
    """Divide kernels among the compiling processes: `jobs`, or one for each usable core."""
    count = min(len(kernels), jobs or usable_cores())
    return [kernels[first::count] for first in range(count)]


def kernels_of(scene: Scene) -> list[str]:
    """Names of the kernels that a run of the scene needs, such as ``full-rates-1``: model, part, number of cages.

    Models with the full model's equations need two parts: ``rates``, the time derivative of the state, and a step of
    the solver, ``explicit`` or ``leapfrog``. The planar model needs only the part ``ring``. The line
    model uses the kernels of the full model. With oil the name ends with ``-oil``, with free rollers with ``-free``.
    """
    if scene.model in WITHOUT_KERNELS or scene.solver.name not in METHODS:
        return []
    parts = (RING,) if scene.model == "planar" else (RATES, FAMILIES[METHODS[scene.solver.name].family])
    end = ("" if scene.oil is None else OIL_SUFFIX) + (FREE_SUFFIX if scene.bodies.free_rollers else "")
    model = "full" if scene.model == "line" else scene.model
    return [f"{model}-{part}-{scene.bodies.cages}{end}" for part in parts]


def missing_kernels(*scenes: Scene) -> list[str]:
    """Names of the kernels that the scenes need and that are not in the cache."""
    wanted = () if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0" else chain.from_iterable(map(kernels_of, scenes))
    return [kernel for kernel in dict.fromkeys(wanted) if not (kernel in _cached_kernels or _is_stored(kernel))]


def _is_stored(kernel: str) -> bool:
    """True if a kernel's machine code is in the cache and undamaged; a kernel once found is not checked again."""
    try:
        names = _list_of(kernel).read_text("ascii").split()
    except (OSError, ValueError):
        return False
    if names and all(_machine_code(kernel_cache_folder() / name) is not None for name in names):
        _cached_kernels.add(kernel)
    return kernel in _cached_kernels


def _start_compiler(kernels: Iterable[str]) -> subprocess.Popen[bytes]:
    """Start a process that compiles kernels; it ends when the calling process ends, which closes its input."""
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "srbval.models.precompile", *kernels],
        env=os.environ | child_environment(),
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def compile_in_this_process(scene: Scene) -> None:
    """Compile the scene's kernels in the current process at their first use, not in a child process."""
    _requested_kernels.update(kernels_of(scene))


def compile_and_list(kernel: str, compile_kernel: Callable[[], object]) -> None:
    """Compile a kernel in this process and write the list of its files, by which other processes find it."""
    _kernel_files.clear()
    compile_kernel()
    with contextlib.suppress(DataError), atomic_write(_list_of(kernel)) as part:
        part.write_text("\n".join(sorted(_kernel_files)), "ascii")


def _list_of(kernel: str) -> Path:
    """Path of the text file with the names of the files that contain a kernel's machine code for this machine."""
    return kernel_cache_folder() / f"compiled-{kernel}-{_digest()}"


def _digest(form: str = "") -> str:
    return hashlib.sha256(f"{form} {machine()}".encode()).hexdigest()[:16]


@cache
def machine() -> str:
    """Text of processor, Python, library versions and numba settings, on which the last digits of results depend."""
    from llvmlite import binding

    processor = binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()
    versions = [metadata.version(name) for name in ("numba", "llvmlite", "numpy", "scipy")]
    settings = sorted(f"{k}={v}" for k, v in os.environ.items() if k.startswith("NUMBA_") and k not in WITHOUT_EFFECT)
    return repr((sys.version, processor, versions, settings))
