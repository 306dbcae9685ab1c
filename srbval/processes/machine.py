"""The machine: its processor, the cores that this process may use, its load."""

import os
import platform
from pathlib import Path
from typing import Any


def this_machine() -> dict[str, Any]:
    """Processor and usable cores, as stored results name them."""
    return {"processor": processor_name(), "usable_cores": usable_cores()}


def load_average() -> float | None:
    """Processes that wanted a core, mean of the last minute."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def usable_cores() -> int:
    """Cores that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def processor_name(listing: Path = Path("/proc/cpuinfo")) -> str:
    """The processor's name as the system gives it; its architecture where it gives none."""
    if listing.is_file():
        for line in listing.read_text(encoding="utf-8", errors="replace").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name" and value.strip():
                return value.strip()
    return platform.processor() or platform.machine()
