"""The cores and threads that this process may use."""

import contextlib
import functools
import os
import threading
from collections.abc import Iterator
from typing import Any

_lock = threading.Lock()
_limits: list[Any] = []  # one for each that is within; the first restores what was before


def usable_cores() -> int:
    """Cores that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Limit the loaded libraries to one thread, within a block or a decorated function.

    Small products are quicker so: threads on a busy machine wait for each other, several times as long as they work.
    The limit is the process's: if several threads are within, the last one to leave restores the former limit.
    """
    with _lock:
        _limits.append(_loaded().limit(limits=1))
    try:
        yield
    finally:
        with _lock:
            limit = _limits.pop()
            if not _limits:
                limit.restore_original_limits()


@functools.cache
def _loaded() -> Any:
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()  # takes 8 ms to find them, and then 10 us a limit
