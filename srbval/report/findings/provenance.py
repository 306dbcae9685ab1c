"""Provenance of a report: facts on each simulation run, software versions, computer, seeds and recordings."""

import os
import platform
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import Any

from srbval import __version__
from srbval.comparison.counterpart import SimulationCase
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


def run_facts(case: SimulationCase, run: Run) -> dict[str, Any]:
    """Describe a run for ``report.json``; the key ``numerics`` holds its estimated time-step error, or None."""
    scene, step_error = run.scene, run.step_error
    names = ("seconds", "status", "reason", "cpu_per_simulated_s", "cage_ratio", "energy_imbalance")
    about = {"id": case.id, "purpose": case.purpose, "model": scene.model, "shaft_rpm": 60 * scene.shaft_hz}
    about |= {"solver": scene.solver.name, "step_s": scene.solver.step_s}
    return about | {name: getattr(run, name) for name in names} | {"numerics": step_error and step_error.to_dict()}
