"""The machine that the program runs on, as results name it."""

import os
import platform
import re
from pathlib import Path
from typing import Any

from srbval.processes.machine import usable_cores


def this_machine() -> dict[str, Any]:
    """Processor and usable cores, as stored results name them."""
    return {"processor": processor_name(), "usable_cores": usable_cores()}


def load_average() -> float | None:
    """Mean number of processes that wanted a core in the last minute; None if the system does not state it."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def processor_name(listing: Path = Path("/proc/cpuinfo")) -> str:
    """The processor's name as the system states it, otherwise its architecture."""
    text = listing.read_text(encoding="utf-8", errors="replace") if listing.is_file() else ""
    found = re.search(r"^model name\s*:[ \t]*(\S.*?)\s*$", text, re.MULTILINE)
    return found[1] if found else platform.processor() or platform.machine()
