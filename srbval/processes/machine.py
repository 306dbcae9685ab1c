"""The machine that the program runs on, and the cores and threads that this process may use."""

import contextlib
import functools
import os
import platform
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

_lock = threading.Lock()
_limits: list[Any] = []  # one for each that is within; the first restores what was before


def usable_cores() -> int:
    """Cores that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Within, or in a function decorated with it, the libraries that are loaded use one thread.

    Small products are quicker so: threads on a busy machine wait for each other, several times as long as they work.
    The limit is the process's: where several threads are within, the last one to leave restores what was before.
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


def this_machine() -> dict[str, Any]:
    """Processor and usable cores, as stored results name them."""
    return {"processor": processor_name(), "usable_cores": usable_cores()}


def load_average() -> float | None:
    """Mean number of processes that wanted a core in the last minute; None if the system does not state it."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def processor_name(listing: Path = Path("/proc/cpuinfo")) -> str:
    """The processor's name as the system states it, otherwise its architecture."""
    if listing.is_file():
        for line in listing.read_text(encoding="utf-8", errors="replace").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name" and value.strip():
                return value.strip()
    return platform.processor() or platform.machine()
