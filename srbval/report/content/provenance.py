"""Where the report comes from: versions, revision, machine, seeds, data, the command that makes it again."""

from __future__ import annotations

import os
import platform
from importlib import metadata
from pathlib import Path
from typing import Any

from srbval import __version__
from srbval.evidence.gather import Evidence
from srbval.storage.own_package import git_revision

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
