"""Processor name, and the cores, threads and memory that this process may use."""

import contextlib
import functools
import math
import os
import platform
import re
import threading
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import Any

OWN_GROUPS, GROUPS = Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")  # control groups of Linux, version 2
_lock = threading.Lock()
_limits: list[Any] = []  # one per active context; the first restores the original limits


def usable_cores() -> int:
    """Number of cores that this process may use, limited by its CPU affinity and its container's quota."""
    known = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, math.ceil(min([known, *_quotas()])))


def _quotas() -> Iterator[float]:
    """Yield the CPU quota [cores] of this process's control group and of every group above it."""
    listed = OWN_GROUPS.read_text("utf-8").splitlines() if OWN_GROUPS.is_file() else ()
    for place in (PurePosixPath(line.removeprefix("0::")) for line in listed if line.startswith("0::")):
        for group in (place, *place.parents):
            with contextlib.suppress(OSError, ValueError):  # not mounted, or "max" instead of a number
                quota, period = map(int, (GROUPS / str(group).lstrip("/") / "cpu.max").read_text("ascii").split())
                yield quota / period


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Limit the loaded libraries to one thread, within a block or a decorated function.

    Small matrix products are faster with one thread: several threads on a busy machine mostly wait for each other. The
    limit applies to the whole process; if several threads use it, the last thread to leave restores the former limit.
    """
    with _lock:
        _limits.append(_thread_controller().limit(limits=1))
    try:
        yield
    finally:
        with _lock:
            limit = _limits.pop()
            if not _limits:
                limit.restore_original_limits()


@functools.cache
def _thread_controller() -> Any:
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()  # finding the libraries takes 8 ms, setting a limit 10 us


def is_single_threaded() -> bool:
    """True if this process has only one thread, library threads included; False if the number is unknown."""
    with contextlib.suppress(OSError):
        return len(os.listdir("/proc/self/task")) == 1
    return False


def limit_resource(name: str, most: int) -> None:
    """Set a limit of the module `resource`, such as ``RLIMIT_CPU``; does nothing on systems without this limit."""
    with contextlib.suppress(ImportError, AttributeError, ValueError, OSError):
        import resource

        kind = getattr(resource, name)
        resource.setrlimit(kind, (most, resource.getrlimit(kind)[1]))


def limit_memory(most_bytes: float) -> None:
    """Limit the memory of this process to `most_bytes` above its present size; works on Linux only."""
    with contextlib.suppress(OSError, IndexError):
        held_kb = int(Path("/proc/self/status").read_text("ascii").split("VmData:")[1].split()[0])
        limit_resource("RLIMIT_DATA", held_kb * 1024 + round(most_bytes))


def this_machine() -> dict[str, Any]:
    """Processor and usable cores, as stored in results."""
    return {"processor": processor_name(), "usable_cores": usable_cores()}


def load_average() -> float | None:
    """Mean number of processes that used or waited for a core in the last minute; None if unknown."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def processor_name(listing: Path = Path("/proc/cpuinfo")) -> str:
    """Name of the processor as the system states it, otherwise its architecture."""
    text = listing.read_text(encoding="utf-8", errors="replace") if listing.is_file() else ""
    found = re.search(r"^model name\s*:[ \t]*(\S.*?)\s*$", text, re.MULTILINE)
    return found[1] if found else platform.processor() or platform.machine()
