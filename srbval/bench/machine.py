"""The machine that a benchmark ran on."""

from __future__ import annotations

import os
import platform
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from srbval import __version__
from srbval.bench.calibration import SpeedCalibration

PACKAGES = ("numpy", "scipy", "numba", "llvmlite")


@dataclass(frozen=True, kw_only=True)
class Machine:
    """Processor, cores that this process may use, versions; load of the last minute and calibration, before and after.

    `load_before` and `load_after` are None where the system does not tell.
    """

    processor: str
    architecture: str
    system: str
    cores: int
    usable_cores: int
    versions: dict[str, str]
    load_before: float | None
    load_after: float | None
    calibration: SpeedCalibration
    calibration_after_s: float


def describe_machine(calibration: SpeedCalibration, after: SpeedCalibration, load_before: float | None) -> Machine:
    """This machine now; `load_before` and `calibration` were read at the start."""
    versions = {"srbval": __version__, "python": platform.python_version()}
    return Machine(
        processor=processor_name(),
        architecture=platform.machine(),
        system=platform.platform(terse=True),
        cores=os.cpu_count() or 1,
        usable_cores=usable_cores(),
        versions=versions | {name: metadata.version(name) for name in PACKAGES},
        load_before=load_before,
        load_after=load_average(),
        calibration=calibration,
        calibration_after_s=after.seconds,
    )


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
