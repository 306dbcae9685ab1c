"""Where the report comes from: versions, revision, machine, seeds, data, the command that makes it again."""

from __future__ import annotations

import os
import platform
import subprocess
from importlib import metadata
from pathlib import Path
from typing import Any

from srbval import __version__
from srbval.validation.evidence import Evidence

PACKAGES = ("numpy", "scipy", "numba", "pandas", "PyWavelets", "h5py", "matplotlib")


def provenance(evidence: Evidence, command: str) -> dict[str, Any]:
    """Facts for ``report.json`` and the last section."""
    return {
        "command": command,
        "srbval": __version__,
        "git_revision": git_revision(),
        "python": platform.python_version(),
        "packages": {name: metadata.version(name) for name in PACKAGES},
        "machine": {"system": platform.system(), "processor": platform.machine(), "cores": os.cpu_count()},
        "seeds": sorted({run.scene.seed for run in evidence.runs.values()}),
        "recordings": {Path(entry.file).name: entry.sha256 for entry in evidence.registered},
    }


def git_revision() -> str | None:
    """Revision of the source tree the program runs from; None for an installed copy."""
    root = Path(__file__).resolve().parents[3]
    if not (root / ".git").exists():
        return None
    try:
        text = subprocess.run(
            ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=12"],
            capture_output=True, text=True, timeout=10, check=True,
        ).stdout.strip()  # fmt: skip
    except (OSError, subprocess.SubprocessError):
        return None
    return text or None
