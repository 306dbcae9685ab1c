"""Runs that were made before, from the user's cache; made now, and stored, where they are not there.

A stored run is what the same code would compute now on this machine, bit for bit, the estimate of its step's error or
the step that was chosen for it included. Only the times that it took are of then, see `RunSummary.stored_utc`. Runs
that are not usable, and those too large for the cache, are not stored; nor are hundreds of draws of a scene, which
would leave room for nothing else: what is read from them may be (`ContentStore`).
"""

import contextlib
import shutil
from functools import partial
from pathlib import Path

import numpy as np

from srbval.models import outputs as col
from srbval.models.health import default_solver
from srbval.models.hierarchy import level_of
from srbval.models.jit import machine
from srbval.models.run import Run, RunSummary
from srbval.models.run_file import read_run, read_summary, scene_content, write_run
from srbval.models.simulate import Step, simulate, simulate_to_file
from srbval.progress import Progress, silent
from srbval.scene import Scene
from srbval.storage.content_store import LARGEST_BYTES, ContentStore
from srbval.storage.files import atomic_write, check_suffix
from srbval.storage.hdf5_files import HDF5
from srbval.storage.sources import content_version

RUNS = ContentStore(kind="run", computed_by="srbval.models.simulate", suffix=".h5")


def run_content(scene: Scene, step: Step = Step.UNCHECKED) -> str:
    """All that a run follows from, as text, but for the run layer: the scene and its bearing's data, seed included.

    Further how its step is checked, the sources of its level alone, the solver that statuses compare it with, and the
    `machine`: what is computed differs in its last digits from processor to processor and from one version of numba or
    NumPy to the next, and a rattling roller makes that grow.
    """
    version = content_version(*level_of(scene.model).modules, lazy=False)
    return f"{version} {step} {default_solver()} {machine()} {scene.bearing} {scene_content(scene)}"


def stored_run(scene: Scene, *, step: Step = Step.CHECKED, progress: Progress = silent) -> Run:
    """As `simulate`, but a run that was made before is read."""
    content = run_content(scene, step)
    found = RUNS.load(content, lambda table: read_run(RUNS.path(content), read_summary(table, scene)))
    if found is None:
        found = simulate(scene, step=step, progress=progress)
        if _is_worth_it(found):
            RUNS.keep(content, partial(write_run, found))
    return found


def stored_summary(
    scene: Scene, output: Path | None, *, step: Step = Step.CHECKED, progress: Progress = silent
) -> RunSummary:
    """The summary of a run, its signals in the file `output` if named: see `stored_run`, `simulate_to_file`."""
    content = run_content(scene, step)
    found = RUNS.load(content, partial(read_summary, scene=scene))
    if output is None:
        return found or stored_run(scene, step=step, progress=progress)
    check_suffix(output, *HDF5)
    if found is not None:
        with contextlib.suppress(FileNotFoundError):  # removed meanwhile
            _copy(RUNS.path(content), output)
            return found
    found = simulate_to_file(scene, output, step=step, progress=progress)
    if _is_worth_it(found):
        RUNS.keep(content, partial(_copy, output))
    return found


def _is_worth_it(run: RunSummary) -> bool:
    return run.status.usable and run.samples * col.COUNT * np.dtype(float).itemsize < LARGEST_BYTES


def _copy(path: Path, to: Path) -> None:
    with path.open("rb") as source, atomic_write(to) as part, part.open("wb") as copied:
        shutil.copyfileobj(source, copied)
