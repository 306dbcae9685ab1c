"""The one place that names numba.

Set ``NUMBA_DISABLE_JIT=1`` to run every kernel as plain Python, for stepping through and for coverage.

Compiled kernels are kept on disk, see `kernel_cache`.
"""

from collections.abc import Callable
from typing import Any

import numba

from srbval.models.kernel_cache import kernel_cache_folder

# Sums may be reordered and products contracted, so that loops vectorise. Infinities and NaN keep their
# meaning: a broken run must stay visible.
FAST_MATH = {"reassoc", "contract", "nsz", "arcp"}

# `_nrt`: without reference counting. `forceinline`: within the kernels that call it.
OPTIONS: dict[str, Any] = {
    "cache": True, "nogil": True, "fastmath": FAST_MATH, "error_model": "numpy", "_nrt": False, "forceinline": True,
}  # fmt: skip


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile `function` for the processor at hand, kept on disk, releasing the interpreter lock.

    Kernels work in arrays they are given and make none: they are compiled without reference counting, which would
    count every array of a parameter tuple in and out at each call.

    A kernel's machine code calls no other kernel's. Otherwise it would carry weak copies of those, each optimised for
    its place with its sums in an order of its own, and the linker would take whichever came into memory first: the
    last digits of a run would depend on what its process had done before, and a rattling roller makes them grow.
    """
    return _compiled(function)


def kernel_part(function: Callable[..., Any]) -> Callable[..., Any]:
    """As `kernel`, for a part of one kernel alone: written out in its place before types are known.

    It is not compiled by itself as well, unless it is called from Python: half a second to three saved for a large one.
    """
    return _compiled(function, inline="always")


def exactly_rounded(function: Callable[..., Any]) -> Callable[..., Any]:
    """As `kernel`, but each operation is rounded as written, whatever stands around the call."""
    return _compiled(function, fastmath=False)


def _compiled(function: Callable[..., Any], **more: Any) -> Callable[..., Any]:
    settings = vars(numba.config)
    before = settings["CACHE_DIR"]
    settings["CACHE_DIR"] = str(kernel_cache_folder())
    try:
        compiled: Callable[..., Any] = numba.njit(**(OPTIONS | more))(function)
    finally:
        settings["CACHE_DIR"] = before
    return compiled
