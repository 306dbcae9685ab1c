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
import pickle
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

from srbval.errors import DataError
from srbval.models.solvers import FAMILIES, METHODS
from srbval.processes.machine import load_average, usable_cores
from srbval.storage.cache import KERNEL_VARIABLE, KERNELS, cache_folder
from srbval.storage.files import atomic_write
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

PACE_ROUNDS = 10**6  # of a loop that takes some 30 ms
WORK = {RING: 50.0, RATES: 320.0} | dict.fromkeys(FAMILIES, 420.0)  # times that loop for one kernel of the full model
SLICES_WORK = 1.25  # times as long for a kernel of the slices
CHECKSUM_BYTES = hashlib.sha256().digest_size
_requested: set[str] = set()
_found: set[str] = set()  # kernels in the cache
_used: set[str] = set()  # names of files with machine code that this process read or wrote
_lock = threading.RLock()


def kernel(function: Callable[..., Any]) -> Any:
    """Compile `function`, which Python calls, for the processor at hand, kept on disk, without the interpreter lock.

    Kernels work in arrays they are given and make none: they are compiled without reference counting, which would
    count every array of a parameter tuple in and out at each call.
    """
    compiled: Any = load_numba().njit(pipeline_class=_compilers()[0], **OPTIONS)(function)
    if compiled is not function:
        compiled._cache = _store(kernel_cache_folder(), function.__name__)  # of the sources as they are now
    return compiled


