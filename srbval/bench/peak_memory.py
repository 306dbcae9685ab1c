"""Peak memory of a process."""

from __future__ import annotations

import sys
from pathlib import Path


def peak_bytes() -> int | None:
    """Peak resident memory of this process so far; None where the system does not tell.

    On Linux the high-water mark of its own memory: `ru_maxrss` of a new process begins with its parent's.
    """
    status = Path("/proc/self/status")
    if status.is_file():
        marks = [line.split() for line in status.read_text(encoding="utf-8").splitlines() if line.startswith("VmHWM:")]
        if marks:
            return int(marks[0][1]) * 1024
    try:
        import resource
    except ImportError:  # Windows has no such count
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024
