"""The machine that a benchmark ran on."""

import os
import platform
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

from srbval import __version__
from srbval.processes.machine import usable_cores

PACKAGES = ("numpy", "scipy", "numba", "llvmlite")


def machine_before() -> Callable[[], dict[str, Any]]:
    """Note the load of the last minute before a measurement; what is returned describes the machine after it.

    Loads are None where the system does not tell.
    """
    load = load_average()

    def described() -> dict[str, Any]:
        versions = {"srbval": __version__, "python": platform.python_version()}
        return {
            "processor": processor_name(), "architecture": platform.machine(), "system": platform.platform(terse=True),
            "cores": os.cpu_count() or 1, "usable_cores": usable_cores(),
            "versions": versions | {name: metadata.version(name) for name in PACKAGES},
            "load_before": load, "load_after": load_average(),
        }  # fmt: skip

    return described


def this_machine() -> dict[str, Any]:
    """Processor and usable cores, as stored results name them."""
    return {"processor": processor_name(), "usable_cores": usable_cores()}


def load_average() -> float | None:
    """Processes that wanted a core, mean of the last minute."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def processor_name(listing: Path = Path("/proc/cpuinfo")) -> str:
    """The processor's name as the system gives it; its architecture where it gives none."""
    if listing.is_file():
        for line in listing.read_text(encoding="utf-8", errors="replace").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name" and value.strip():
                return value.strip()
    return platform.processor() or platform.machine()
