"""Provenance of a report: facts on each simulation run, software versions, computer, seeds and recordings."""

import os
import platform
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import Any

from srbval import __version__
from srbval.comparison.counterpart import SimulationCase
from srbval.models.hierarchy import level_of
from srbval.models.run import Run
from srbval.processes.machine import processor_name
from srbval.recordings.datasets.description import dataset
from srbval.recordings.manifest import RegisteredRecording
from srbval.recordings.registry import RIG_EXCERPTS
from srbval.storage.installation import git_revision, shipped_folder

PACKAGES = ("numpy", "scipy", "numba", "pandas", "PyWavelets", "h5py", "matplotlib")


def provenance(runs: Iterable[Run], registered: Iterable[RegisteredRecording]) -> dict[str, Any]:
    """Return software versions, git revision, computer, random seeds and recordings on which a report is based."""
    entries = tuple(registered)
    shipped = [one for one in entries if Path(one.file).parent == shipped_folder(RIG_EXCERPTS)]
    origin = dataset(shipped[0].dataset or "") if shipped else None
    form = {"files": [Path(one.file).name for one in shipped], "changes": "single precision, speed at 640 Hz"}
    facts: dict[str, Any] = {
        "srbval": __version__,
        "git_revision": git_revision(),
        "python": platform.python_version(),
        "packages": {name: metadata.version(name) for name in PACKAGES},
        "machine": {"system": platform.system(), "processor": processor_name(), "cores": os.cpu_count()},
        "seeds": sorted({run.scene.seed for run in runs}),
        "recordings": {Path(entry.file).name: entry.sha256 for entry in entries},
    }
    if origin:
        facts["recordings_shipped_with_srbval"] = {"source": origin.source, "licence": origin.licence} | form
    return facts


def run_facts(case: SimulationCase, run: Run) -> dict[str, Any]:
    """Describe a run for ``report.json``; the key ``numerics`` holds its estimated time-step error, or None."""
    scene, own_solver = run.scene, level_of(run.scene.model).own_solver
    return {
        "id": case.id,
        "purpose": case.purpose,
        "model": scene.model,
        "shaft_rpm": 60 * scene.shaft_hz,
        "seconds": run.seconds,
        "solver": own_solver or scene.solver.name,
        "step_s": None if own_solver else scene.solver.step_s,
        "status": run.status.value,
        "reason": run.reason,
        "cpu_per_simulated_s": run.cpu_per_simulated_s,
        "cage_ratio": run.cage_ratio,
        "energy_imbalance": run.energy_imbalance,
        "numerics": None if run.step_error is None else run.step_error.to_dict(),
    }
