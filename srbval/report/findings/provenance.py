"""Provenance of a report: software versions, computer, random seeds and recordings."""

import os
import platform
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import Any

from srbval import __version__
from srbval.models.run import Run
from srbval.processes.machine import processor_name
from srbval.recordings.manifest import RegisteredRecording
from srbval.storage.installation import git_revision

PACKAGES = ("numpy", "scipy", "numba", "pandas", "PyWavelets", "h5py", "matplotlib")


def provenance(runs: Iterable[Run], registered: Iterable[RegisteredRecording]) -> dict[str, Any]:
    """Return software versions, git revision, computer, random seeds and recordings on which a report is based."""
    return {
        "srbval": __version__,
        "git_revision": git_revision(),
        "python": platform.python_version(),
        "packages": {name: metadata.version(name) for name in PACKAGES},
        "machine": {"system": platform.system(), "processor": processor_name(), "cores": os.cpu_count()},
        "seeds": sorted({run.scene.seed for run in runs}),
        "recordings": {Path(entry.file).name: entry.sha256 for entry in registered},
    }