def kernel_part(function: Callable[..., Any], **more: Any) -> Callable[..., Any]:
    """Let kernels call `function`, which is compiled with each of them; called from Python it stays plain.

    A kernel's machine code calls no other function of this package. Otherwise it would carry weak copies of them, each
    optimised with its own order of sums, and the linker would take the copy that came into memory first: the last
    digits of a run would depend on the history of its process, and a rattling roller makes them grow.
    """
    options = OPTIONS | {"no_cpython_wrapper": True, "pipeline_class": _compilers()[1]} | more
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
def _compilers() -> tuple[Any, Any]:
    """Numba's compiler for kernels, and for their parts: intermediate code alone, since only kernels are called.

    Passes for what kernels do not use (closures, array expressions, ``with`` blocks, literals) are left out.
    """
    from numba.core import typed_passes as typed
    from numba.core import untyped_passes as untyped
    from numba.core.codegen import JITCodeLibrary
    from numba.core.compiler import CompilerBase
    from numba.core.compiler_machinery import PassManager

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
        typed.NativeLowering,
        typed.NoPythonBackend,
    )

    class Part(JITCodeLibrary):
        codegen = property(lambda self: self)

        def _finalize_final_module(self) -> None:
            self._finalized = True

        def get_pointer_to_function(self, _: str) -> int:
            return 0  # Python calls no part

        def set_env(self, *_: Any) -> None:
            """Do nothing: no machine code is there to need it."""

    def compiler(library: type) -> type:
        class Compiler(CompilerBase):
            def define_pipelines(self) -> Any:
                _resolve_operators_once(self.state.typingctx)
                self.state.library = library(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
                self.state.library.enable_object_caching()
                self.state.type_annotation = None
                manager = PassManager("kernel")
                for one in passes:
                    manager.add_pass(one, one.__name__)
                manager.finalize()
                return [manager]

        return Compiler

    return compiler(JITCodeLibrary), compiler(Part)


@cache
def _resolve_operators_once(context: Any) -> None:
    """Have numba find an operator between two types of numbers once, not among arrays and texts at each place."""
    from numba.core import types

    resolve, known = context.resolve_function_type, {}

    def resolve_once(function: Any, args: Any, kws: Any) -> Any:
        module = getattr(getattr(function, "typing_key", None), "__module__", None)
        if module != "_operator" or not all(isinstance(one, types.Number) for one in args):
            return resolve(function, args, kws)
        key = id(function), tuple(args)
        if key not in known:
            known[key] = function, resolve(function, args, kws)  # with the function, whose number then stays its own
        return known[key][1]

    context.resolve_function_type = resolve_once


def _store(folder: Path, name: str) -> Any:
    """Numba's access to the stored machine code of the kernel of this name, a file for each signature."""
    from numba.core.caching import NullCache
    from numba.core.compiler import CompileResult
    from numba.core.serialize import dumps

    class Store(NullCache):
        def file(self, signature: Any) -> Path:
            return folder / f"{name}-{_digest(signature)}.kernel"

        def load_overload(self, signature: Any, target_context: Any) -> Any:
            target_context.refresh()
            stored = _machine_code(self.file(signature))
            return None if stored is None else CompileResult._rebuild(target_context, *pickle.loads(stored))

        def save_overload(self, signature: Any, compiled: Any) -> None:
            content = dumps(compiled._reduce())
            with contextlib.suppress(DataError), atomic_write(self.file(signature)) as part:
                part.write_bytes(_checksum(self.file(signature), content) + content)
                _used.add(self.file(signature).name)

    return Store()


def _machine_code(file: Path) -> bytes | None:
    """Content of a stored kernel behind its checksum; None if it is missing or, with a message, damaged."""
    try:
        content = file.read_bytes()
    except (OSError, ValueError):  # a name with a zero byte, of a damaged list
        return None
    if content[:CHECKSUM_BYTES] == _checksum(file, content[CHECKSUM_BYTES:]):
        _used.add(file.name)
        return content[CHECKSUM_BYTES:]
    print(f"srbval: the compiled kernel {file} is damaged or of another version; it is compiled again", file=sys.stderr)
    with contextlib.suppress(OSError):
        file.unlink()
    return None


def _checksum(file: Path, content: bytes) -> bytes:
    """SHA-256 of a stored kernel with its name, which depends on the machine, and the version of its sources."""
    return hashlib.sha256(f"{file.parent.name}/{file.name}\n".encode() + content).digest()


@cache
def kernel_cache_folder() -> Path:
    """Folder of the compiled kernels of exactly this version of the kernels' sources, and of all that these import.

    It does not depend on where the package lies, so that all its copies share their kernels.
    """
    package = package_folder()
    sources = (package / "models").rglob("*_kernel.py")
    modules = (".".join(source.relative_to(package.parent).with_suffix("").parts) for source in sources)
    return cache_folder(KERNELS) / content_version(*sorted(modules))


def is_compiled(*scenes: Scene) -> bool:
    """True if the kernels that `scenes` need are in the cache, or nothing is to be compiled."""
    return not missing_kernels(*scenes)


def precompile(*scenes: Scene, jobs: int | None = None) -> float:
    """Compile the kernels that `scenes` need and that the cache lacks; returns the seconds it took.

    If another process compiles, this one waits and then checks again.

    `jobs` processes compile at a time (default: one for each usable core), each a share of the kernels. Nothing happens
    if the cache has them, if numba is switched off, and within the compiling process itself. If such a process fails,
    this process compiles the missing kernels when it uses them.
    """
    from filelock import FileLock

    with _lock:
        missing = [kernel for kernel in missing_kernels(*scenes) if kernel not in _requested]
        if not missing:
            return 0.0
        _requested.update(missing)
        started = time.perf_counter()
        with contextlib.suppress(OSError), contextlib.ExitStack() as running:
            kernel_cache_folder().mkdir(parents=True, exist_ok=True)
            running.enter_context(FileLock(kernel_cache_folder() / "all.lock"))
            missing = [kernel for kernel in missing if not _is_stored(kernel)]  # others may have compiled some
            for process in [running.enter_context(_compiler(one)) for one in _shares(missing, jobs)]:
                process.wait()
        return time.perf_counter() - started


def expected_s(*scenes: Scene) -> float:
    """Estimate how long `precompile` will take on this machine under its present load [s], from a short measurement."""
    started = time.process_time()
    sum(map(hash, range(PACE_ROUNDS)))
    pace_s = time.process_time() - started
    longest = max((sum(map(_work, share)) for share in _shares(missing_kernels(*scenes), None)), default=0.0)
    return pace_s * longest * max(1.0, (load_average() or 0.0) / usable_cores())


def _work(kernel: str) -> float:
    """Time to compile a kernel, in units of the loop in `expected_s`."""
    model, part, *_ = kernel.split("-")
    return WORK[part] * (SLICES_WORK if model == "slices" else 1.0)


def _shares(kernels: list[str], jobs: int | None) -> list[list[str]]:
    """The kernels for each of the compiling processes, as many as usable cores unless `jobs` are given."""
    count = min(len(kernels), jobs or usable_cores())
    return [kernels[first::count] for first in range(count)]


def kernels_of(scene: Scene) -> list[str]:
    """Names of the kernels that the scene's run needs: model, part, cages, oil, free rollers; the line is full's.

    Models with the full model's equations need their ``rates``, and the steps of the family of the scene's solver.
    """
    if scene.model in WITHOUT_KERNELS or scene.solver.name not in METHODS:
        return []
    parts = (RING,) if scene.model == "planar" else (RATES, FAMILIES[METHODS[scene.solver.name].coefficients.family])
    end = ("" if scene.oil is None else OIL) + (FREE_ROLLERS if scene.bodies.free_rollers else "")
    model = "full" if scene.model == "line" else scene.model
    return [f"{model}-{part}-{scene.bodies.cages}{end}" for part in parts]


def missing_kernels(*scenes: Scene) -> list[str]:
    """Kernels that the scenes need and that are not in the cache."""
    wanted = () if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0" else chain.from_iterable(map(kernels_of, scenes))
    return [kernel for kernel in dict.fromkeys(wanted) if not (kernel in _found or _is_stored(kernel))]


def _is_stored(kernel: str) -> bool:
    """True if all machine code of a kernel is in the cache and not damaged; a process asks once for each kernel."""
    try:
        names = _list_of(kernel).read_text("ascii").split()
    except (OSError, ValueError):
        return False
    if names and all(_machine_code(kernel_cache_folder() / name) is not None for name in names):
        _found.add(kernel)
    return kernel in _found


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


def compile_and_list(kernel: str, compile_kernel: Callable[[], object]) -> None:
    """Compile a kernel in this process and write the list of its files, by which others find it."""
    _used.clear()
    compile_kernel()
    with contextlib.suppress(DataError), atomic_write(_list_of(kernel)) as part:
        part.write_text("\n".join(sorted(_used)), "ascii")


def _list_of(kernel: str) -> Path:
    """File that lists the files with the machine code of a kernel for this machine."""
    return kernel_cache_folder() / f"compiled-{kernel}-{_digest()}"


def _digest(signature: Any = None) -> str:
    return hashlib.sha256(f"{signature} {machine()}".encode()).hexdigest()[:16]


@cache
def machine() -> str:
    """Processor, Python, libraries and settings of numba: numbers depend on them beside the sources."""
    from llvmlite import binding

    processor = binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()
    versions = [metadata.version(name) for name in ("numba", "llvmlite", "numpy", "scipy")]
    settings = sorted(f"{k}={v}" for k, v in os.environ.items() if k.startswith("NUMBA_") and k not in WITHOUT_EFFECT)
    return repr((sys.version, processor, versions, settings))
