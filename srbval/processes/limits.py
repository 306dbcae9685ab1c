"""Limits of this process that the system keeps, as far as it can."""

import contextlib
from pathlib import Path


def limit(name: str, most: int) -> None:
    """Set one of the limits in the module `resource`, such as ``RLIMIT_CPU``; does nothing where there is none."""
    with contextlib.suppress(ImportError, AttributeError, ValueError, OSError):
        import resource

        kind = getattr(resource, name)
        resource.setrlimit(kind, (most, resource.getrlimit(kind)[1]))


def limit_memory(most_bytes: float) -> None:
    """Let this process take so much memory beside what it has now; known on Linux only."""
    with contextlib.suppress(OSError, IndexError):
        held_kb = int(Path("/proc/self/status").read_text("ascii").split("VmData:")[1].split()[0])
        limit("RLIMIT_DATA", held_kb * 1024 + round(most_bytes))
